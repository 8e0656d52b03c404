"""Two explicit surfaces: exact invariants, limits in closed form, and defects that must show."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from layered_pairs import CELLS, PAIRS, STRAIGHT, albedo, follow, optics, pair, relief

from microsurf.errors import InputError
from microsurf.physics import facet, fresnel
from microsurf.results import detector
from microsurf.results.layers import absorbed
from microsurf.scene import Accuracy, Layers, Light, Material, Roughness, Scene, Substrate, Surface
from microsurf.surface import Mesh, flat_layers
from microsurf.trace import engine, layers, measure
from microsurf.trace.beam import light_direction, stratified_points
from microsurf.trace.kernels import exact_layers
from microsurf.trace.kernels.exact_layers import INNER_HITS, LENGTH, ROWS, SUBSTRATE_EVENTS
from microsurf.trace.kernels.splitmix import stream
from microsurf.trace.kernels.state import Bins, empty_tallies


def area(heights):
    """Area of the facets over that of the plane."""
    p, q = np.roll(heights, -1, 1) - heights, np.roll(heights, -1, 0) - heights
    return float(
        (
            np.sqrt(1 + p**2 + np.roll(q, -1, 1) ** 2) + np.sqrt(1 + np.roll(p, -1, 0) ** 2 + q**2)
        ).mean()
        / 2
    )


NEAR_ZENITH = detector.RINGS // 3
"""Rings up to 29°."""


def expected(both, n):
    """Length, substrate events, meetings from below, light within the first third of rings."""
    return np.array(
        [
            4 * n**2 * both.gap,
            n**2 * area(both.substrate.heights),
            n**2 * area(both.interface.heights),
            np.sin(np.radians(detector.RING_EDGES[NEAR_ZENITH])) ** 2,
        ]
    )


def furnace(both, n, seed, directions=120, rays=400, kernel=exact_layers.trace_layers):
    """The same of light from the Lambertian hemisphere at Kd = 1, and standard errors."""
    assert both.least_distance > 0
    tile = layers.layered_tile(both)
    rng = np.random.default_rng(seed)
    seen = np.zeros((directions, 4))
    tallies, inside = empty_tallies(), np.zeros((ROWS, len(detector.BODY_EVENTS)))
    bins = Bins(0.0, np.cos(np.radians(detector.RING_EDGES[1:])), detector.BODY_EDGES)
    # Stratified in sin²θ; the spread of the strata counts as error, which is then too large.
    squares = (np.arange(directions) + rng.random(directions)) / directions
    for k, square in enumerate(squares):
        tallies.energy[:] = 0
        inside[:] = 0
        theta = np.degrees(np.arcsin(np.sqrt(square)))
        down = -light_direction(theta, rng.uniform(0, 360))
        starts = stratified_points(rays, rng) * CELLS
        found = exact_layers.LayerTallies(tallies, inside)
        kernel(tile.layers, starts, *down, optics(n), 0.0, bins, found, stream(rng))
        seen[k, :3] = inside[[LENGTH, SUBSTRATE_EVENTS, INNER_HITS]].sum(1) / rays
        seen[k, 3] = tallies.energy[..., :NEAR_ZENITH].sum() / tallies.energy.sum()
    return seen.mean(0), seen.std(0, ddof=1) / np.sqrt(directions)


@pytest.mark.parametrize("name", PAIRS)
@pytest.mark.parametrize("n", [1.33, 1.5, 2.0])
def test_invariants_of_any_two_surfaces(judge, name, n):
    """Mean chord theorem (Cauchy; Blanco and Fournier 2003): see docs/layers.md."""
    mean, error = furnace(PAIRS[name], n, judge.seed(11))
    judge.near(mean, expected(PAIRS[name], n), error)


def _unbent(dx, dy, dz, *_):
    return dx, dy, dz


def _uniform(mx, my, mz, random):
    """Uniform over the hemisphere of the facet."""
    draw = exact_layers.uniform
    z, turn = 2 * draw(random) - 1, 2 * np.pi * draw(random)
    ring = np.sqrt(1 - z * z)
    d = np.array([ring * np.cos(turn), ring * np.sin(turn), z])
    return tuple(d if d @ (mx, my, mz) > 0 else -d)


def _about_the_vertical(mx, my, mz, random, lambertian=exact_layers._lambertian):
    while True:
        d = np.array(lambertian(0.0, 0.0, 1.0, random))
        if d @ (mx, my, mz) > 0:
            return tuple(d)


def _inverse_into(dx, dy, dz, mx, my, mz, mu, n):
    """Into the layer as if out of it, where that is possible."""
    d, m = np.array([dx, dy, dz]), np.array([mx, my, mz])
    bent = n * (d + mu * m)
    if bent @ bent >= 1:
        return dx, dy, dz
    return tuple(bent - np.sqrt(1 - bent @ bent) * m)


def _inverse_out(dx, dy, dz, mx, my, mz, inner, mu, n):
    """Out of the layer as if into it."""
    d, m = np.array([dx, dy, dz]), np.array([mx, my, mz])
    return tuple((d - inner * m) / n + mu * m)


DEFECTS = {
    "no inner Fresnel": {"_passes_out": lambda *_: 1.0},
    "inverse index": {
        "_squared_cosine_outside": lambda inner, n: 1 - (1 - inner**2) / n**2,
        "_into": _inverse_into,
        "_out": _inverse_out,
    },
    "about the mean normal": {"_lambertian": _about_the_vertical},
    "uniform emission": {"_lambertian": _uniform},
    "no bending": {"_into": _unbent, "_out": _unbent},
}
"""Each conserves energy. No Fresnel factor from either side would keep to the invariants, too:
they hold for any interface that is reciprocal."""
FEW = {"directions": 40, "rays": 40}


@pytest.mark.parametrize("defect", [None, *DEFECTS])
def test_invariants_catch_what_conserves_energy(judge, monkeypatch, defect):
    """The same loop, not compiled, with each of five defects: all conserve energy."""
    both = pair(relief(1), relief(2, 3.0, 1.5), 40.0)
    for name, wrong in DEFECTS.get(defect, {}).items():
        monkeypatch.setattr(exact_layers, name, wrong)
    kernel = exact_layers.trace_layers.py_func
    mean, error = furnace(both, 1.5, judge.seed(12), kernel=kernel, **FEW)
    compare = judge.near if defect is None else judge.tells
    compare(mean, expected(both, 1.5), error)


@pytest.mark.parametrize("gap", [0.05, 1.0, 10.0])
@pytest.mark.parametrize("theta", [0, 60, 80])
def test_two_planes_are_one_facet_at_every_gap(judge, theta, gap):
    tally = follow(
        layers.layered_tile(flat_layers(CELLS, gap)), theta, optics(1.5), seed=judge.seed(2)
    )
    means, errors = np.transpose([albedo(tally, kd) for kd in (0.5, 0.8)])
    closed = facet.albedo(np.cos(np.radians(theta)), 1.5, np.array([0.5, 0.8]))
    judge.near(means, closed, errors)
    judge.tells(means, facet.albedo(np.cos(np.radians(theta)), 1.5, [0.6, 0.9]), errors)
    mirrored = tally.energy[0, 0].sum() / tally.light
    assert mirrored == pytest.approx(fresnel.reflectance(np.cos(np.radians(theta)), 1.5), abs=1e-12)
    # Down and up again for each substrate event: at the least twice the gap.
    assert tally.inside[LENGTH].sum() >= 2 * gap * tally.inside[SUBSTRATE_EVENTS].sum()


@pytest.mark.parametrize("name", PAIRS)
@pytest.mark.parametrize("theta", [0, 89.9])
def test_nothing_is_lost(name, theta):
    for facets in (optics(1.5), optics(1.0), optics(1.5, substrate=False), optics(2.0, True, 0.3)):
        tally = follow(layers.layered_tile(PAIRS[name], 0.01), theta, facets, count=8_000)
        whole = tally.energy.sum() + tally.ended.sum()
        assert abs(whole / tally.light - 1) <= 1e-12
        assert tally.lost.sum() == 0
        assert abs(tally.batches.sum() - tally.energy.sum()) <= 1e-12 * tally.light


@pytest.mark.parametrize("gap", [0.05, 10.0])
def test_all_light_returns_of_a_white_substrate(gap):
    tally = follow(layers.layered_tile(pair(relief(1), relief(1), gap)), 60, optics(1.5), 20_000)
    assert abs(tally.energy.sum() / tally.light - 1) <= 1e-12
    assert tally.ended.sum() == 0


def test_without_an_interface_the_substrate_is_alone(judge):
    """n = 1: the single-surface engine on the substrate, whatever lies over it."""
    below = relief(2, 3.0)
    alone = engine.tile_of("exact", Mesh(below, STRAIGHT))
    facets = optics(1.0)
    one = follow(alone, 60, facets, seed=judge.seed(3))
    weights = 0.5 ** detector.BODY_EVENTS[: one.energy.shape[1]]
    batches = one.batches.sum(1) @ weights
    single = batches.sum() / one.light
    error = np.std(batches / one.batch_light, ddof=1) / np.sqrt(len(batches))
    for above in (relief(1), relief(1, sigma=0)):
        tile = layers.layered_tile(pair(above, below, 12.0))
        mean, own = albedo(follow(tile, 60, facets, seed=judge.seed(4)), 0.5)
        judge.near(mean, single, np.hypot(own, error))
        judge.tells(mean, single + 0.02, np.hypot(own, error))


def specular(gap, below=None, seed=5):
    above = relief(1)
    tile = layers.layered_tile(pair(above, above if below is None else below, gap))
    return follow(tile, 60, optics(1.5), count=20_000, seed=seed)


def test_what_was_never_inside_is_the_same_to_the_bit():
    """Whatever the gap and the substrate, also at Kd = 0: the rough mirror."""
    one = specular(0.01).energy[:, 0]
    for other in (specular(1.0), specular(40.0), specular(20.0, relief(2))):
        np.testing.assert_array_equal(other.energy[:, 0], one)
    assert one.sum() > 0
    tile = layers.layered_tile(pair(relief(1), relief(1), 1.0))
    black = follow(tile, 60, optics(1.5, substrate=False), 10_000, seed=5)
    np.testing.assert_allclose(black.energy[:, 0] / black.light, one / 10_000, rtol=1e-12)
    mirror = engine.trace(
        engine.tile_of("exact", Mesh(relief(1), STRAIGHT)), 60, 20.0,
        optics(1.5, substrate=False), 10_000, np.random.default_rng(7),
    )  # fmt: skip
    assert mirror.energy[0, 0].sum() / mirror.light == pytest.approx(
        one[0].sum() / 10_000, rel=0.01
    )


def test_thin_layers_become_interfaced_lambertian_facets(judge):
    """Gap → 0 of the same relief: the single-surface engine; a gap of L is told apart."""
    alone = engine.tile_of("exact", Mesh(relief(1), STRAIGHT))
    one = follow(alone, 75, optics(1.5), 200_000, seed=judge.seed(6))
    weights = float(facet.body_weight(1.5, 0.3)) ** detector.BODY_EVENTS[: one.energy.shape[1]]
    batches = one.batches.sum(1) @ weights
    single = batches.sum() / one.light
    error = np.std(batches / one.batch_light, ddof=1) / np.sqrt(len(batches))
    for gap, compare in ((0.004, judge.near), (4.0, judge.tells)):
        tile = layers.layered_tile(pair(relief(1), relief(1), gap))
        mean, own = albedo(follow(tile, 75, optics(1.5), 400_000, seed=judge.seed(7)), 0.3)
        compare(mean, single, np.hypot(own, error))


def scene(**layered):
    return Scene(
        material=Material(1.5, (0.5, 0.8)),
        roughness=Roughness(8.0, (0.5,)),
        surface=Surface(cells=CELLS, correlation=4.0, realisations=2),
        light=Light((0.0, 60.0)),
        accuracy=Accuracy(20_000),
        layers=Layers(**({"gap": 1.0, "substrate": Substrate(shape="same")} | layered)),
    )


def test_a_measurement_of_two_layers(tmp_path):
    """Same bits whatever the workers and after a resume; bins weigh Kd by substrate events."""
    one, two = measure(scene(), seed=5, workers=1), measure(scene(), seed=5, workers=3)
    xr.testing.assert_identical(one.flux, two.flux)
    kept = measure(scene(), seed=5, checkpoint=tmp_path / "parts")
    again = measure(scene(), seed=5, checkpoint=tmp_path / "parts", resume=True)
    xr.testing.assert_identical(kept.length_light, again.length_light)
    xr.testing.assert_identical(one.flux, again.flux)
    assert one.attrs["engine"] == "exact"
    assert float(abs((one.arrived + one.ended.sum("cause")) / one.paths - 1).max()) <= 1e-12
    white = one.microsurf.albedo(kd=1.0)
    # Survival at Kd = 0.8 thins long paths out, and bins of many events are 25 % wide.
    np.testing.assert_allclose(white, 1, atol=5e-3)
    passed = one.passages.sum(("reflections", "entries"))
    inside = one.flux.sum(("order", "theta_o", "phi_o"))
    np.testing.assert_allclose(passed[..., 1:], inside[..., 1:], rtol=1e-9, atol=1e-15)
    first = one.passages.sel(reflections=0, entries=1).sum()
    np.testing.assert_allclose(
        first, one.flux.sel(order=1).isel(body_events=slice(1, None)).sum(), rtol=1e-9
    )


def test_any_absorption_is_answered_afterwards():
    """From the lengths of one trace; the same paths traced with absorption are inside bounds."""
    clear = measure(scene(), seed=5)
    for absorption in (0.01, 0.1, 1.0):
        traced = measure(scene(absorption=absorption), seed=5)
        answer = absorbed(clear, 1.5, 0.8, absorption)
        exact = traced.microsurf.albedo(kd=0.8)
        assert float((exact - answer.high).max()) <= 1e-12
        assert float((answer.low - exact).max()) <= 1e-12
        assert float(abs(answer.albedo - exact).max()) <= 2e-4
    none = absorbed(clear, 1.5, 0.8, 0.0)
    xr.testing.assert_allclose(none.albedo, clear.microsurf.albedo(kd=0.8))
    with pytest.raises(InputError, match="absorption = -1"):
        absorbed(clear, 1.5, 0.8, -1.0)
    alone = measure(replace(scene(), layers=None, accuracy=Accuracy(2_000, engine="exact")))
    with pytest.raises(InputError, match="not a result of a scene"):
        absorbed(alone, 1.5, 0.8, 0.1)


def test_units_do_not_matter():
    """Cells of 2⁻⁷ of another unit: the same bits."""
    small = replace(scene(), surface=replace(scene().surface, spacing=2.0**-7))
    xr.testing.assert_identical(measure(small, seed=5).flux, measure(scene(), seed=5).flux)
