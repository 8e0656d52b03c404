import numpy as np
import pytest

from microsurf.invariants import reciprocity
from microsurf.invariants.replicates import tile_of
from microsurf.results import detector
from microsurf.surface import LayeredMesh, Mesh
from microsurf.trace.layers import layered_tile

ONE_WAY = reciprocity.IL._replace(n=1.0, k=1.0)
"""Light enters the substrate by the T of a conductor and leaves it by Lambert's cosine."""


def test_patches_are_bins_and_their_light_is_theirs():
    seen = np.zeros((detector.RINGS, detector.SECTORS), int)
    for patch in reciprocity.PATCHES:
        seen[patch.first : patch.last, patch.sectors] += 1
        points = np.concatenate([patch.directions(np.random.default_rng(k)) for k in range(64)])
        low, high = detector.RING_EDGES[[patch.first, patch.last]]
        assert ((points[:, 0] >= low) & (points[:, 0] <= high)).all()
        middle, half = patch.middle * 10, reciprocity.WIDTH * 5
        assert (np.abs(points[:, 1] - middle) <= half).all()
        # Mean of sin²θ, uniform in the patch; a density of dω alone would be 1 % off.
        sines = np.sin(np.radians([low, high])) ** 2
        mean = (np.sin(np.radians(points[:, 0])) ** 2).mean()
        assert mean == pytest.approx(sines.mean(), rel=1e-3)
        area = np.pi * (sines[1] - sines[0]) * reciprocity.WIDTH / detector.SECTORS
        assert patch.size == pytest.approx(area, rel=1e-12)
    assert seen.max() == 1


def made(there, back, noise, seed=0):
    """Fluxes of every pair, with relative noise, there and back."""
    rng = np.random.default_rng(seed)
    count = len(reciprocity.PATCHES)
    means = np.ones((count, count, len(reciprocity.QUANTITIES)))
    means[np.triu_indices(count, 1)] = there
    means[np.tril_indices(count, -1)] = back
    return means * (1 + noise * rng.standard_normal((reciprocity.RUNS, *means.shape)))


def test_judge_tells_there_from_back():
    assert reciprocity.judge(made(1.0, 1.0, 0.02)).holds
    found = reciprocity.judge(made(1.03, 1.0, 0.02))
    assert not found.holds
    assert found.figures["order-1 body, all pairs: difference in %"] == pytest.approx(3, abs=1)
    assert found.figures["order-1 body, all pairs: standard error in %"] < 0.5


@pytest.mark.long
def test_a_one_way_facet_is_found(pool):
    """The negative control, at a report's size."""
    tile = tile_of(reciprocity.skewed(0))
    found = reciprocity.judge(reciprocity.fluxes(pool, tile, ONE_WAY, (0, 2)))
    assert found.value > 1.2 * found.tolerance


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_an_explicit_surface_is_reciprocal(pool, seed):
    (found,) = reciprocity.reciprocity(pool, seed)
    assert found.holds
    errors = [x for name, x in found.figures.items() if "body, all pairs: standard" in name]
    assert max(errors) < 0.5


@pytest.mark.long
@pytest.mark.parametrize("same", [True, False])
def test_two_layers_are_reciprocal(pool, same):
    """With absorption; negative control: light not taken over the projected solid angle."""
    above = reciprocity.skewed(1)
    below = above if same else reciprocity.skewed(2)
    gap = float((below - above).max()) + 2
    straight = np.zeros(above.shape, bool)
    pair = LayeredMesh(Mesh(above, straight), Mesh(below - gap, straight), gap)
    light = reciprocity.fluxes(pool, layered_tile(pair, 0.002), reciprocity.IL, (5, 1), 1000)
    assert reciprocity.judge(light).holds
    sizes = np.array([patch.size for patch in reciprocity.PATCHES])
    assert not reciprocity.judge(light / sizes[:, None, None]).holds
