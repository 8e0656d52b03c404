"""What `microsurf fit` gives for a measured surface: figures, scene, picture, and refusals."""

import errno
import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from microsurf.cli.group import cli
from microsurf.errors import InputError, MicrosurfError
from microsurf.scene import Scene
from microsurf.surface import Heightfield, generate_surface, write_surface


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("fit") / "sample.x3p"
    made = generate_surface(2.5, 0.3, cells=96, spacing=0.5, seed=81)
    heights = made.heights.copy()
    filled = np.zeros(heights.shape, dtype=bool)
    filled[20:30, 40:60] = filled[70:72, 10:90] = True
    y, x = np.mgrid[:96, :96]
    bow = heights + 0.02 * x - 0.05 * y + 1e-4 * x * y
    write_surface(Heightfield(bow, 0.5, "mirror", filled=filled), path)
    return path


def run(*arguments):
    return CliRunner().invoke(cli, ["fit", *map(str, arguments)], catch_exceptions=True)


def test_figures_scene_and_picture(file, tmp_path):
    scene, picture = tmp_path / "scene.toml", tmp_path / "fit.png"
    result = run(file, "--json", "--out", scene, "--figure", picture)
    assert result.exit_code == 0, result.output
    values = json.loads(result.stdout)
    assert values["kind"] == "surface"
    assert values["gamma_ci"][0] < 2.5 < values["gamma_ci"][1]
    assert values["sigma_ci"][0] < 0.3 < values["sigma_ci"][1]
    assert values["voids"]["treatment"] == "fill"
    assert values["voids"]["share"] == pytest.approx(360 / 96**2)
    assert (values["level"], values["unit"], values["pixel"]) == ("quadratic", "µm", [0.5, 0.5])
    assert values["reader"].startswith("x3pio")
    assert values["files"] == [str(scene), str(picture)]
    assert picture.read_bytes().startswith(b"\x89PNG")
    asked = Scene.read(scene)
    assert asked.roughness.gamma == pytest.approx(values["gamma"])
    assert asked.surface.level == "quadratic"
    assert (tmp_path / asked.surface.file).resolve() == file.resolve()


def test_without_room_for_the_picture_there_is_no_scene_either(file, tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    result = run(file, "--out", tmp_path / "scene.toml", "--figure", tmp_path / "fit.png")
    assert isinstance(result.exception, MicrosurfError)
    assert "fit.png: could not be written" in str(result.exception)
    assert list(tmp_path.iterdir()) == []


def test_what_was_read_and_what_is_odd_is_said(file, tmp_path):
    """On stderr, and in the JSON; people's table has a line for each scale and no nested lists."""
    result = run(file, "--json")
    notes = json.loads(result.stdout)["notes"]
    assert ["x3p read by x3pio" in notes[0], "were not measured: filled" in notes[1]] == [True] * 2
    assert all(note in result.stderr for note in notes)
    np.save(tmp_path / "cut.npy", generate_surface(2.5, 0.3, cells=96, seed=83).heights[:64, :64])
    result = run(tmp_path / "cut.npy")
    assert (
        "bare heights, taken as spacing 1 in the unit of its heights and periodic" in result.stderr
    )
    assert "the seam in x" in result.stderr
    assert "seam" not in result.stdout
    assert "\nat pixel 2 × 2  " in result.stdout
    assert "{" not in result.stdout
    assert run(tmp_path / "cut.npy", "--spacing", 1, "--boundary", "mirror").stderr == ""


def test_level_and_voids_are_options(file):
    values = json.loads(run(file, "--json", "--level", "none", "--voids", "crop").stdout)
    assert (values["level"], values["voids"]["treatment"]) == ("none", "crop")
    assert "correlation lengths across" in values["remarks"][0]
    assert values["voids"]["kept"] < 0.9


def test_a_wide_surface_needs_no_remark(tmp_path):
    write_surface(generate_surface(2.5, 0.3, cells=96, correlation=4, seed=82), tmp_path / "s.npz")
    assert json.loads(run(tmp_path / "s.npz", "--json").stdout)["remarks"] == []


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--voids", "refuse"), "were not measured"),
        (("--channel", "phase"), "0 = 'layer 0'"),
        (("--spacing", "2"), "the file says"),
        (("--height-unit", "nm"), "the file says"),
        (("--level", "cubic"), "must be one of none, plane, quadratic"),
        (("--figure", "fit.doc"), "ending must be"),
        (("--out", "scene.json"), "ending must be"),
    ],
)
def test_what_makes_no_sense_is_refused_in_one_line(file, arguments, said):
    result = run(file, *arguments)
    assert isinstance(result.exception, InputError)
    assert said in str(result.exception)
    assert "\n" not in str(result.exception)


def test_files_that_are_no_surface(tmp_path):
    (tmp_path / "s.docx").write_bytes(b"x")
    np.save(tmp_path / "voids.npy", np.full((20, 20), np.nan))
    np.save(tmp_path / "flat.npy", np.zeros((20, 20)))
    np.save(tmp_path / "row.npy", np.zeros((1, 20)))
    for name, said in (
        ("s.docx", "unknown ending"),
        ("missing.npy", "no such file"),
        ("voids.npy", "all 400 points are voids"),
        ("flat.npy", "flat"),
        ("row.npy", "rows and columns"),
    ):
        result = run(tmp_path / name)
        assert isinstance(result.exception, InputError)
        assert said in str(result.exception)
        assert name in str(result.exception)
