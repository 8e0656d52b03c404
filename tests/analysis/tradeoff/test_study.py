"""The ladder on a small scene: all methods run, the books of errors and costs, what is refused."""

import csv
import json
import sys
from dataclasses import replace

import numpy as np
import pytest

from microsurf import model
from microsurf.analysis import ablation
from microsurf.analysis.ablation import contributions
from microsurf.analysis.tradeoff import pareto
from microsurf.analysis.tradeoff.effort import EFFORTS, TradeoffEffort
from microsurf.analysis.tradeoff.methods import draws_of, mesh_of, methods_of
from microsurf.analysis.tradeoff.recommend import advise
from microsurf.analysis.tradeoff.study import quantities_of, tradeoff
from microsurf.cli import advise as advise_command
from microsurf.cli import entry
from microsurf.cli import tradeoff as tradeoff_command
from microsurf.errors import InputError
from microsurf.report.figures import pareto as pareto_figure
from microsurf.results import detector
from microsurf.scene import Light, Material, Roughness, Scene, Surface

TINY = TradeoffEffort(((1000, 4), (5000, 3)), ((0.5, 500, 4),), 1, 1, 2000, 4, 8)
SCENE = Scene(
    roughness=Roughness(8.0, (0.3,)),
    surface=Surface(cells=32, correlation=1.0),
    light=Light((50.0,)),
)
# A mirror has no body integrals, which take most of a ladder's time.
MIRROR = replace(SCENE, material=Material(1.5, (0.0,)))
FLAT = replace(SCENE, roughness=Roughness(2.0, (0.0,)))


@pytest.fixture(scope="module")
def found():
    """The ladder without the V-cavity's method, which takes longer than all others."""
    with pytest.MonkeyPatch.context() as patch:
        patch.delitem(model.MODELS, "vcavity")
        return tradeoff(SCENE, TINY, seed=5)


def test_every_way_to_a_reflectance_is_a_rung():
    for effort in EFFORTS.values():
        methods = methods_of(Scene(), effort)
        assert {r.model for r in methods} == {*model.order_one(), *model.all_orders(), "surface"}
        assert len({r.name for r in methods}) == len(methods)
        assert [r.tier for r in methods] == sorted(r.tier for r in methods)
        # What the arithmetic of errors asks for, and pairs of surfaces are traced.
        assert all(r.draws == 1 or r.draws >= 3 for r in methods)
        assert all(r.draws % 2 == 0 for r in methods if r.model == "surface")
        assert effort.surfaces >= 3
    assert [r.name for r in methods_of(FLAT, TINY)] == ["flat"]
    assert mesh_of(Scene(), 0.25) == replace(Surface(), cells=128, correlation=2.0)


def test_points_have_costs_and_errors(found):
    assert set(found.points) == {"albedo", "peak", "lobe", "position", "width"}
    assert len(found.runs) == len(methods_of(SCENE, TINY)) - 1
    for points in found.points.values():
        for point in points:
            assert 0 < point.seconds_low < point.seconds < point.seconds_high
            error = pareto.error(point.squared)
            assert 0 <= error.low <= error.value <= error.high
            assert error.value <= error.below <= error.high
    assert found.reference.surfaces == 4
    # Flat misses the peak of a rough surface by far; what is far off fails beyond doubt.
    flat = next(p for p in found.points["peak"] if p.name == "flat")
    assert pareto.error(flat.squared).low > 1
    for run in found.runs:
        assert run.bytes > 0
        assert (run.evaluation is None) == (run.method.model == "surface")


@pytest.fixture(scope="module")
def strict():
    return advise(MIRROR, 1e-4, "albedo", TINY, effects=False)


def test_the_same_seed_gives_the_same_errors(strict):
    again = advise(MIRROR, 1e-4, "albedo", TINY, effects=False)
    one, other = (
        {judged.point.name: judged.point.squared.interval for judged in found.tried}
        for found in (strict, again)
    )
    assert one == other
    assert len(one) == len(methods_of(MIRROR, TINY))


def test_rows_and_figure(found):
    rows = pareto_figure.rows(found)
    assert len(rows) == 5 * len(found.runs)
    names = {run.method.name for run in found.runs}
    assert {row["dominated_by"] for row in rows} <= {None, *names}
    assert sum("frontier" in line for line in tradeoff_command._lines(found)) >= 5
    costs = pareto_figure.within(rows)
    assert len(costs) == 9
    for name in ("albedo", "peak", "lobe"):
        seconds = [c["seconds"] or np.inf for c in costs if c["quantity"] == name]
        assert seconds == sorted(seconds, reverse=True)  # more accuracy never costs less
    panels = pareto_figure.figure(rows, "small").axes
    assert [panel.get_xscale() for panel in panels] == ["log"] * 3


