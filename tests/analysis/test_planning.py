"""Plans: the mesh from the measured convergence, rays and surfaces from a pilot."""

import csv
import json
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from scipy import stats

from microsurf import measure
from microsurf.analysis import allocation, planning
from microsurf.analysis.self_test import SelfTest
from microsurf.cli.group import cli
from microsurf.errors import InputError
from microsurf.results import uncertainty
from microsurf.scene import Accuracy, Light, Material, Roughness, Scene, Surface
from microsurf.trace import engine
from microsurf.trace.scheduler import PATHS_PER_ITEM, ROUND

ROOT = Path(__file__).parents[2]
MEASURED = {1.75: "03-r18-interfaced", 2.0: "07-ggx", 8.0: "02-r18-lambertian"}
SMALL = Scene(
    material=Material(1.5, (0.8,)),
    roughness=Roughness(2.0, (0.5,)),
    surface=Surface(cells=64, correlation=4.0, realisations=3),
    light=Light((60.0,)),
    accuracy=Accuracy(standard_error=2e-3, lobe_error=0.5),
)


@pytest.mark.parametrize("gamma", MEASURED)
def test_what_a_mesh_leaves_is_what_convergence_measured(gamma):
    path = ROOT / "reports" / "convergence" / MEASURED[gamma] / "convergence.csv"
    with path.open(encoding="utf-8", newline="") as lines:
        rows = [
            row
            for row in csv.DictReader(lines)
            if (row["study"], row["quantity"]) == ("mesh", "total")
        ]
    for length, bound in planning.MESH_ERROR[gamma].items():
        ends = [abs(float(r[k])) for r in rows for k in ("low", "high")
                if float(r["correlation"]) == length]  # fmt: skip
        assert len(ends) == 8
        assert bound == pytest.approx(max(ends), rel=0.02)
    assert {float(r["tile"]) for r in rows} == {planning.TILE}


@pytest.mark.parametrize(
    ("gamma", "error", "cells"),
    [(2.0, 5e-3, 128), (2.0, 2.5e-3, 256), (2.0, 2e-3, 512), (2.0, 1e-5, 512), (8.0, 5e-4, 128),
     (5.0, 5e-4, 512), (1.75, 6e-3, 256), (1.6, 9e-3, 128)],
)  # fmt: skip
def test_the_coarsest_mesh_that_was_measured_to_do(gamma, error, cells):
    asked = Scene(roughness=Roughness(gamma), accuracy=Accuracy(standard_error=error))
    chosen = planning.with_mesh(asked).surface
    assert chosen.cells == cells
    assert chosen.cells == planning.TILE * chosen.correlation


def test_no_mesh_is_chosen_where_none_is_made_or_no_error_asked():
    for scene in (
        Scene(),
        Scene(roughness=Roughness(2.0, (0.0,)), accuracy=Accuracy(standard_error=1e-3)),
        Scene(surface=Surface(file="h.npy"), accuracy=Accuracy(standard_error=1e-3)),
    ):
        assert planning.with_mesh(scene) is scene


def test_what_was_planned_leaves_the_expected_error(judge):
    """Squared errors of the run over the pilot's follow F on (R−1, 3) degrees of freedom at most.

    Both are variances of means of surfaces. Negative control: a plan that took the error of
    one surface for that of all.
    """
    made = planning.plan(SMALL, seed=judge.seed(1))
    run = measure(made.scene, seed=judge.seed(2))
    count = made.scene.surface.realisations
    assert run.sizes["realisation"] == count
    error = float(run.microsurf.standard_error(n=1.5, kd=0.8).item())
    law = stats.f(count - 1, allocation.PILOT_SURFACES - 1)
    ratio = (error / made.error) ** 2
    judge.keeps(min(2 * law.sf(ratio), 2 * law.cdf(ratio), 1.0))
    # A third of the error takes nine times the surfaces, but for the most that are planned.
    few, many = (
        planning.plan(replace(SMALL, accuracy=Accuracy(standard_error=error, lobe_error=0.5)),
                  seed=judge.seed(1)).scene.surface.realisations
        for error in (6e-4, 2e-4)
    )  # fmt: skip
    assert many >= min(3 * few, 1000)


def test_rays_and_surfaces_cost_least():
    """Against all powers of two of paths and the surfaces they take."""
    wanted = [allocation.Wanted(lobe=False, between=1e-5, of_path=0.2, target=4e-4)]
    cells = SMALL.surface.cells**2
    count, paths = allocation.cheapest(wanted, SMALL, cells, single=False)

    def cost(surfaces, paths):
        return surfaces * (engine.EXACT.cell_cost * cells + paths)

    def least(paths):
        widened = allocation._widened
        return next(r for r in range(3, 10**4) if wanted[0].surfaces(paths) * widened(r) ** 2 <= r)

    best = min(cost(least(2**k), 2**k) for k in range(10, 23))
    assert wanted[0].left(count, paths) * allocation._widened(count) <= wanted[0].target
    assert cost(count, paths) <= 1.5 * best  # paths are rounded up to a power of two


def test_what_can_not_be_reached_is_said():
    hopeless = replace(SMALL, accuracy=Accuracy(standard_error=1e-6, lobe_error=1e-6))
    made = planning.plan(hopeless, seed=1)
    assert any("times the error asked for is left" in note for note in made.notes)
    assert any("not known" in note for note in made.notes)


