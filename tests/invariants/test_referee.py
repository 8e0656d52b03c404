"""Two engines see the same light, at a stated rate of false alarms; what differs is found."""

import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from microsurf.invariants import false_alarms, referee
from microsurf.scene import Accuracy, Light, Material, Roughness, Scene, Surface
from microsurf.surface import surface_of
from microsurf.trace import wavefront

SCENE = Scene(
    material=Material(1.5, (0.8,)),
    roughness=Roughness(2.0, (0.5,)),
    surface=Surface(cells=64, realisations=1),
    light=Light((0.0, 60.0)),
    accuracy=Accuracy(1000),
)


def compared(scene=SCENE, seed=1):
    return referee.second_engine(scene, surface_of(SCENE, 1, 0), seed=seed)


def test_hotelling_is_as_unlikely_as_it_says(judge):
    """Of correlated normal numbers; negative control: means that are apart."""
    rng = np.random.default_rng(judge.seed(1))
    mixed = rng.standard_normal((6, 6))
    z = [referee.hotelling(*(rng.standard_normal((2, 32, 6)) @ mixed)) for _ in range(400)]
    uniform = 2 * stats.norm.sf(z)
    judge.keeps(stats.kstest(uniform, "uniform").pvalue)
    judge.catches(stats.kstest(uniform**2, "uniform").pvalue)
    apart = rng.standard_normal((2, 32, 6)) + np.array([[[0.0]], [[2.0]]])
    assert referee.hotelling(*apart) > 8


def test_engines_agree_and_both_are_shown(judge):
    judge.pays(referee.RATE)
    found = compared(seed=judge.seed(2))
    assert found.holds, found
    for name in ("exact", "embree"):
        assert 0 < found.figures[f"θ = 60°, order 1 body: {name}"] < 1
        assert found.figures[f"θ = 60°, lost, wrapped: {name}"] == 0
    assert "order-1 specular lobe" in "".join(found.figures)


@pytest.mark.parametrize("own", ["exact", "embree"])
def test_another_index_in_one_engine_is_found(own, monkeypatch, judge):
    """The negative control: Embree traces n = 1.6."""
    right = wavefront.trace
    tracer = referee.engine.EMBREE
    monkeypatch.setattr(
        referee.engine,
        "EMBREE",
        replace(
            tracer,
            trace=lambda tile, theta, phi, facet, *rest, **more: right(
                tile, theta, phi, facet._replace(n=1.6), *rest, **more
            ),
        ),
    )
    asked = replace(SCENE, accuracy=Accuracy(1000, engine=own))
    found = compared(asked, judge.seed(3))
    assert not found.holds
    assert found.value > 1.5 * found.tolerance


def test_a_turned_lobe_of_the_same_albedo_is_found():
    rng = np.random.default_rng(4)
    lobes = rng.gamma(4.0, 1.0, (64, 10, 36))
    lobes[32:] = lobes[32:] * np.linspace(0.8, 1.2, 10)[:, None]
    assert referee.lobes_apart(lobes[:32], lobes[32:]) > 6
    same = rng.gamma(4.0, 1.0, (64, 10, 36))
    assert referee.lobes_apart(same[:32], same[32:]) < 6


def test_without_embreex_it_is_absent_not_broken(monkeypatch):
    monkeypatch.setitem(sys.modules, "embreex", None)
    found = compared()
    assert found.holds
    assert found.detail.startswith("absent: embreex")
    assert not found.figures
    assert false_alarms.critical(100, referee.RATE) > 5


@pytest.mark.parametrize(("rare", "allowed"), [(5.6e-6, True), (0.02, False)])
def test_light_that_one_engine_hardly_draws_is_no_alarm_and_much_light_is(rare, allowed):
    """One engine carries a small weight in each run, the other draws it and had none."""
    rng = np.random.default_rng(5)
    bins = 46 * 36
    sides = rng.normal(0.1, 0.002, (2, referee.RUNS, 4, 2, 46, 36)) / bins
    sides[0, :, 3], sides[1, :, 3] = rare / bins, 0.0
    z = [values[0] for _, values in referee._quantities(*sides)]
    assert (np.abs(z).max() < 5) == allowed
