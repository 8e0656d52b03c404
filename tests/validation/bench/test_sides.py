"""Mitsuba as the benchmark uses it: a second engine, which must see what ours sees."""

import numpy as np
import pytest
from scipy import stats

from microsurf.errors import MicrosurfError
from microsurf.physics import facet
from microsurf.surface import Heightfield, generate_surface
from validation.bench.efficiency import FIGURES, agreement, figures
from validation.bench.sides import EMBREE, EXACT, KD, N, Ours
from validation.mitsuba import renderer

try:
    renderer.load()
except MicrosurfError as absent:
    pytest.skip(str(absent), allow_module_level=True)

THETAS = (0.0, 60.0)
BATCHES, PATHS = 24, 2**16


@pytest.fixture(scope="module")
def surface():
    return generate_surface(2.0, 0.5, cells=128, seed=3)


@pytest.fixture(scope="module", params=[EXACT, EMBREE])
def ours(surface, new_seed, request):
    side = Ours(surface, 0.5, workers=1, engine=request.param, fixed=True)
    return np.stack(
        [figures(side.batch(THETAS, KD, PATHS, new_seed(k)).flux) for k in range(BATCHES)]
    )


def theirs(surface, n, reflectance, seed):
    tile = renderer.MitsubaTile(surface, n, reflectance)
    return np.stack(
        [
            [figures(tile.trace(theta, PATHS, seed + k).flux) for theta in THETAS]
            for k in range(BATCHES)
        ]
    )


@pytest.mark.parametrize(("index", "same"), [(N, True), (1.45, False)])
def test_albedos_by_order_and_kind_are_those_of_microsurf(surface, ours, index, same, judge):
    """Two engines, one physics; a facet of another index is noticed.

    Student's t with the fewest degrees of freedom it has.
    """
    other = theirs(surface, index, renderer.same_body(index, KD), judge.seed(100))
    z = np.stack([agreement(ours[:, a], other[:, a], PATHS) for a in range(len(THETAS))])
    assert np.count_nonzero(np.isfinite(z)) > len(FIGURES)
    p_values = 2 * stats.t.sf(np.abs(z[np.isfinite(z)]), BATCHES - 1)
    (judge.keeps if same else judge.catches)(p_values)


def test_a_flat_tile_has_the_albedo_of_its_facet(judge):
    """Every path has one event, and its mean weight is that of the facet: F + T w."""
    tile = renderer.MitsubaTile(Heightfield(np.zeros((16, 16))), N, renderer.same_body(N, KD))
    for theta in (0.0, 60.0, 80.0):
        runs = [tile.trace(theta, 2**16, judge.seed(k)) for k in range(16)]
        assert sum(sum(run.lost.values()) for run in runs) == 0
        albedos = np.array([run.flux.sum() for run in runs])
        expected = float(facet.albedo(np.cos(np.radians(theta)), N, KD))
        # float32 weights add 1e−6.
        judge.near(albedos.mean(), expected, albedos.std(ddof=1) / 4, dof=15, within=1e-6)
        mirror = np.zeros_like(runs[0].flux[0, 0], dtype=bool)
        ring = np.searchsorted([0, *np.arange(1, 90, 2), 90], theta, side="right") - 1
        mirror[ring, slice(None) if theta == 0 else 18] = True
        assert runs[0].flux[0, 0][~mirror].sum() == 0
        assert runs[0].flux[1:].sum() == 0


def test_the_same_seed_gives_the_same_lobes_but_for_the_order_of_sums(surface):
    tile = renderer.MitsubaTile(surface, N, 0.8)
    first, again, other = (tile.trace(60.0, 2**14, seed).flux for seed in (1, 1, 2))
    # Threads add float32 weights of a bin in any order.
    np.testing.assert_allclose(again, first, rtol=1e-4, atol=1e-9)
    assert not np.allclose(other, first, rtol=1e-4, atol=1e-9)


def test_odd_numbers_of_paths_are_refused(surface):
    tile = renderer.MitsubaTile(surface, N, 0.8)
    with pytest.raises(ValueError, match="power of two"):
        tile.trace(0.0, 1000, 1)
