"""Every book of a scene, and a change of it that must be found."""

from dataclasses import replace

import numpy as np
import pytest

from microsurf import model
from microsurf.invariants import area, broken, energy
from microsurf.scene import Accuracy, Light, Material, Scene, Surface
from microsurf.surface import Heightfield, surfaces_of
from microsurf.trace import measure

SCENE = Scene(
    material=Material(1.5, (0.3, 0.9)),
    surface=Surface(cells=32, realisations=2),
    light=Light((30.0, 80.0)),
    accuracy=Accuracy(4000),
)


@pytest.fixture(scope="module")
def surfaces():
    return list(surfaces_of(SCENE, 3))


@pytest.fixture(scope="module")
def measured(surfaces):
    return measure(SCENE, surfaces, seed=3)


@pytest.fixture(scope="module")
def walked():
    return model.walk(SCENE, walks=2000)


def names(lines):
    return {line.split(":")[0] for line in lines}


def test_a_scene_keeps_its_books(measured, walked, surfaces):
    found = energy.scene_invariants(measured, {"smith-walk": walked}, surfaces, SCENE.material)
    assert broken(found) == []
    assert [row.name for row in found] == [
        "energy",
        "energy, smith-walk",
        "sums over orders",
        "no impossible light",
        "no light of its own",
        "projected area, closed",
    ]
    flat = energy.scene_invariants(measured, {}, [], SCENE.material)
    assert [row.name for row in flat] == [found[k].name for k in (0, 2, 3, 4)]


def test_thinned_paths_are_counted_right():
    """Lambertian pits of Kd = 0.97: paths beyond 16 body events stand for more than one."""
    heights = np.zeros((4, 4))
    heights[0, 0] = 60.0
    scene = replace(SCENE, material=Material(1.0, (0.97,)))
    pit = [Heightfield(heights)]
    measured = measure(scene, pit)
    assert measured.path_weight.max() > 1.2
    assert broken(energy.scene_invariants(measured, {}, pit, scene.material)) == []


def change(dataset, name, index, amount):
    wrong = dataset.copy(deep=True)
    wrong[name].values[index] += amount
    return wrong


@pytest.mark.parametrize(
    ("name", "index", "amount", "expected"),
    [
        # One path in 4000 taken away or counted twice.
        ("arrived", (0, 0, 0), 1, {"energy", "sums over orders"}),
        ("arrived", (0, 0, 0), -1, {"energy", "sums over orders"}),
        ("ended", (1, 1, 0, 2), 1, {"energy"}),
        ("flux", (0, 0, 0, 1, 1, 20, 3), 1e-9, {"sums over orders"}),
        ("batch_flux", (0, 0, 0, 5, 1, 1), 1e-6, {"sums over orders"}),
        # Order 1 with two body events; and a negative bin.
        ("flux", (0, 0, 0, 0, 2, 20, 3), 1e-9, {"sums over orders", "no impossible light"}),
        ("flux", (0, 0, 0, 3, 5, 45, 3), -1e-3, {"sums over orders", "no impossible light"}),
        ("flux", (0, 0, 0, 0, 0, 20, 3), 1.0, {"sums over orders", "no light of its own"}),
    ],
)
def test_a_wrong_entry_is_found(measured, name, index, amount, expected):
    wrong = change(measured, name, index, amount)
    assert names(broken(energy.scene_invariants(wrong, {}, [], SCENE.material))) == expected


def test_a_lost_walk_is_found(measured, walked):
    wrong = change(walked, "ended", (0, 1, 0, 0), -1)
    found = energy.scene_invariants(measured, {"smith-walk": wrong}, [], SCENE.material)
    assert names(broken(found)) == {"energy, smith-walk"}


def test_a_model_that_shines_is_found(measured):
    bright = model.predict(SCENE)
    bright["flux"] = bright.flux * 2.5
    found = energy.scene_invariants(measured, {"smith": bright}, [], SCENE.material)
    assert names(broken(found)) == {"no light of its own"}


def test_a_period_that_does_not_close_is_found(surfaces, monkeypatch):
    mirrored = Heightfield(surfaces[0].heights, boundary="mirror")
    assert area.closed([*surfaces, mirrored]).holds

    def open_at_the_end(surface):
        heights = np.pad(surface.heights, ((0, 1), (0, 1)), mode="edge")
        p, q = np.diff(heights, axis=1), np.diff(heights, axis=0)
        return np.stack([p[:-1], p[1:]]), np.stack([q[:, 1:], q[:, :-1]])

    monkeypatch.setattr(area, "facet_slopes", open_at_the_end)
    assert not area.closed(surfaces).holds
