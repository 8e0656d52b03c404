"""What CI reads: report.json by its schema, junit.xml and report.md by their conventions."""

import json
import re
import xml.etree.ElementTree as ET
from copy import deepcopy
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from quick import without_figures

from microsurf import report
from microsurf.analysis import validate, validate_user_brdf, validation
from microsurf.model import UserBrdf
from microsurf.report.junit import to_junit
from microsurf.report.markdown import LONGEST, to_markdown
from microsurf.scene import Accuracy, Light, Material, Roughness, Scene, Surface
from microsurf.scene.expectation import Expectation

NASTY = "<b>&\"'|`*_[x](http://a.b) @you #1 \x00\x0b\n\n# head σ ]]> --> ${x} ~~a~~"
SCENE = Scene(
    title=NASTY,
    material=Material(1.5, (0.0,)),
    surface=Surface(cells=16, realisations=2),
    light=Light((60.0,)),
    accuracy=Accuracy(2000),
    expect={"specular": Expectation(("departs",), 0.05, "said | so <i>")},
)
FLAT = Scene(
    material=Material(1.5, (0.2, 0.8)),
    roughness=Roughness(sigma=(0.0,)),
    light=Light((30.0,), (0.0, 90.0)),
    accuracy=Accuracy(2000),
)
SCHEMA = json.loads((Path(report.__file__).parent / "report.schema.json").read_text("utf-8"))


check = jsonschema.Draft202012Validator(SCHEMA).validate


@pytest.fixture(scope="module")
def folder(tmp_path_factory, few_walks):  # noqa: ARG001 - for its effect
    """A report of a rough scene, a flat one and a user BRDF's, against one with other figures."""
    entry = validate.validate_scene("a|b<c>", SCENE)
    flat = validate.validate_scene("flat", FLAT)
    broken = replace(flat, name="broken", faults=[NASTY, "energy: is gone"])
    own = UserBrdf("own:f", lambda _, o: (0.1 * o[:, 2] + 0.01, np.zeros(len(o))))
    tried = validate_user_brdf.judge(replace(entry, name="tried", heightfield=None), own, [])
    scenes = [
        json.loads(json.dumps(validation.as_json(e), default=np.ndarray.tolist))
        for e in (entry, flat)
    ]
    scenes[0]["comparisons"][0] |= {"measured": 1.0, "verdict": "holds"}
    old = {"schema": 3, "microsurf": "0", "scenes": scenes}
    out = tmp_path_factory.mktemp("now")
    with pytest.MonkeyPatch.context() as patch:
        without_figures(patch)
        report.write([entry, flat, broken, tried], out, 7, old=("old.json", old))
    return out


@pytest.fixture(scope="module")
def document(folder):
    return json.loads((folder / "report.json").read_text("utf-8"))


def test_the_schema_is_one():
    jsonschema.Draft202012Validator.check_schema(SCHEMA)


def test_a_real_report_is_as_the_schema_says(document):
    check(document)
    assert document["baseline"]["moved"]
    assert document["scenes"][3]["user_brdf"]["beside_theory"]


def test_keys_may_be_added(document):
    more = deepcopy(document)
    more["budget"] = more["scenes"][0]["more"] = {"terms": []}
    more["scenes"][0]["comparisons"][0]["z"] = 3
    check(more)


