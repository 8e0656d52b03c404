"""What leaving out multiple scattering costs, against the orders of a run with all of them."""

from dataclasses import replace

import numpy as np
import pytest

from microsurf import measure
from microsurf.analysis import omitted_effects
from microsurf.scene import Accuracy, Effects, Light, Material, Roughness, Scene, Surface
from microsurf.surface import surfaces_of

SCENE = Scene(
    material=Material(1.5, (0.0, 0.9)),
    roughness=Roughness(2.0, (0.7,)),
    surface=Surface(cells=48, realisations=4),
    light=Light((0.0, 60.0)),
    accuracy=Accuracy(20_000),
    effects=Effects(multiple_scattering=False),
)


def test_the_cost_is_what_the_later_orders_hold(judge):
    """The first order is the same light on the same surfaces; the rest is the cost.

    Surfaces are the same for all runs, so that rays alone make a difference, thrice: of
    what is left out, of all, and of the second measurement.
    """
    surfaces = list(surfaces_of(SCENE, 3))
    alone = measure(SCENE, surfaces, seed=judge.seed(3))
    rows = omitted_effects.cost(SCENE, alone, surfaces, seed=judge.seed(3))
    assert [(r["theta_i"], r["kd"]) for r in rows] == [(0, 0.0), (60, 0.0), (0, 0.9), (60, 0.9)]
    whole = measure(replace(SCENE, effects=Effects()), surfaces, seed=judge.seed(4))
    found = []
    for row in rows:
        orders = (
            whole.microsurf.albedo_by_order(n=1.5, kd=row["kd"])
            .sum("kind")
            .sel(theta_i=row["theta_i"])
        )
        first = orders.sel(order=1) / orders.sum("order")
        share = first.values.ravel() - 1
        place = {"theta_i": row["theta_i"]}
        noise = [
            (
                d.microsurf.ray_error(n=1.5, kd=row["kd"]) / d.microsurf.albedo(n=1.5, kd=row["kd"])
            ).sel(place)
            for d in (alone, whole, whole)
        ]
        error = np.sqrt(sum((n.values**2).sum() for n in noise)) / SCENE.surface.realisations
        found.append((row["error"], share.mean(), error))
        assert row["high"] < 0  # light is missing, beyond noise
    cost, expected, error = np.transpose(found)
    judge.near(cost, expected, error)
    judge.tells(cost, 0.7 * expected, error)  # negative control
    assert rows[3]["error"] < -0.05


def test_nothing_left_out_runs_nothing(monkeypatch):
    monkeypatch.setattr(omitted_effects, "measure", lambda *_, **__: pytest.fail("measured"))
    for scene in (replace(SCENE, effects=Effects()), replace(SCENE, roughness=Roughness(2, (0,)))):
        assert omitted_effects.cost(scene, None, None) == []


def test_one_surface_has_the_error_of_its_rays():
    one = replace(SCENE, surface=Surface(cells=48, realisations=1))
    surfaces = list(surfaces_of(one, 3))
    rows = omitted_effects.cost(one, measure(one, surfaces, seed=3), surfaces, seed=3)
    assert all(r["low"] < r["error"] < r["high"] for r in rows)
