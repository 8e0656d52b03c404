"""The exact engine: books, closed forms, and the same light as Embree's."""

import functools
import operator
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from scipy import stats

from microsurf.errors import InputError
from microsurf.physics import facet, fresnel
from microsurf.results import detector
from microsurf.scene import Accuracy, Light, Material, Roughness, Scene, Surface
from microsurf.surface import generate_surface
from microsurf.surface.heightfield import mesh
from microsurf.trace import engine, exact, measure
from microsurf.trace.kernels import exact_lobe_fans, lobe_fans
from microsurf.trace.wavefront import FacetOptics

IL = FacetOptics(1.5, interface=True, substrate=True, multiple_scattering=True)
MIRROR = FacetOptics(1.5, interface=True, substrate=False, multiple_scattering=True)
METAL = FacetOptics(0.21, interface=True, substrate=False, multiple_scattering=True, k=3.272)
LAMBERT = FacetOptics(1.0, interface=False, substrate=True, multiple_scattering=True)
SINGLE = FacetOptics(1.5, interface=True, substrate=True, multiple_scattering=False)


def rough(rows, columns, scale=1.0, seed=0):
    """Heights that know nothing of each other, diagonals at random."""
    rng = np.random.default_rng(seed)
    return scale * rng.standard_normal((rows, columns)), rng.random((rows, columns)) < 0.5


def follow(tile, theta, facets=IL, count=200_000, seed=1, phi=20.0):
    parts = [
        engine.trace(
            tile, theta, phi, facets, count // 8, np.random.default_rng((seed, k)), part=k, parts=8
        )
        for k in range(8)
    ]
    return functools.reduce(operator.add, parts)


def by_order_and_kind(tally, kd=0.8, n=1.5):
    """Albedos of order 1 … 4 and kind, and their standard errors from the batches."""
    weights = float(facet.body_weight(n, kd)) ** detector.BODY_EVENTS[: tally.energy.shape[1]]
    batches = np.stack(
        [tally.batches[:, :, 0], tally.batches[:, :, 1:] @ weights[1:]], axis=2
    ).reshape(len(tally.batches), -1)
    mean = batches.sum(0) / tally.light
    rest = batches - mean * tally.batch_light[:, None]
    return mean, np.sqrt((rest**2).sum(0) * len(rest) / (len(rest) - 1)) / tally.light


