"""Walks with common random numbers against those with one stream."""

from dataclasses import replace

import numpy as np
import pytest

from microsurf.errors import InputError
from microsurf.model.directions import direction
from microsurf.model.random_walk.common import EVENTS, by_body
from microsurf.model.random_walk.evaluate import evaluate_walk
from microsurf.physics.facet import body_weight
from microsurf.scene import Layers, Material, Roughness, Scene, Substrate

LIGHT = direction(np.radians([0.0, 30.0, 60.0, 75.0]), np.zeros(4))
SEEN = direction(np.radians([20.0, 50.0, 60.0, 40.0]), np.radians([0.0, 180.0, 120.0, 10.0]))
ALL = 10**9


def scene(kd, gamma=2.5, n=1.5, k=0.0):
    material = Material(n, (kd,)) if k == 0 else Material(n, (), k)
    return Scene(material=material, roughness=Roughness(gamma, (0.6,)))


def several(material, seed, orders):
    """Ten estimates by body events, shape (10, pairs, events)."""
    return np.array([by_body(material, LIGHT, SEEN, 5000, seed + k, orders) for k in range(10)])


@pytest.mark.parametrize("orders", [(1, ALL), (2, 2)])
@pytest.mark.parametrize("kd", [0.3, 0.9])
def test_by_body_adds_up_to_the_walk_at_every_kd(judge, kd, orders):
    rng = np.random.default_rng(judge.seed(11))
    mean, error = evaluate_walk(scene(kd), LIGHT, SEEN, "smith-walk", 50_000, rng, orders)
    parts = several(scene(kd), judge.seed(100), orders)
    weights = float(body_weight(1.5, kd)) ** np.arange(EVENTS + 1)
    own = (parts @ weights).std(axis=0, ddof=1) / np.sqrt(10)
    errors = np.hypot(own, error.total)
    judge.near((parts @ weights).mean(axis=0), mean.total, errors, dof=9)
    # Without the weights it is another BRDF.
    judge.tells(parts.sum(axis=2).mean(axis=0), mean.total, errors, dof=9)


def test_a_conductor_has_no_body_light(judge):
    rng = np.random.default_rng(judge.seed(12))
    metal = scene(0.0, n=0.5, k=3.0)
    mean, error = evaluate_walk(metal, LIGHT, SEEN, "smith-walk", 50_000, rng, (2, ALL))
    parts = several(metal, judge.seed(200), (2, ALL))
    assert not np.any(parts[:, :, 1:])
    own = parts[:, :, 0].std(axis=0, ddof=1) / np.sqrt(10)
    errors = np.hypot(own, error.total)
    judge.near(parts[:, :, 0].mean(axis=0), mean.total, errors, dof=9)


def test_common_random_numbers_follow_small_changes():
    """A change of γ by 1e−4 moves the estimate far less than another seed does."""
    one, near, other = (
        by_body(scene(0.5, gamma), LIGHT, SEEN, 2000, seed).sum(axis=1)
        for gamma, seed in ((2.5, 3), (2.5001, 3), (2.5, 4))
    )
    assert np.abs(near - one).max() < np.abs(other - one).max() / 10
    assert np.array_equal(by_body(scene(0.5), LIGHT, SEEN, 2000, 3).sum(axis=1), one)


def test_what_is_no_walk_is_refused():
    with pytest.raises(InputError, match="must be > 0"):
        by_body(Scene(roughness=Roughness(2.0, (0.0,))), LIGHT, SEEN, 10, 0)
    with pytest.raises(InputError, match="walks = 0"):
        by_body(scene(0.5), LIGHT, SEEN, 0, 0)
    layers = Layers(20.0, Substrate(2.0, (0.5,)))
    with pytest.raises(InputError, match=r"\[layers\]: Smith's walk knows one surface"):
        by_body(replace(scene(0.5), layers=layers), LIGHT, SEEN, 10, 0)