def every_key(value, path=()):
    """Paths to all keys that a report's reader may count on."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield (*path, key)
            yield from every_key(inner, (*path, key))
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        yield from every_key(value[0], (*path, 0))


# Named by models, causes and libraries, or held by the surface's own description.
_OPEN = ("figures", "surface", "fit", "libraries", "predicted", "lost_by_cause")


def first_of_lists(value):
    if isinstance(value, dict):
        return {key: first_of_lists(inner) for key, inner in value.items()}
    return [first_of_lists(v) for v in value[:1]] if isinstance(value, list) else value


def test_no_key_may_go_nor_change_its_kind(document):
    """Each key that is there is required, and of its kind: what the schema is strict about."""
    document = first_of_lists({**document, "scenes": document["scenes"][3:]})
    check(document)
    paths = [p for p in every_key(document) if not set(p[:-1]) & set(_OPEN)]
    assert len(paths) > 80
    for path in paths:
        for spoil in ("delete", "replace"):
            wrong = deepcopy(document)
            inner = wrong
            for step in path[:-1]:
                inner = inner[step]
            if spoil == "delete":
                del inner[path[-1]]
            else:
                inner[path[-1]] = [{"not": "this"}]
            with pytest.raises(jsonschema.ValidationError):
                check(wrong)


def test_another_version_is_refused_by_the_schema(document):
    with pytest.raises(jsonschema.ValidationError):
        check({**document, "schema": 1})


def test_junit_counts_and_names(folder, document):
    root = ET.parse(folder / "junit.xml").getroot()  # noqa: S314 - our own
    assert root.tag == "testsuites"
    suites = list(root)
    assert [s.get("name") for s in suites] == [s["name"] for s in document["scenes"]]
    for suite, scene in zip(suites, document["scenes"], strict=True):
        cases = list(suite)
        assert {c.tag for c in cases} == {"testcase"}
        assert len({c.get("name") for c in cases}) == len(cases)  # servers merge what is alike
        assert {c.get("classname") for c in cases} == {f"microsurf.{scene['name']}"}
        assert len(cases) == len(scene["comparisons"]) + len(scene["invariants"]) + len(
            scene["broken"]
        )
        failed = sum(c["unexpected"] for c in scene["comparisons"]) + len(scene["broken"])
        assert int(suite.get("failures")) == len(suite.findall("testcase/failure")) == failed
        assert int(suite.get("tests")) == len(cases)
        assert (suite.get("errors"), suite.get("skipped")) == ("0", "0")
        assert float(suite.get("time")) == pytest.approx(scene["seconds"], abs=1e-3)
    for key in ("tests", "failures"):
        assert int(root.get(key)) == sum(int(s.get(key)) for s in suites)
    assert int(root.get("failures")) > 2


def test_junit_holds_what_xml_can_and_drops_what_it_can_not(document):
    wrong = deepcopy(document)
    # A name that is no UTF-8 comes with half a surrogate pair for each wrong byte.
    wrong["scenes"][0] |= {"name": NASTY + "\ud800", "broken": [NASTY + "\ud800"]}
    text = to_junit(wrong)
    root = ET.fromstring(text)  # noqa: S314 - our own
    assert not re.search("[\x00\x0b\ud800]", text)
    failure = root[0][-1].find("failure")
    assert failure.text == re.sub("[\x00\x0b\ud800]", "", NASTY)


def test_markdown_says_the_unexpected_first(folder):
    text = (folder / "report.md").read_text("utf-8")
    lines = text.splitlines()
    assert re.fullmatch(r"## microsurf: \d+ unexpected", lines[0])
    order = [text.index(part) for part in ("expected departs", "### Against", "### Scenes")]
    assert order == sorted(order)
    assert "own:f against the theory" in text
    assert re.search(r"\n1 of \d+ figures moved", text)
    assert text.endswith("otherwise.\n")


def rows_of(text):
    return [line for line in text.splitlines() if line.startswith("|")]


def test_markdown_tables_are_whole_whatever_a_scene_says(document):
    """Each row has as many bars as its head, and nothing a scene says is markup."""
    wrong = deepcopy(document)
    for scene in wrong["scenes"]:
        scene["name"] = NASTY
        for row in scene["comparisons"]:
            row |= {"unexpected": True, "why": NASTY, "model": NASTY}
    text = to_markdown(wrong)
    bars = [len(re.findall(r"(?<!\\)\|", line)) for line in rows_of(text)]
    assert set(bars) <= {5, 7, 8}
    plain = re.sub(r"\\.", "", text)
    assert "<" not in plain
    assert "`" not in plain
    assert not re.search(r"@\w|\w://|\n# ", plain)
    text.encode()


def test_markdown_fits_a_comment_whatever_the_scenes(document):
    many = deepcopy(document)
    scene = many["scenes"][3]
    scene["name"] = "|" * 3000
    scene["broken"] = ["*" * 5000] * 50
    for row in scene["comparisons"]:
        row |= {"unexpected": True, "why": "_" * 5000}
    scene["comparisons"] *= 20
    scene["user_brdf"]["beside_theory"] *= 20
    many["scenes"] = [scene] * 150
    many["baseline"]["moved"] *= 500
    many["baseline"]["appeared"] = ["<" * 1000] * 500
    text = to_markdown(many)
    assert len(text) <= LONGEST < 65_000
    assert "cut; see report.html" in text
    for part in many["scenes"]:
        part |= {"name": "scene", "broken": [], "user_brdf": None}
    for row in scene["comparisons"]:
        row["why"] = "because"
    text = to_markdown(many)
    assert len(text) <= LONGEST
    assert re.search(r"… and \d+ more in report.html", text)


def test_a_clean_report_is_short(document):
    clean = deepcopy(document)
    clean["baseline"] = None
    clean["scenes"] = [clean["scenes"][1]]
    text = to_markdown(clean)
    assert text.startswith("## microsurf: as expected\n")
    assert "### Against" not in text
    assert len(text) < 1500
