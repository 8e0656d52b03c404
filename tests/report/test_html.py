"""The report: nothing a scene says can run in it, and it needs nothing from elsewhere."""

import base64
import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest
import quick
from matplotlib.figure import Figure

from microsurf import report
from microsurf.analysis import validate
from microsurf.errors import InputError, MicrosurfError
from microsurf.report import attachments, html
from microsurf.report.figures.figure import Picture
from microsurf.report.section import Section, Table
from microsurf.results import datasets
from microsurf.scene import Accuracy, Light, Material, Scene, Surface
from microsurf.scene.builtin import built_in_scenes
from microsurf.scene.expectation import Expectation
from microsurf.surface import Heightfield, fit_std, generate_surface

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
_KINDS = ("effects", "lobes", "albedos", "surface")


pytestmark = pytest.mark.usefixtures("few_walks")


@pytest.fixture(scope="module")
def entries(few_walks):  # noqa: ARG001 - for its effect
    entry = validate.validate_scene(NAME, SCENE, seed=7)
    return [entry, replace(entry, name="broken", faults=[NASTY])]


@pytest.fixture(scope="module", autouse=True)
def _few_pixels():
    with pytest.MonkeyPatch.context() as patch:
        quick.with_few_pixels(patch)
        yield


@pytest.fixture(scope="module")
def folder(entries, tmp_path_factory):
    out = tmp_path_factory.mktemp("report") / "new"
    report.make_folders(out)
    report.write(entries, out, 7, **_FURTHER)
    return out


def _further(name):
    figure = Figure(figsize=(2, 2))
    figure.subplots().plot([1, 2])
    shown = Picture(f"further-{name}", figure, f"A further picture, {NASTY}", [{"x": 1}, {"x": 2}])
    table = Table(f"Table of {NASTY}", [{"a <b>": NASTY, "b": 1.5}, {"b": None}], NASTY)
    return Section(name, f"Further {name}", f"First.\n\n{NASTY}", (table,), (shown,), ("oren1994",))


_FURTHER = {"of_all": [_further("all")], "of_scenes": {NAME: [_further("one")]}}


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
    # title (in the contents too), rationale, why of two scenes, a broken invariant twice, and
    # of two further sections a text, a caption, two cells, a note and a caption
    assert text.count(NASTY) >= 2 * 4 + 2 + 2 * 5
    assert f'id="{NAME}"' not in page


def test_words_between_backticks_are_code_and_nothing_else_is(page):
    words = html.environment().from_string("{{ text | code }}")
    assert words.render(text="a `b < c` & `d") == "a <code>b &lt; c</code> &amp; `d"
    assert "`microsurf" not in page
    assert "<code>microsurf" in page


def test_the_page_says_what_halves_the_errors(page):
    text = "".join(Tags(page).text)
    assert text.count("what to buy next") == 2
    assert text.count("8 surfaces instead of 2") == 2 * 2 * 3  # scenes, angles, quantities


def test_the_page_needs_nothing_from_elsewhere(page):
    for _, attributes in Tags(page).tags:
        for name in ("src", "srcset", "action", "data", "poster"):
            address = attributes.get(name, "data:image/png;base64,")
            assert address.startswith(("data:image/svg+xml;base64,", "data:image/png;base64,"))
    style = page[page.index("<style>") : page.index("</style>")]
    assert "url(" not in style
    assert "@import" not in style


def test_pictures_are_images_that_can_not_run(page, folder):
    pictures = re.findall(r'src="data:image/(svg\+xml|png);base64,([^"]+)"', page)
    assert len(pictures) == 8 + 1 + 2  # four for each scene, one of all, two further ones
    shown = {base64.b64decode(data, validate=True) for _, data in pictures}
    assert shown < {file.read_bytes() for file in (folder / "figures").iterdir()}
    for file in (folder / "figures").glob("*.svg"):
        svg = file.read_text(encoding="utf-8")
        assert "<script" not in svg
        addresses = re.findall(r'(?:xlink:)?href="([^"]+)"', svg)
        assert all(a.startswith(("#", "data:")) for a in addresses)


def test_links_lead_somewhere(page, folder):
    """Into the page, to a file beside it, or to a DOI."""
    tags = Tags(page).tags
    there = [attributes["id"] for _, attributes in tags if "id" in attributes]
    assert len(set(there)) == len(there)
    links = [attributes["href"] for tag, attributes in tags if tag == "a"]
    for link in links:
        if link.startswith("#"):
            assert link.removeprefix("#") in there
        elif not link.startswith("https://doi.org/10."):
            assert (folder / link).is_file()
    beside = {str(f.relative_to(folder)) for f in folder.rglob("*") if f.is_file()}
    assert beside - set(links) == {"report.html"}


