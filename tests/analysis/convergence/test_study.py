"""Convergence: which steps are taken, what the command writes, what it refuses."""

import csv
import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import quick
from scipy import stats

from microsurf.analysis.convergence.steps import (
    EFFORTS,
    ConvergenceEffort,
    mesh_steps,
    ray_counts,
    tile_steps,
)
from microsurf.analysis.convergence.study import converge
from microsurf.cli import entry
from microsurf.scene import Accuracy, Light, Material, Roughness, Scene, Surface
from microsurf.surface import generate_surface, write_surface

TINY = ConvergenceEffort((0.5, 1, 2), 4, 3, 2000, 64, 4, 4096)
SCENE = Scene(
    surface=Surface(cells=32, correlation=4.0, realisations=2),
    light=Light((60.0,)),
    accuracy=Accuracy(4096),
)


@pytest.fixture(scope="module")
def found():
    return converge(SCENE, TINY, seed=3, workers=1)


def test_the_mesh_keeps_the_tile_and_the_tile_keeps_the_mesh():
    for scene in (SCENE, Scene()):
        for effort in EFFORTS.values():
            meshes, tiles = mesh_steps(scene, effort), tile_steps(scene, effort)
            ratio = scene.surface.cells / scene.surface.correlation
            assert {step.cells / step.correlation for step in meshes} == {ratio}
            assert {step.correlation for step in tiles} == {scene.surface.correlation}
            for steps in (meshes, tiles):
                sizes = [step.cells for step in steps]
                assert sizes == sorted(set(sizes))
                assert scene.surface.cells in sizes
    assert [s.correlation for s in mesh_steps(Scene(), EFFORTS["full"])] == [2, 4, 8, 16, 32]
    assert max(s.cells for s in mesh_steps(Scene(), EFFORTS["quick"])) == 1024
    huge = Scene(surface=Surface(cells=4096))
    assert [s.cells for s in mesh_steps(huge, EFFORTS["quick"])] == [1024, 2048, 4096]


def test_rays_go_up_to_what_the_scene_asks_for():
    assert ray_counts(SCENE, EFFORTS["quick"]) == [1024, 4096]
    assert ray_counts(Scene(), EFFORTS["full"])[-1] == 1_000_000
    assert ray_counts(replace(SCENE, accuracy=Accuracy(10)), TINY) == [1024]


def test_rows_fit_together(found):
    assert {row["cells"] for row in found.mesh} == {16, 32, 64}
    assert {row["realisations"] for row in found.tile} == {8, 4, 3}
    assert {row["realisations"] for row in found.realisations} == {1, 2, 4}
    assert {row["paths"] for row in found.rays} == {1024, 4096}
    assert {(row["study"], row["quantity"]) for row in found.orders} == {
        (study, name) for study in ("mesh", "tile") for name in ("specular", "body", "total")
    }
    for row in (*found.mesh, *found.tile):
        assert row["low"] <= row["difference"] <= row["high"]
        assert row["error"] > 0
    for row in found.mesh[2::3]:
        assert row["difference"] == row["low"] == row["high"] == 0
    assert not found.note


def test_the_same_seed_gives_the_same_figures(found):
    again = converge(SCENE, TINY, seed=3, workers=2)
    assert (again.mesh, again.rays, again.powers) == (found.mesh, found.rays, found.powers)
    other = converge(SCENE, TINY, seed=4, workers=1)
    assert other.mesh != found.mesh


@pytest.mark.long
@pytest.mark.parametrize("phi", [(0.0, 90.0), (0.0,)])
def test_the_law_of_rays_is_checked(phi, judge):
    """Stratified rays follow 1/√N or do better, whether azimuths are asked for or taken in turn.

    That a law can fail is `test_trend`'s. On four surfaces, of three degrees of freedom, the
    spread is more than twice that of 16 repeats with other rays.
    """
    scene = replace(SCENE, accuracy=Accuracy(65_536), light=Light((60.0,), phi))
    effort = replace(TINY, most_paths=65_536, paths=65_536, repeats=16)
    found = converge(scene, effort, seed=judge.seed(0), workers=1)
    across = [r for r in found.realisations if r["realisations"] == 1]
    levels = []
    for name in ("specular", "body"):
        mine = [r["deviation"] for r in found.rays if r["quantity"] == name]
        other = next(r["deviation"] for r in across if r["quantity"] == name)
        levels.append(stats.f.cdf((other / mine[-1] / 2) ** 2, 3, 15))
    law = [row for row in found.powers if row["study"] == "rays"]
    assert law
    for row in law:
        error = (row["high"] - row["power"]) / 1.96
        levels.append(stats.norm.sf((row["power"] + 0.5) / error))
    judge.keeps(levels)


