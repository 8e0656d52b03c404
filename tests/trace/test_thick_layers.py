"""Independent rough layers far apart: the closed limit, by traces of either surface alone."""

import numpy as np
import pytest
from layered_pairs import STRAIGHT, albedo, follow, optics, pair, relief

from microsurf.physics import facet, fresnel
from microsurf.physics.thick_layers import thick_albedo
from microsurf.results import detector
from microsurf.surface import Mesh
from microsurf.trace import engine, layers

N, KD, GAP = 1.5, 0.8, 200.0
WITHIN = 3e-3
DIRECTIONS = 30


@pytest.mark.parametrize("kd", [0.0, 0.5, 0.8, 1.0])
def test_of_two_planes_it_is_one_facet(kd):
    cosine = np.cos(np.radians([0.0, 60.0, 80.0]))
    diffuse = fresnel.external_diffuse_reflectance(N)
    closed = thick_albedo(fresnel.reflectance(cosine, N), diffuse, kd, N)
    np.testing.assert_allclose(closed, facet.albedo(cosine, N, kd), rtol=1e-13)
    assert thick_albedo(0.3, 0.2, 1.0, N) == pytest.approx(1, abs=1e-15)


def lambertian(tile, facets, weigh, seed):
    """Mean of what ``weigh`` makes of tallies in light from the Lambertian hemisphere."""
    rng = np.random.default_rng(seed)
    squares = (np.arange(DIRECTIONS) + rng.random(DIRECTIONS)) / DIRECTIONS
    values = [
        weigh(
            follow(
                tile, np.degrees(np.arcsin(np.sqrt(s))), facets, 4_000,
                seed=seed + k, phi=rng.uniform(0, 360),
            )
        )
        for k, s in enumerate(squares)
    ]  # fmt: skip
    return np.mean(values)


def without_substrate(tally):
    return tally.energy[:, :2].sum() / tally.light


@pytest.mark.parametrize("theta", [0, 60, 80])
def test_independent_layers_far_apart_meet_the_closed_limit(judge, theta):
    """Within 0.3 %; negative controls: a flat interface's R and r_e, and a flat substrate."""
    above, below = relief(1), relief(2)
    tile = layers.layered_tile(pair(above, below, GAP))
    traced, error = albedo(follow(tile, theta, optics(N), 200_000, seed=judge.seed(1)), KD)

    black = optics(N, substrate=False)
    beam = without_substrate(follow(tile, theta, black, 100_000, seed=judge.seed(2)))
    diffuse = lambertian(tile, black, without_substrate, judge.seed(100))
    alone = engine.tile_of("exact", Mesh(below, STRAIGHT))
    k = lambertian(alone, optics(1.0), _lambertian_albedo, judge.seed(200))
    closed = thick_albedo(beam, diffuse, k, N)
    judge.near(traced, closed, error, dof=30, within=WITHIN * closed)
    plane = fresnel.reflectance(np.cos(np.radians(theta)), N)
    flat = thick_albedo(plane, fresnel.external_diffuse_reflectance(N), KD, N)
    judge.tells(traced, flat, error, dof=30, within=WITHIN * closed)


def _lambertian_albedo(tally):
    """Albedo of Lambertian facets; each body event weighs Kd."""
    events = detector.BODY_EVENTS[: tally.energy.shape[1]]
    return (tally.energy.sum((0, 2, 3)) * KD**events).sum() / tally.light
