"""The march of a fan against the walk: what it says is blocked is, and what it says is free is."""

import numpy as np
import pytest

from microsurf.surface import generate_surface
from microsurf.surface.heightfield import mesh
from microsurf.trace.exact import exact_tile
from microsurf.trace.kernels import lobe_fans
from microsurf.trace.kernels.exact_first_hits import unblocked
from microsurf.trace.kernels.exact_horizon import first_blocked
from microsurf.trace.kernels.exact_lobe_fans import nodes_of
from microsurf.trace.kernels.exact_near_horizon import NEAR
from microsurf.trace.kernels.exact_walk import facet_plane

COUNT = 1500
RINGS = lobe_fans.all_rings(1.5)
ABOVE = 46


def surfaces():
    rng = np.random.default_rng(3)
    steep = mesh(generate_surface(1.75, 0.6, cells=64, seed=1))
    needles = 0.3 * rng.standard_normal((2 * NEAR + 3, 70))
    needles[rng.integers(0, 51, 5), rng.integers(0, 70, 5)] += 1000
    plateaus = np.floor(3 * rng.random((16, 16))).repeat(4, axis=0).repeat(4, axis=1)
    oblong = mesh(generate_surface(8.0, 0.7, cells=(50, 131), seed=2))
    small = mesh(generate_surface(8.0, 0.7, cells=16, seed=2))
    return {
        "steep": (steep.heights, steep.flipped, 1.0),
        "needles": (needles, np.zeros(needles.shape, bool), 1.0),
        "plateaus": (plateaus, np.zeros(plateaus.shape, bool), 1.0),
        "oblong": (oblong.heights, oblong.flipped, 1.7),
        "flipped": (steep.heights, rng.random((64, 64)) < 0.5, 1.0),
        "small": (small.heights, small.flipped, 1.0),
    }


def azimuth(kind, rng):
    """cos φ and sin φ, exactly along the grid for some."""
    turn = rng.uniform(0, 2 * np.pi)
    quarter = rng.integers(4)
    along = np.array([(1, 0), (0, 1), (-1, 0), (0, -1)])[quarter]
    across = np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)])[quarter] / np.sqrt(2)
    return {"any": (np.cos(turn), np.sin(turn)), "grid": along, "diagonal": across}[kind]


def start(tile, rng):
    """A facet, and a point of it: anywhere, or within 1e−9 of one of its edges."""
    cx, cy, side = rng.integers(tile.columns), rng.integers(tile.rows), rng.integers(2)
    fx, fy = rng.random(2) if rng.random() < 0.8 else np.clip(rng.normal(0, 1e-9, 2) % 1, 0, 1)
    beside = 1 - fx - fy if tile.flipped[cy, cx] else fx - fy
    if (beside > 0) != (side == 0):
        fx, fy = (1 - fx, 1 - fy) if tile.flipped[cy, cx] else (fy, fx)
    p, q, corner = facet_plane(tile, cx, cy, side)
    return (cx + fx, cy + fy, corner + p * fx + q * fy), (cx, cy, side), (p, q * tile.aspect)


def disagreements(march, walk, kind):
    """Fans of which the ray before the border is blocked, or the one behind it is not."""
    rng = np.random.default_rng(7)
    nodes = nodes_of(RINGS)
    wrong = borders = 0
    for _ in range(COUNT):
        point, (cx, cy, side), (p, q) = start(march, rng)
        cos_phi, sin_phi = azimuth(kind, rng)
        length = np.sqrt(1 + p * p + q * q)
        mz, mt = 1 / length, -(p * cos_phi + q * sin_phi) / length
        last, chance = np.pi / 2 + np.arctan2(mt, mz), rng.random()
        high = min(int(np.searchsorted(RINGS.edges, last)), ABOVE)
        first = first_blocked(
            march, *point, cx, cy, side, cos_phi, sin_phi, mz, mt, last, chance, high, RINGS, nodes
        )
        facet, place = np.array([2 * (cy * march.columns + cx) + side]), np.array([point])
        for ring, free in ((first - 1, True), (first, False)):
            if 0 <= ring < high:
                theta = lobe_fans.elevation(ring, mz, mt, last, chance, RINGS)
                sine, out = np.sin(theta), np.empty(1, bool)
                unblocked(walk, facet, place, sine * cos_phi, sine * sin_phi, np.cos(theta), out)
                wrong += out[0] != free
                borders += 1
    return wrong, borders


@pytest.mark.parametrize("name", surfaces())
@pytest.mark.parametrize("kind", ["any", "grid", "diagonal"])
def test_a_march_finds_the_border_that_rays_find(name, kind):
    heights, flipped, aspect = surfaces()[name]
    tile = exact_tile(heights, flipped, aspect)
    wrong, borders = disagreements(tile, tile, kind)
    assert wrong == 0
    assert borders > COUNT


def test_a_march_over_other_heights_finds_another_border():
    """Negative control: heights a tenth greater, which move some borders into the next ring."""
    heights, flipped, aspect = surfaces()["steep"]
    low, high = (exact_tile(scale * heights, flipped, aspect) for scale in (1, 1.1))
    assert disagreements(high, low, "any")[0] > 0