def test_flat_scenes_and_files_have_rays_alone(tmp_path):
    flat = replace(SCENE, roughness=Roughness(2.0, (0.0,)))
    found = converge(flat, TINY, workers=1)
    assert "flat" in found.note
    write_surface(generate_surface(2.0, 0.5, cells=16, seed=1), tmp_path / "s.npz")
    filed = replace(SCENE, surface=Surface(file=str(tmp_path / "s.npz")))
    of_file = converge(filed, TINY, workers=1)
    assert "s.npz" in of_file.note
    for one in (found, of_file):
        assert one.mesh == one.tile == one.realisations == one.orders == []
        assert {row["paths"] for row in one.rays} == {1024, 4096}


@pytest.mark.parametrize(
    "changed",
    [
        {"material": Material(0.43, k=2.455)},
        {"material": Material(1.5, (0.0, 0.5, 1.0))},
        {"roughness": Roughness(1.51, (0.5,))},
        {"roughness": Roughness(2.0, (0.5, 0.2)), "light": Light((30.0,), (0.0, 90.0))},
        {"surface": Surface(cells=2, correlation=0.5)},
    ],
)
def test_any_scene_is_a_reference_point(changed):
    found = converge(replace(SCENE, **changed), TINY, workers=1)
    rows = [*found.mesh, *found.tile, *found.realisations, *found.rays, *found.left]
    values = [v for row in rows for v in row.values() if isinstance(v, float)]
    assert np.isfinite(values).all()


# The command


@pytest.fixture
def run(monkeypatch, capsys, tmp_path):
    """Run the command in an empty folder with the least effort; code, stdout and stderr."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(EFFORTS, "quick", TINY)

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["microsurf", "convergence", *map(str, arguments)])
        capsys.readouterr()
        code = 0
        try:
            entry.main()
        except SystemExit as end:
            code = end.code or 0
        return code, *capsys.readouterr()

    return call


TOML = """
[material]
kd = [0.2, 0.8]
[surface]
cells = 32
correlation = 4
[light]
theta = [60]
[accuracy]
paths = 2000
"""


def test_the_command_writes_what_it_found(run, monkeypatch):
    Path("my.toml").write_text(TOML)
    code, out, err = run("my.toml", "--json")
    assert (code, err) == (0, "")
    assert out.count("\n") == 1
    values = json.loads(out, parse_constant=lambda word: pytest.fail(f"{word} in JSON"))
    assert {"scene", "mesh", "tile", "realisations", "rays", "out"} <= set(values)
    assert values["scene"] == "my"
    folder = Path("reports/convergence/my")
    assert values["out"] == str(folder)
    assert json.loads((folder / "convergence.json").read_text()) == values
    endings = sorted(path.name for path in folder.iterdir())
    assert endings == [f"convergence.{e}" for e in ("csv", "json", "pdf", "png")]
    with (folder / "convergence.csv").open(newline="") as lines:
        rows = list(csv.DictReader(lines))
    studies = ("mesh", "tile", "realisations", "rays")
    assert len(rows) == sum(len(values[study]) for study in studies)
    assert float(rows[0]["value"]) == pytest.approx(values["mesh"][0]["value"], rel=1e-6)
    quick.without_figures(monkeypatch)
    code, out, err = run("my.toml", "--out", "o")
    assert (code, err) == (0, "")
    assert "surfaces and rays" in out
    assert len(list(Path("o").iterdir())) == 4


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("[surface]\ncell = 3\n", "cell"),
        ("[surface\n", "my.toml"),
        ('[surface]\nfile = "absent.npy"\n', "absent.npy"),
        ("[roughness]\ngamma = 1.5\n", "1.5"),
        ("[material]\nn = 1\nkd = 0\n", "nothing is reflected"),
        ('[surface]\nlevel = "plane"\n', "surface.file"),
    ],
)
def test_what_makes_no_sense_is_refused_in_one_line(run, text, names):
    Path("my.toml").write_text(text)
    code, out, err = run("my.toml", "--out", "o")
    assert (code, out) == (2, "")
    assert err.startswith("microsurf: ")
    assert err.count("\n") == 1
    assert names in err
    assert not Path("o/convergence.csv").exists()


def test_pictures_of_what_does_not_vary_say_so(run):
    Path("my.toml").write_text(TOML + "[roughness]\nsigma = 0\n")
    code, out, err = run("my.toml", "--out", "o")
    assert (code, err) == (0, "")
    assert out.startswith("note: one surface, flat")
    assert Path("o/convergence.png").stat().st_size > 0
    assert run("absent.toml")[0] == 2


def test_a_failed_write_leaves_what_resume_takes_up_and_nothing_else(run, monkeypatch):
    Path("my.toml").write_text(TOML)

    def full(*_args, **_kwargs):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("microsurf.cli.save.as_csv", full)
    code, out, err = run("my.toml", "--out", "o")
    assert (code, out, err.count("\n")) == (3, "", 1)
    assert [path.name for path in Path("o").iterdir()] == ["unfinished"]