def test_pictures_have_words(page):
    for tag, attributes in Tags(page).tags:
        if tag == "img":
            assert len(attributes["alt"]) > 20


def test_report_json_is_strict(folder):
    text = (folder / "report.json").read_text(encoding="utf-8")
    document = json.loads(text, parse_constant=lambda word: pytest.fail(f"{word} in JSON"))
    assert document["seed"] == 7
    assert document["schema"] == 3
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
    assert sorted(p.name for p in folder.iterdir()) == [
        "constraints.txt", "data", "figures", "junit.xml", "references.bib", "report.html",
        "report.json", "report.md", "scenes",
    ]  # fmt: skip


def test_every_figure_has_its_files_and_every_result_is_there(folder):
    stems = {file.stem for file in (folder / "figures").iterdir()}
    of_scenes = {f"{s}-{k}" for s in ("a-b-c", "broken") for k in _KINDS}
    assert stems == of_scenes | {"overview", "further-all", "further-one"}
    for stem in stems:
        for ending in ("png", "csv"):
            assert (folder / "figures" / f"{stem}.{ending}").stat().st_size > 0
    vectors = {file.stem for file in (folder / "figures").glob("*.svg")}
    assert "further-one" in vectors
    assert "a-b-c-lobes" not in vectors
    page = (folder / "report.html").read_text(encoding="utf-8")
    linked = re.findall(r'href="(figures/[^"]+)"', page)
    assert {name.removeprefix("figures/") for name in linked} == {
        file.name for file in (folder / "figures").iterdir()
    }
    models = ("measured", "smith", "vcavity", "smith-walk")
    names = {f"{s}-{m}.nc" for s in ("a-b-c", "broken") for m in models}
    assert {file.name for file in (folder / "data").iterdir()} == names
    first = datasets.load(folder / "data" / "a-b-c-measured.nc")
    assert first.sizes["realisation"] == 2


def test_the_scene_beside_the_page_gives_the_same_figures(entries, folder):
    """Read back and run with the seed of the page: the same numbers, bit for bit."""
    asked = Scene.read(folder / "scenes" / "a-b-c.toml")
    again = validate.validate_scene("a-b-c", asked, seed=7)
    assert again.comparisons == entries[0].comparisons
    assert asked == SCENE


def test_the_page_says_how_to_do_it_again(page):
    text = "".join(Tags(page).text)
    assert "microsurf validate scenes/a-b-c.toml --seed 7 --out again/a-b-c" in text
    assert "pip install . -c constraints.txt" in text
    assert text.count("[roughness]") == 2


def test_tables_have_heads_and_captions(page):
    tags = [tag for tag, _ in Tags(page).tags]
    assert tags.count("table") == tags.count("caption") == tags.count("thead") > 0
    for tag, attributes in Tags(page).tags:
        if tag == "th":
            assert attributes["scope"] in ("row", "col")


def test_what_is_unexpected_comes_first(page):
    assert page.index("broken invariant") < page.index('id="verdicts"')
    assert "Nothing unexpected" not in page


def test_the_page_is_small(page):
    """Less than 400 kB a scene: large pictures are shown as bitmaps of few colours."""
    assert len(page.encode()) < 2 * 0.4e6


def test_the_same_entries_give_the_same_report(entries, folder, tmp_path):
    report.make_folders(tmp_path)
    report.write(entries, tmp_path, 7, **_FURTHER)
    files = [f.relative_to(folder) for f in folder.rglob("*") if f.is_file()]
    vectors = len([file for file in files if file.suffix == ".svg"])
    assert len(files) == 11 * 2 + vectors + 2 * 4 + 2 + 6
    for file in files:
        assert (tmp_path / file).read_bytes() == (folder / file).read_bytes(), file


@pytest.mark.usefixtures("undrawn")
def test_a_fit_states_its_pixel_also_of_a_turned_lay_and_of_oblong_pixels(entries, tmp_path):
    """A turned lay has no picture of its surface; a reader may know the unit, or not."""
    made = generate_surface(2.0, 0.2, cells=64, seed=1)
    oblong = Heightfield(made.heights, (0.5, 0.75), "mirror")
    told = {"surface": json.dumps({"unit": "µm"})}
    for heightfield, attrs, unit in ((None, told, "µm"), (oblong, {}, "unit of the file")):
        entry = replace(
            entries[0],
            scene=replace(SCENE, surface=Surface(file="h.npy")),
            measured=entries[0].measured.assign_attrs(attrs),
            heightfield=heightfield,
            statistics={},
            fit=fit_std(oblong),
        )
        report.make_folders(tmp_path)
        report.write([entry], tmp_path, 7)
        page = (tmp_path / "report.html").read_text(encoding="utf-8")
        assert f"at a pixel of 0.6124 ({unit})" in page


