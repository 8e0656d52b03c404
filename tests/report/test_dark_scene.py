"""A scene that reflects nothing has a page, which says so."""

from dataclasses import replace

import pytest

from microsurf import report
from microsurf.analysis import validate, validate_user_brdf
from microsurf.model import UserBrdf
from microsurf.report import scene_figures, sections
from microsurf.scene import Accuracy, Light, Material, Scene, Surface

SCENE = Scene(
    material=Material(1.0, (0.0,)),
    surface=Surface(cells=16, realisations=2),
    light=Light((60.0,)),
    accuracy=Accuracy(2000),
)


@pytest.fixture(scope="module")
def entry():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(validate, "WALKS", 2000)
        return validate.validate_scene("dark", SCENE)


def test_its_sections_and_pictures_are_those_that_there_are(entry):
    assert [p.name for p in scene_figures.of_scene(entry, "dark")] == ["dark-surface"]
    assert sections.of_scene(entry, "dark")[0].name == "dark"
    lit = replace(entry, measured=entry.measured.assign(flux=entry.measured.flux + 1e-3))
    assert "dark" not in [s.name for s in sections.of_scene(lit, "dark")]


def test_a_user_brdf_that_is_dark_too_has_no_figure_and_a_sentence(entry):
    own = UserBrdf("own:f", lambda _, o: (0 * o[:, 2], 0 * o[:, 2]))
    tried = validate_user_brdf.judge(entry, own, [])
    (section,) = (s for s in sections.of_scene(tried, "dark") if s.name == "user-brdf")
    assert section.pictures == ()
    assert "No figure" in section.text


def test_its_page_and_its_plot_say_so(entry, tmp_path):
    report.write([entry], tmp_path, 1, of_scenes={entry.name: sections.of_scene(entry, "dark")})
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "This scene reflects no light" in page
    for name in ("overview", "dark-lobes"):
        assert not (tmp_path / "figures" / f"{name}.svg").exists()
    report.plot_results({"dark.nc": entry.measured}, tmp_path / "plot.png")
    assert (tmp_path / "plot.png").stat().st_size > 0