def test_flat_scenes_and_paths_asked_for():
    flat = Scene(roughness=Roughness(2.0, (0.0,)), accuracy=Accuracy(10_000))
    made = planning.plan(flat)
    assert made.scene.accuracy.paths == 10_000
    assert made.mesh_error is None
    assert made.notes == ()
    asked = planning.plan(replace(flat, accuracy=Accuracy(standard_error=1e-3, lobe_error=0.01)))
    assert asked.lobe_error <= 0.01
    dark = replace(flat, material=Material(1.0, (0.0,)))
    assert np.isfinite(planning.plan(dark).error)


@pytest.mark.parametrize(
    ("asked", "named"),
    [(Accuracy(standard_error=1e-6, lobe_error=1.0), "standard_error = 1e-06"),
     (Accuracy(standard_error=1e-2, lobe_error=1e-6), "lobe_error = 1e-06")],
)  # fmt: skip
def test_more_paths_than_there_may_be_are_refused_by_the_error_asked_for(asked, named):
    hopeless = replace(SMALL, roughness=Roughness(2.0, (0.0,)), accuracy=asked)
    if named.startswith("standard"):  # one facet alone: what its rays leave is set by hand
        wanted = [allocation.Wanted(lobe=False, between=0.0, of_path=1e3, target=1e-6)]
        with pytest.raises(InputError, match=f"^{named}: would take about .* ask for a larger"):
            allocation.cheapest(wanted, hopeless, 0, single=True)
        return
    with pytest.raises(InputError, match=f"^{named}: would take about .* ask for a larger"):
        planning.plan(hopeless)


def test_a_lobe_error_of_zero_is_refused_and_not_taken_for_none():
    words = ["measure", "--sigma", "0", "--standard-error", "0.1", "--lobe-error", "0", "--dry-run"]
    error = CliRunner().invoke(cli, words).exception
    assert isinstance(error, InputError)
    assert "accuracy.lobe_error = 0.0: must be 1e-6 … 1" in str(error)


def test_dry_run_says_what_would_run_and_runs_nothing(tmp_path):
    out = tmp_path / "m.nc"
    command = ["measure", "--gamma", "8", "--sigma", "0.3", "--theta", "30", "--standard-error",
               "1e-2", "--dry-run", "--json", "--out", str(out)]  # fmt: skip
    done = CliRunner().invoke(cli, command)
    assert done.exit_code == 0
    values = json.loads(done.stdout)
    assert (values["cells"], values["correlation"]) == (128, 2.0)
    assert values["expected_error"] <= 1e-2
    assert "plan: " in done.stderr
    assert not out.exists()
    kept = CliRunner().invoke(cli, [*command, "--cells", "32"])
    assert json.loads(kept.stdout)["cells"] == 32


def test_a_mesh_that_the_scene_names_is_kept(tmp_path):
    scene = tmp_path / "s.toml"
    scene.write_text("[surface]\ncells = 48\n[accuracy]\nstandard_error = 0.02\n")
    done = CliRunner().invoke(cli, ["measure", str(scene), "--dry-run", "--json"])
    assert json.loads(done.stdout)["cells"] == 48


def test_a_run_begins_with_the_surfaces_and_rays_of_its_plan():
    """With half of the planned surfaces, and lanes that end after the planned rays."""
    asked = replace(SMALL, accuracy=Accuracy(standard_error=2e-3, lobe_error=0.1))
    made = planning.plan(asked, seed=1)
    begun = made.begun(asked)
    assert begun.accuracy == asked.accuracy
    least, planned = begun.surface.realisations, made.scene.surface.realisations
    assert planned // 2 == least > SMALL.surface.realisations
    run = measure(begun, seed=3, surface_paths=made.scene.accuracy.paths)
    assert uncertainty.surplus(run, asked) <= 1
    assert least <= run.sizes["realisation"] <= 3 * planned
    # A whole round of a million paths is what a surface takes that nobody planned.
    assert float(run.paths.max()) < 0.25 * ROUND * PATHS_PER_ITEM


@pytest.mark.usefixtures("few_walks", "undrawn")
def test_validate_says_its_plans_and_keeps_to_them(tmp_path, monkeypatch):
    command = import_module("microsurf.cli.validate")
    checked = SelfTest([], None, "2020-01-01 00:00")
    monkeypatch.setattr(command, "self_test", lambda *_, **__: checked)
    scene, out = tmp_path / "s.toml", tmp_path / "r"
    scene.write_text(
        "[roughness]\ngamma = 8\nsigma = 0.3\n[surface]\ncells = 48\nrealisations = 2\n"
        "[light]\ntheta = [30]\n"
    )
    words = ["validate", str(scene), "--standard-error", "2e-2", "--lobe-error", "0.2"]
    words += ["--no-refine", "--json", "--out", str(out)]
    planned = CliRunner().invoke(cli, [*words, "--dry-run"])
    assert planned.exit_code == 0
    values = json.loads(planned.stdout)
    assert values["scenes"]["s"]["cells"] == 48
    assert values["seconds"] == values["scenes"]["s"]["seconds"]
    assert "plan: " in planned.stderr
    assert not out.exists()
    done = CliRunner().invoke(cli, words)
    assert json.loads(done.stdout)["reached"] == {"s": True}
    found = json.loads((out / "report.json").read_text())["scenes"][0]["measured"]
    assert found["albedo_se"] <= 2e-2