def test_draws_are_the_result_s_albedo_and_lobes():
    scene = replace(
        SCENE, material=Material(1.5, (0.2, 0.9)), light=Light((0.0, 50.0), (0.0, 90.0))
    )
    dataset = model.predict(scene)
    draws = draws_of(dataset, scene)
    assert len(draws) == 8
    one = draws[50.0, 90.0, 0.9]
    assert one.specular.shape == one.lobe.shape == (1, detector.RINGS * detector.SECTORS)
    assert 0 < one.lobe.sum() < one.albedo[0, 0] < 1
    assert draws[50.0, 0.0, 0.2].albedo[0, 0] < one.albedo[0, 0]


def test_advice_takes_the_cheapest_that_holds():
    found = advise(MIRROR, 1.0, "albedo", TINY, effects=False)
    assert found.chosen is not None
    costs = [one.point.seconds for one in found.tried]
    assert costs == sorted(costs)
    cheaper = found.tried[: found.tried.index(found.chosen)]
    assert all(one.verdict != "holds" for one in cheaper)
    assert f"use {found.chosen.point.name}" in advise_command._lines(found)[0]
    assert found.skipped  # no surfaces were made for a tolerance of 100 %


def test_where_nothing_holds_it_says_so_and_what_it_would_take(strict):
    found = strict
    assert found.chosen is None
    assert not found.skipped
    assert found.best.error.below == min(one.error.below for one in found.tried)
    assert "no method was shown" in found.note
    assert "surfaces" in found.note
    assert found.reference.surfaces == TINY.most


def test_effects_have_the_sign_and_size_they_must(monkeypatch):
    """Of a white surface without interface: no substrate is nothing, one order loses light."""
    monkeypatch.setattr(ablation, "WALKS", 10_000)
    white = replace(SCENE, material=Material(1.5, (1.0,)), roughness=Roughness(2.0, (0.5, 0.8)))
    found = {e.name: e for e in contributions(white, "albedo", seed=2)}
    assert set(found) == {
        "interface", "substrate", "multiple scattering", "anisotropy", "tail of the slopes",
        "masking", "structure",
    }  # fmt: skip
    # An IL facet at Kd = 1 is white, and so is a walk of all orders: nothing changes.
    for name in ("interface", "anisotropy", "tail of the slopes", "masking", "structure"):
        assert abs(found[name].change) < 1e-9
    assert -1 < found["substrate"].change < -0.5
    assert -0.5 < found["multiple scattering"].high < -0.01
    bare = replace(white, material=Material(1.0, (0.5,)))
    assert "interface" not in {e.name for e in contributions(bare, "lobe", seed=2)}
    mirror = replace(white, material=Material(1.5, (0.0,)))
    gone = next(e for e in contributions(mirror, "peak", seed=2) if e.name == "interface")
    assert gone.change == -1


def test_a_flat_scene_is_its_own_reference():
    assert quantities_of(FLAT) == quantities_of(SCENE)
    found = advise(FLAT, 0.05, effort=TINY)
    assert found.chosen is not None
    assert found.chosen.point.name == "flat"
    assert found.effects == []


@pytest.mark.parametrize(
    ("scene", "asked", "message"),
    [
        (SCENE, {"tolerance": 0.0}, "1e-4 … 1"),
        (SCENE, {"quantity": "colour"}, "albedo, peak, lobe"),
        (replace(SCENE, material=Material(1.0, (0.5,))), {"quantity": "peak"}, "no interface"),
        (replace(SCENE, material=Material(1.5, (0.0,))), {"quantity": "lobe"}, "no body lobe"),
        (replace(SCENE, material=Material(1.0, (0.0,))), {}, "nothing is reflected"),
        (replace(SCENE, surface=Surface(file="a.npy")), {}, "generated surfaces"),
    ],
)
def test_what_can_not_be_asked_is_refused(scene, asked, message):
    with pytest.raises(InputError, match=message):
        advise(scene, **{"tolerance": 0.1, "effort": TINY} | asked)


def test_both_commands(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(EFFORTS, "quick", TINY)
    monkeypatch.setattr(ablation, "WALKS", 2000)
    file = tmp_path / "small.toml"
    file.write_text(MIRROR.to_toml(), encoding="utf-8")

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["microsurf", *map(str, arguments)])
        entry.main()
        return capsys.readouterr().out

    out = tmp_path / "out"
    printed = json.loads(run("tradeoff", file, "--out", out, "--json"))
    assert {"rungs", "frontier", "reference"} <= set(printed)
    assert {p.name for p in out.iterdir()} == {
        f"tradeoff.{e}" for e in ("png", "pdf", "csv", "json")
    }
    with (out / "tradeoff.csv").open(encoding="utf-8") as lines:
        assert len(list(csv.DictReader(lines))) == len(printed["rungs"])
    assert printed["frontier"]["albedo"]
    printed = json.loads(run("advise", file, "--tolerance", "0.5", "--json"))
    assert {"rung", "error", "error_ci", "seconds", "alternatives"} <= set(printed)
    low, high = printed["error_ci"]
    assert low <= printed["error"] <= high
    assert np.isfinite(printed["seconds"])
