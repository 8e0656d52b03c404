from dataclasses import replace

import numpy as np
import pytest

from microsurf.invariants import false_alarms, furnace
from microsurf.physics import facet, fresnel


def test_a_facet_is_white():
    assert furnace.evaluated_facet().holds


@pytest.mark.parametrize("wrong", ["n2 dropped", "r_i 1 % off"])
def test_a_wrong_substrate_is_found(monkeypatch, wrong):
    """At Kd < 1 too, where a dropped 1/n² is no mere factor."""
    right = facet.body

    def body(cos_i, cos_o, n, kd):
        if wrong == "n2 dropped":
            return right(cos_i, cos_o, n, kd) * n**2
        r_i = 1.01 * float(fresnel.internal_diffuse_reflectance(n))
        pair = fresnel.transmittance(cos_i, n) * fresnel.transmittance(cos_o, n)
        return pair * kd / (np.pi * n**2 * (1 - kd * r_i))

    monkeypatch.setattr(facet, "body", body)
    assert furnace.facet_gap(1.5, 1.0, 0.5) > 1e-3
    assert furnace.facet_gap(1.5, 0.5, 0.5) > 1e-3
    assert not furnace.evaluated_facet().holds


def some(monkeypatch):
    scenes = [scene for k, scene in enumerate(furnace.explicit_scenes()) if k in (1, 7, 13)]
    monkeypatch.setattr(furnace, "explicit_scenes", lambda _: scenes)


def test_explicit_surfaces_are_white(monkeypatch):
    """n = 1 and 1.5 at Kd = 1, and a perfect mirror; then with a part in 1e9 taken away."""
    some(monkeypatch)
    found = furnace.traced(1, 2)
    assert found.holds
    assert found.figures["paths"] == 3 * 3 * furnace.PATHS
    right = furnace.measure

    def leaking(*args, **more):
        measured = right(*args, **more)
        measured["flux"] = measured.flux * (1 - 1e-9)
        return measured

    monkeypatch.setattr(furnace, "measure", leaking)
    assert not furnace.traced(1, 2).holds


def test_a_mirror_that_absorbs_is_not_perfect(monkeypatch):
    mirrors = [
        replace(scene, material=replace(scene.material, n=1e-6))
        for scene in furnace.explicit_scenes()
        if scene.material.conductor
    ]
    monkeypatch.setattr(furnace, "explicit_scenes", lambda _: mirrors[1:2])
    assert not furnace.traced(1, 2).holds


def test_walks_are_white():
    assert furnace.walked(1, 2).holds


def test_evaluated_walks_are_white(pool, judge):
    judge.pays(false_alarms.RATE / false_alarms.TESTS)
    found = furnace.evaluated_walk(pool, judge.seed(1))
    assert found.holds
    assert abs(found.figures["mean of all − 1 in %"]) < 1


def test_a_capped_walk_is_found():
    """Four events are not all, and the sample of a report knows."""
    values = furnace.furnace_values(
        1.5, (2.0, 1.0), 60.0, furnace.WALKS, np.random.default_rng(1), cap=4
    )
    assert false_alarms.against(values, 1.0) < -2 * false_alarms.critical(36)