@pytest.mark.parametrize("facets", [IL, MIRROR, METAL, LAMBERT, SINGLE])
@pytest.mark.parametrize("shape", [(7, 13), (2, 2), (64, 32)])
def test_all_light_is_accounted_for(facets, shape):
    tile = exact.exact_tile(*rough(*shape, scale=2))
    for theta in (0, 60, 89.9):
        tally = exact.trace(tile, theta, 20.0, facets, 5_001, np.random.default_rng(1))
        light = -(-5_001 // facets.branches)
        assert tally.light == light
        assert abs(tally.energy.sum() + tally.ended.sum() - light) <= 1e-12 * light
        assert abs(tally.batches.sum() - tally.energy.sum()) <= 1e-12 * light
        assert tally.batch_light.sum() == light
        assert tally.lost.sum() == 0


@pytest.mark.parametrize("paths", [200, pytest.param(4_000, marks=pytest.mark.long)])
def test_a_needle_loses_nothing(paths):
    """Ten thousand cells high in a tile of 64, lit at 89.9°, Kd = 1."""
    heights = np.zeros((64, 64))
    heights[20, 30] = 1e4
    tile = exact.exact_tile(heights, np.zeros(heights.shape, bool))
    tally = exact.trace(tile, 89.9, 20.0, IL, paths, np.random.default_rng(1))
    assert abs(tally.energy.sum() / tally.light - 1) <= 1e-12
    assert tally.ended.sum() == 0


@pytest.mark.parametrize("theta", [0, 60, 89])
@pytest.mark.parametrize("n", [1.0, 1.5, 2.4])
def test_a_flat_tile_is_one_facet(theta, n):
    facets = FacetOptics(n, n > 1, substrate=True, multiple_scattering=True)
    tally = follow(engine.plane("exact"), theta, facets, count=20_000)
    assert tally.energy[1:].sum() == 0
    expected = float(fresnel.transmittance(np.cos(np.radians(theta)), n))
    assert abs(tally.energy[0, 1].sum() / tally.light - expected) <= 1e-12


@pytest.mark.parametrize("n", [1.0, 1.33, 1.5, 5.0, 100.0])
def test_shares_are_those_of_the_other_engine(n):
    rings = lobe_fans.all_rings(n)
    nodes, count = exact_lobe_fans.nodes_of(rings), len(rings.edges) - 1
    rng = np.random.default_rng(4)
    for _ in range(200):
        tilt, turn = rng.uniform(0, np.pi / 2 - 1e-3), rng.uniform(0, 2 * np.pi)
        mz, mt = np.cos(tilt), np.sin(tilt) * np.cos(turn)
        last = np.pi / 2 + np.arctan2(mt, mz)
        ours, theirs = np.zeros(count), np.zeros(count)
        seen, total = exact_lobe_fans.ring_shares.py_func(
            mz, mt, last, rings, nodes, np.zeros(2 * count), ours
        )
        other, all_of_it = lobe_fans.shares.py_func(mz, mt, last, rings, theirs)
        assert seen == other
        np.testing.assert_allclose(ours[:seen], theirs[:seen], rtol=1e-9, atol=1e-15)
        assert total == pytest.approx(all_of_it, rel=1e-12)


@pytest.mark.parametrize(("facets", "n"), [(IL, 1.5), (LAMBERT, 1.0), (MIRROR, 1.5)])
@pytest.mark.parametrize("theta", [0, 70])
def test_both_engines_measure_the_same(judge, facets, n, theta):
    """By order and kind; negative control: another surface of the same kind."""
    made = mesh(generate_surface(2.0, 0.6, cells=64, seed=3))
    other = mesh(generate_surface(2.0, 0.75, cells=64, seed=4))
    tiles = [engine.tile_of(name, made) for name in ("exact", "embree")]
    tiles.append(engine.tile_of("exact", other))
    (a, da), (b, db), (c, dc) = (
        by_order_and_kind(follow(tile, theta, facets, seed=judge.seed(k)), n=n)
        for k, tile in enumerate(tiles)
    )
    seen = (a > 1e-4) & (b > 1e-4)
    judge.near(a[seen], b[seen], np.hypot(da, db)[seen])
    judge.tells(c[seen], b[seen], np.hypot(dc, db)[seen])


def test_lobes_of_both_engines_agree(judge):
    """Bins of the order-1 body lobe, whose variance is that of their fans at most."""
    made = mesh(generate_surface(8.0, 0.7, cells=64, seed=3))
    lobes = []
    for k, name in enumerate(("exact", "embree")):
        tile = engine.tile_of(name, made)
        runs = (
            np.array(
                [
                    follow(tile, 60, count=16_000, seed=100 * judge.seed(k + 1) + r).energy[0, 1]
                    for r in range(24)
                ]
            )
            / 8_000
        )
        lobes.append(runs[:, :44:4].reshape(24, 11, 12, 3).sum(-1).reshape(24, -1))
    a, b = (lobe.mean(0) for lobe in lobes)
    error = np.sqrt(sum(lobe.var(0, ddof=1) / 24 for lobe in lobes))
    p = 2 * stats.t.sf(np.abs(a - b) / error, 40)
    judge.keeps(p)


def test_batches_know_the_error_of_a_sum(judge):
    """Against the spread of 40 runs: not less, and at most four times the variance.

    Batches do not know of each other's strata and sequence, which make the sum better.
    """
    tile = exact.exact_tile(*rough(32, 32))
    runs = [
        by_order_and_kind(follow(tile, 60, count=8_000, seed=1000 * judge.seed(1) + k))
        for k in range(40)
    ]
    totals = np.array([mean.sum() for mean, _ in runs])
    second = np.array([mean[3] for mean, _ in runs])  # order 2, body
    claimed = np.mean([error[3] ** 2 for _, error in runs])
    spread = second.var(ddof=1)
    freedom = 39, 40 * 31

    def p_value(factor):
        return min(
            2 * stats.f.sf(spread / (factor * claimed), *freedom),
            2 * stats.f.cdf(4 * spread / (factor * claimed), *freedom),
            1.0,
        )

    assert totals.std() > 0
    judge.keeps(p_value(1))
    judge.catches(p_value(1 / 16))
    judge.catches(p_value(32))


def scene(name, **accuracy):
    return Scene(
        material=Material(1.5, (0.8,)),
        roughness=Roughness(2.0, (0.5,)),
        surface=Surface(cells=64, realisations=1),
        light=Light((60.0,)),
        accuracy=Accuracy(engine=name, **accuracy),
    )


def test_same_seed_same_bits_whatever_the_workers():
    asked = scene("exact", paths=600_000)
    one, two, other = (measure(asked, seed=s, workers=w) for s, w in ((5, 1), (5, 3), (6, 1)))
    xr.testing.assert_identical(one.flux, two.flux)
    assert not np.array_equal(one.flux.values, other.flux.values)
    assert one.attrs["engine"] == "exact"


def test_a_scene_names_its_engine():
    for name in ("exact", "embree"):
        asked = scene(name)
        assert engine.engine_of(asked) == name
        assert Scene.from_toml(asked.to_toml()).accuracy.engine == name
        assert asked.accuracy.with_paths(10).engine == name
    auto = scene("auto")
    assert auto == scene(None)
    assert engine.engine_of(auto) == engine.AUTO
    with pytest.raises(InputError, match="exact"):
        replace(auto, accuracy=Accuracy(engine="fast"))