def test_results_that_are_too_large_are_left_out(entries, tmp_path):
    report.make_folders(tmp_path)
    room = entries[0].measured.nbytes
    attached = attachments.attach(entries[0], "a-b-c", tmp_path, 0, room)
    assert attached.size == room
    assert [file.name for file in (tmp_path / "data").iterdir()] == ["a-b-c-measured.nc"]
    assert attached.left_out == 3


@pytest.mark.usefixtures("undrawn")
def test_the_page_is_written_as_scenes_finish(entries, tmp_path):
    """It says what is missing, speaks of no file that is not there, and ends as if at once."""
    growing = report.Report(tmp_path, [entry.name for entry in entries], 7)
    for number, entry in enumerate(entries, 1):
        drawn = growing.draw(entry, _FURTHER["of_scenes"].get(entry.name, ()))
        growing.add(entry, drawn)
        growing.write_so_far()
        page = (tmp_path / "report.html").read_text(encoding="utf-8")
        assert f"Not finished: {number} of 2 scenes" in page
        assert ("Still to come: broken," in page) == (number == 1)
        for name in re.findall(r'href="([^"#:]+)"', page):
            assert (tmp_path / name).is_file() or name in ("constraints.txt", "references.bib")
        assert page.count('<h2 class="scene"') == number
    growing.finish(of_all=_FURTHER["of_all"])
    finished = (tmp_path / "report.html").read_bytes()
    report.write(entries, tmp_path, 7, **_FURTHER)
    assert (tmp_path / "report.html").read_bytes() == finished


def test_a_report_that_can_not_be_finished_leaves_the_old_page(entries, tmp_path, no_room_for):
    report.make_folders(tmp_path)
    (tmp_path / "report.html").write_text("old")
    no_room_for(".png")
    with pytest.raises(MicrosurfError, match="No space left"):
        report.write(entries, tmp_path, 0)
    assert (tmp_path / "report.html").read_text() == "old"
    assert list((tmp_path / "figures").iterdir()) == []
    assert not [f for f in tmp_path.rglob("*") if f.name.startswith(".")]


def test_names_become_files():
    assert attachments.slugs(["a", "A", "a b", "../x", "é", "", "a"]) == [
        "a", "A-2", "a-b", "x", "scene", "scene-2", "a-3",
    ]  # fmt: skip


def test_a_folder_that_can_not_be_made_is_refused(tmp_path):
    (tmp_path / "file").touch()
    (tmp_path / "used").mkdir()
    (tmp_path / "used" / "figures").touch()
    for out in (tmp_path / "file", tmp_path / "file" / "below", tmp_path / "used"):
        with pytest.raises(InputError, match="folder"):
            report.make_folders(out)
    report.make_folders(tmp_path / "a" / "b")
    assert (tmp_path / "a" / "b" / "figures").is_dir()
    report.make_folder(tmp_path / "plain")
    assert list((tmp_path / "plain").iterdir()) == []


def test_plots_of_results_that_do_not_fit_together_are_refused(tmp_path):
    flux = validate.validate_scene("s", replace(SCENE, light=Light((30.0,)))).measured
    other = validate.validate_scene("s", replace(SCENE, light=Light((40.0,)))).measured
    for results, why in (({"a": flux, "b": other}, "angles"), ({"a": flux, "b": flux}, "give one")):
        with pytest.raises(InputError, match=why):
            report.plot_results(results, tmp_path / "p.png")
    assert list(tmp_path.iterdir()) == []
    datasets.save(flux, tmp_path / "r.nc")  # as the command line gets them
    report.plot_results({"a": datasets.load(tmp_path / "r.nc")}, tmp_path / "p.svg")
    assert (tmp_path / "p.svg").stat().st_size > 0


@pytest.mark.parametrize("file", built_in_scenes(), ids=lambda path: path.stem)
def test_built_in_scenes_say_why_they_are_there(file):
    scene = Scene.read(file)
    assert len(scene.title) > 5
    assert len(scene.rationale) > 20
    for expected in scene.expect.values():
        assert expected.why


def test_there_are_the_built_in_scenes_that_were_asked_for():
    """Three of Ribardière 2018, three glasses, two limits, two extremes of Kd, two flat ones."""
    found = {
        (s.roughness.gamma, s.roughness.sigma_x, s.material.n, s.material.kd[0])
        for s in map(Scene.read, built_in_scenes())
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
