"""The report: nothing a scene says can run in it, and it needs nothing from elsewhere."""

import base64
import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest

from microsurf import report, result, validate
from microsurf.commands.validate import built_in_scenes
from microsurf.errors import InputError
from microsurf.expectation import Expectation
from microsurf.scene import Accuracy, Light, Material, Scene, Surface
from microsurf.scene_file import read

NASTY = "<script>alert(\"x\")</script> & 'quotes' {{ 7 * 7 }} </title><img src=x onerror=a()> σ"
SCENE = Scene(
    title=NASTY,
    rationale=NASTY,
    material=Material(1.5, (0.0,)),
    surface=Surface(cells=16, realisations=2),
    light=Light((0.0, 60.0)),
    accuracy=Accuracy(2000),
    expect={"specular": Expectation(("holds|departs|undecided",), 0.05, NASTY)},
)
NAME = 'a"b<c>'


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("report")
    entry = validate.validate_scene(NAME, SCENE)
    report.write([entry, replace(entry, name="broken", broken=[NASTY])], out, 7)
    return out


@pytest.fixture(scope="module")
def page(folder):
    return (folder / "report.html").read_text(encoding="utf-8")


class Tags(HTMLParser):
    """All tags of a page with their attributes, and its text."""

    def __init__(self, page):
        super().__init__()
        self.tags, self.text = [], []
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        """Keep a tag with its attributes."""
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data):
        """Keep text."""
        self.text.append(data)


def test_what_a_scene_says_is_text(page):
    parsed = Tags(page)
    names = {tag for tag, _ in parsed.tags}
    assert not names & {"script", "iframe", "object", "embed", "form", "link", "base"}
    for _, attributes in parsed.tags:
        assert not [name for name in attributes if name.startswith("on")]
    text = "".join(parsed.text)
    assert text.count(NASTY) >= 5  # title, rationale, why of two scenes, one broken invariant
    assert f'id="{NAME}"' not in page


def test_the_page_says_what_halves_the_errors(page):
    text = "".join(Tags(page).text)
    assert text.count("what to buy next") == 2
    assert text.count("8 surfaces instead of 2") == 2 * 2 * 3  # scenes, angles, quantities


def test_the_page_needs_nothing_from_elsewhere(page):
    for tag, attributes in Tags(page).tags:
        for name in ("src", "href", "srcset", "action", "data", "poster"):
            address = attributes.get(name, "#")
            assert address.startswith(("#", "data:image/svg+xml;base64,")), (tag, address)
    style = page[page.index("<style>") : page.index("</style>")]
    assert "url(" not in style
    assert "@import" not in style


def test_pictures_are_svg_that_can_not_run(page):
    pictures = re.findall(r'src="data:image/svg\+xml;base64,([^"]+)"', page)
    assert len(pictures) == 8  # four for each scene
    for picture in pictures:
        svg = base64.b64decode(picture, validate=True).decode()
        assert "<script" not in svg
        addresses = re.findall(r'(?:xlink:)?href="([^"]+)"', svg)
        assert all(a.startswith(("#", "data:")) for a in addresses)


def test_links_inside_the_page_lead_somewhere(page):
    tags = Tags(page).tags
    there = {attributes["id"] for _, attributes in tags if "id" in attributes}
    for tag, attributes in tags:
        if tag == "a":
            assert attributes["href"].removeprefix("#") in there


def test_pictures_have_words(page):
    for tag, attributes in Tags(page).tags:
        if tag == "img":
            assert len(attributes["alt"]) > 20


def test_report_json_is_strict(folder):
    text = (folder / "report.json").read_text(encoding="utf-8")
    document = json.loads(text, parse_constant=lambda word: pytest.fail(f"{word} in JSON"))
    assert document["seed"] == 7
    assert document["schema"] == 1
    assert [scene["name"] for scene in document["scenes"]] == [NAME, "broken"]
    first = document["scenes"][0]
    assert first["title"] == NASTY
    assert {"quantity", "effect", "low", "high", "verdict", "unexpected"} <= set(
        first["comparisons"][0]
    )
    assert first["measured"]["paths"] == 2 * 2 * 2000
    errors = first["errors"]
    assert {row["quantity"] for row in errors} == {"specular", "total", "specular lobe"}
    assert {"within", "between", "between_low", "dominant", "rays_to_halve"} <= set(errors[0])
    assert all(row["surfaces_to_halve"] == 8 for row in errors)
    assert sorted(p.name for p in folder.iterdir()) == ["report.html", "report.json"]


def test_a_folder_that_can_not_be_made_is_refused(tmp_path):
    (tmp_path / "file").touch()
    for out in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(InputError, match="folder"):
            report.make_folder(out)
    report.make_folder(tmp_path / "a" / "b")
    assert (tmp_path / "a" / "b").is_dir()


def test_plots_of_results_that_do_not_fit_together_are_refused(tmp_path):
    flux = validate.validate_scene("s", replace(SCENE, light=Light((30.0,)))).measured
    other = validate.validate_scene("s", replace(SCENE, light=Light((40.0,)))).measured
    for results, why in (({"a": flux, "b": other}, "angles"), ({"a": flux, "b": flux}, "give one")):
        with pytest.raises(InputError, match=why):
            report.plot_results(results, tmp_path / "p.png")
    assert list(tmp_path.iterdir()) == []
    result.save(flux, tmp_path / "r.nc")  # as the command line gets them
    report.plot_results({"a": result.load(tmp_path / "r.nc")}, tmp_path / "p.svg")
    assert (tmp_path / "p.svg").stat().st_size > 0


@pytest.mark.parametrize("file", built_in_scenes(), ids=lambda path: path.stem)
def test_built_in_scenes_say_why_they_are_there(file):
    scene = read(file)
    assert len(scene.title) > 5
    assert len(scene.rationale) > 20
    for expected in scene.expect.values():
        assert expected.why


def test_there_are_the_built_in_scenes_that_were_asked_for():
    """Three of Ribardière 2018, three glasses, two limits, two extremes of Kd, two flat ones."""
    found = {
        (s.roughness.gamma, s.roughness.sigma_x, s.material.n, s.material.kd[0])
        for s in map(read, built_in_scenes())
    }
    wanted = {
        (1.75, 0.7, 1.5, 0.8), (8.0, 0.7, 1.0, 0.8), (1.75, 0.5, 1.5, 0.8),
        (2.81, 0.428, 1.5, 0.0), (2.82, 0.524, 1.5, 0.0), (1.8, 0.406, 1.5, 0.0),
    }  # fmt: skip
    assert wanted <= found
    assert {2.0, 40.0} <= {gamma for gamma, *_ in found}
    assert {0.0, 1.0} <= {kd for *_, kd in found}
    assert {(0.0, 1.0), (0.0, 1.5)} <= {(sigma, n) for _, sigma, n, _ in found}
    assert len({Path(f).stem for f in built_in_scenes()}) == len(built_in_scenes())
