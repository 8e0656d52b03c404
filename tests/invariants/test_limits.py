import numpy as np
import pytest

from microsurf.invariants import limits
from microsurf.physics import facet


def test_flat_and_lambertian_limits_hold():
    found = list(limits.flat(1, 2))
    assert [row.name for row in found] == [
        "flat limit",
        "Lambertian limit",
        "flat and Lambertian lobes",
    ]
    assert all(row.holds for row in found)


def test_another_index_is_found(monkeypatch):
    """A closed form of n a part in 1e9 off is told apart."""
    right = facet.albedo
    monkeypatch.setattr(facet, "albedo", lambda mu, n, kd: right(mu, n * (1 + 1e-9), kd))
    assert not next(limits.flat(1, 2)).holds


def test_a_ring_with_other_light_is_found():
    lobes = np.zeros((1, 1, 1, 1, 2, 45, 36))
    wrong = lobes.copy()
    wrong[0, 0, 0, 0, 1, 20, 3] += 1e-5
    assert limits.ring_gap(wrong, lobes) == pytest.approx(1e-5)


def test_small_roughness_is_flat(monkeypatch):
    """With a closed form 1 % off it is not."""
    assert limits.small_roughness(1, 2).holds
    right = facet.albedo
    monkeypatch.setattr(facet, "albedo", lambda mu, n, kd: 1.01 * right(mu, n, kd))
    assert not limits.small_roughness(1, 2).holds


def test_an_interface_that_does_not_vanish_is_found(pool, monkeypatch):
    """Rays that weigh another Kd with it, and a model with a jump at n = 1."""
    right = limits.features
    monkeypatch.setattr(
        limits, "features", lambda tally, n, kd: right(tally, n, kd if n == 1 else 0.95 * kd)
    )
    monkeypatch.setattr(limits, "_order_1", lambda n: np.array([0.6 + 0.02 * (n > 1)]))
    traced, predicted = limits.small_interface(pool, 1)
    assert not traced.holds
    assert not predicted.holds
