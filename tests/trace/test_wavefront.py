import functools
import operator

import numpy as np
import pytest
from scipy import stats

from microsurf.physics import facet, fresnel
from microsurf.results import detector
from microsurf.trace import wavefront
from microsurf.trace.beam import light_direction, stratified_points
from microsurf.trace.embree import EmbreeTile, Hits
from microsurf.trace.grid import from_heights
from microsurf.trace.kernels import empty_space
from microsurf.trace.kernels.state import ENDS, Frame, empty_ray_batch
from microsurf.trace.plane import Plane

IL = wavefront.FacetOptics(1.5, interface=True, substrate=True, multiple_scattering=True)
MIRROR = wavefront.FacetOptics(1.5, interface=True, substrate=False, multiple_scattering=True)
LAMBERT = wavefront.FacetOptics(1.0, interface=False, substrate=True, multiple_scattering=True)


def bumps(rows=48, columns=32, slope=1.0, seed=0):
    """A periodic rough surface, nothing to do with STD."""
    rng = np.random.default_rng(seed)
    ky, kx = np.fft.fftfreq(rows)[:, None], np.fft.fftfreq(columns)[None]
    white = np.fft.fft2(rng.standard_normal((rows, columns)))
    heights = np.fft.ifft2(white * np.exp(-60 * (kx**2 + ky**2))).real
    return heights * slope / np.abs(np.diff(heights, axis=1)).mean()


def tile(heights):
    return EmbreeTile(from_heights(heights, np.zeros(heights.shape, bool)))


def follow(surface, theta, facets=IL, count=200_000, seed=1, phi=0.0):
    """Eight runs put together, each on a part of the tile."""
    parts = [
        wavefront.trace(
            surface,
            theta,
            phi,
            facets,
            count // 8,
            np.random.default_rng((seed, k)),
            part=k,
            parts=8,
        )
        for k in range(8)
    ]
    return functools.reduce(operator.add, parts)


def ends(tally):
    """Light that reached no detector, by how it ended."""
    return dict(zip(ENDS, tally.ended, strict=True))


def albedo(tally, kd, n=1.5):
    """Total albedo and the standard error of its rays."""
    weights = float(facet.body_weight(n, kd)) ** np.arange(tally.energy.shape[1])
    return share(tally, tally.batches.sum(1) @ weights)


def share(tally, of_batches):
    """Share of the light and its standard error, from what came of each batch."""
    mean = of_batches.sum() / tally.light
    rest = of_batches - mean * tally.batch_light
    count = len(rest)
    return mean, np.sqrt((rest**2).sum() * count / (count - 1)) / tally.light


@pytest.mark.parametrize("facets", [IL, MIRROR, LAMBERT])
@pytest.mark.parametrize("theta", [0, 60, 89.9])
def test_all_light_is_accounted_for(facets, theta):
    """Rounding of 4000 sums: 4000 · 2⁻⁵³ at worst, its root as a rule."""
    tally = wavefront.trace(
        tile(bumps(slope=2)), theta, 0.0, facets, 20_001, np.random.default_rng(1)
    )
    light = -(-20_001 // facets.branches)
    assert (tally.light, tally.paths) == (light, light * facets.branches)
    assert abs(tally.energy.sum() + tally.ended.sum() - light) <= 1e-12 * light
    assert abs(tally.batches.sum() - tally.energy.sum()) <= 1e-12 * light
    assert tally.batch_light.sum() == light
    assert tally.lost.sum() == 0
    assert (ends(tally)["absorbed"] > 0) == (facets is MIRROR)


@pytest.mark.parametrize("theta", [0, 30, 60, 80, 89])
@pytest.mark.parametrize("n", [1.0, 1.5, 2.4])
def test_a_flat_mesh_is_one_facet(theta, n):
    """Specular and body shares of one facet, in closed form."""
    flat = tile(np.zeros((8, 8)))
    for surface in (flat, Plane()):
        facets = wavefront.FacetOptics(n, n > 1, substrate=True, multiple_scattering=True)
        tally = follow(surface, theta, facets, count=20_000)
        assert tally.energy[1:].sum() == 0
        body = tally.energy[0, 1].sum() / tally.light
        expected = float(fresnel.transmittance(np.cos(np.radians(theta)), n))
        assert abs(body - expected) <= 1e-12  # light is split, not drawn
        mirror = tally.energy[0, 0]
        assert mirror.sum() == mirror[
            detector.ring_of(theta), detector.SECTORS // 2 if theta else 0
        ] or (theta == 0)


@pytest.mark.parametrize("n", [1.0, 1.5, 5.0])
def test_body_events_leave_as_transmission_times_cosine(n):
    """Rings of a flat facet against quadrature; a fan holds each ring's light to 1e−6 of all.

    n = 5 lies where T is not largest at normal incidence. A cosine lobe is told apart.
    """
    facets = wavefront.FacetOptics(n, n > 1, substrate=True, multiple_scattering=True)
    tally = follow(Plane(), 30, facets, count=8000)
    edges = np.cos(np.radians(detector.RING_EDGES))
    nodes, weights = np.polynomial.legendre.leggauss(20)
    middle, half = (edges[:-1] + edges[1:]) / 2, (edges[:-1] - edges[1:]) / 2
    mu = middle[:, None] + half[:, None] * nodes
    seen = tally.energy[0, 1].sum(axis=1)
    laws = [mu * (fresnel.transmittance(mu, n) if n > 1 else 1.0), mu]
    for law in laws:
        share = (law * weights).sum(axis=1) * half
        gap = np.abs(seen / seen.sum() - share / share.sum()).max()
        assert (gap < 1e-6) == (law is laws[0] or n == 1)


def test_azimuth_of_light_and_detector():
    """A sawtooth that rises along +x throws light from +x further forward, from −x back."""
    columns = 64
    heights = np.tile(np.arange(columns) * 0.25, (4, 1))  # one steep fall at the period's end
    surface = tile(heights)
    tilt = np.degrees(np.arctan(0.25))
    for phi, signed in ((0.0, 20 + 2 * tilt), (180.0, 20 - 2 * tilt)):
        # Facet normals lean towards −x, away from light that comes from +x.
        tally = follow(surface, 20, MIRROR, phi=phi, count=400_000)
        first = tally.energy[0, 0]
        ring, sector = np.unravel_index(np.argmax(first), first.shape)
        expected = detector.SECTORS // 2 if signed > 0 else 0
        assert (ring, sector) == (detector.ring_of(abs(signed)), expected), phi


def test_sectors_are_counted_from_where_is_asked():
    """Three sectors further on, the same rays."""
    surface, light = tile(bumps()), (60.0, 30.0, MIRROR, 2000)
    from_light, from_x = (
        wavefront.trace(surface, *light, np.random.default_rng(1), azimuth=azimuth)
        for azimuth in (None, 0.0)
    )
    np.testing.assert_array_equal(np.roll(from_light.energy, 3, axis=-1), from_x.energy)


def test_same_light_from_a_shifted_or_repeated_period(judge):
    """A period has no beginning: at 80° where rays wrap."""
    heights = bumps(24, 16)
    base, error = albedo(follow(tile(heights), 80, seed=judge.seed(1)), 0.8)
    for other in (np.roll(heights, (5, 7), (0, 1)), np.tile(heights, (3, 2))):
        mean, noise = albedo(follow(tile(other), 80, seed=judge.seed(2)), 0.8)
        judge.near(mean, base, np.hypot(error, noise))
    # Negative control: half the relief is told apart.
    mean, noise = albedo(follow(tile(heights / 2), 80, seed=judge.seed(3)), 0.8)
    judge.tells(mean, base, np.hypot(error, noise))


class FarSide:
    """A ridge along y whose far side is first said to be hit, at (u, v), by light from +x."""

    def __init__(self, u, v, times=1):
        heights = np.tile(-np.abs(np.arange(8) - 4.0), (8, 1))
        self.tile = tile(heights)
        self.grid = self.tile.grid
        self.answer = u, v
        self.times = times

    def intersect(self, origins, rays):
        """Give the answer as often as it was asked for, then trace."""
        if not self.times:
            return self.tile.intersect(origins, rays)
        self.times -= 1
        u, v = (np.full(len(rays), value, np.float32) for value in self.answer)
        left_of_the_ridge = 4 * self.grid.flipped.shape[1] + 3 + 1  # one column of margin
        return Hits(np.full(len(rays), 2 * left_of_the_ridge, np.int32), u, v)


def lit(surface):
    return wavefront.trace(surface, 80, 0.0, IL, 1000, np.random.default_rng(1))


def test_grazing_a_ridge_loses_nothing():
    """A ray that passes an edge is sometimes said to hit its far side: it goes on.

    Two in 1.6 million paths at 80° were lost this way.
    """
    grazing = lit(FarSide(0.5, 0.5))
    assert grazing.grazes >= grazing.light == 500
    assert grazing.energy.sum() == pytest.approx(grazing.light)


def test_a_ray_that_leaks_is_sent_again_and_lost_in_the_end():
    """Inside the triangle the same report means a leak: three times it is sent again."""
    leaking = lit(FarSide(0.3, 0.3, times=3))
    assert leaking.leaks == 3 * 500
    assert not leaking.lost.any()
    assert leaking.energy.sum() == pytest.approx(leaking.light)
    lost = lit(FarSide(0.3, 0.3, times=4))
    assert lost.lost[ENDS.index("behind")] == lost.paths == 1000
    assert ends(lost)["behind"] == pytest.approx(lost.light)


class Hole(FarSide):
    """Lets everything through, as often as asked for."""

    def intersect(self, origins, rays):
        """Find nothing."""
        hits = super().intersect(origins, rays)
        if self.times:
            hits.triangle[:] = -1
        return hits


def test_light_from_the_zenith_that_falls_through_a_vertex_is_sent_again():
    through = wavefront.trace(Hole(0, 0, times=2), 0, 0.0, IL, 1000, np.random.default_rng(1))
    assert through.leaks == 500
    assert not through.lost.any()


def test_skipping_empty_space_changes_nothing():
    """Every ray launched near the surface meets what it meets from high above."""
    heights = bumps(96, 150, slope=1.5)
    heights[10, 20] += 300  # needles that most of the space is below
    heights[70, 130] += 150
    grid = from_heights(heights, np.zeros(heights.shape, bool))
    surface = EmbreeTile(grid)
    count = 4000
    for theta, phi in ((0, 0), (60, 37), (85, 200)):
        start = stratified_points(count, np.random.default_rng(2))
        start = start * (150, 96) + (grid.x0 + 1, grid.y0 + 1)
        incident = -light_direction(theta, phi)
        found = []
        no_tops = np.full_like(grid.tops, grid.top)
        for tops in (grid.tops, no_tops):
            ray_batch = empty_ray_batch(count, 1.0)
            empty_space.launch(
                0, start, 0, count, *incident, 1, ray_batch,
                grid._replace(tops=tops), Frame(grid.x0, grid.y0, grid.top + 1e-3, grid.reach),
            )  # fmt: skip
            found.append(first_facet(surface, ray_batch.origins, incident))
        assert (found[0] == found[1]).mean() > 0.999  # float32 moves a ray near an edge


def first_facet(surface, origins, incident):
    """Facets met by rays, wrapped round the period one tile at a time in float64."""
    grid = surface.grid
    facets = np.full(len(origins), -1)
    pending = np.arange(len(origins))
    position = origins.astype(float)
    for _ in range(200):
        rays = np.tile(incident.astype(np.float32), (len(pending), 1))
        hits = surface.intersect(position[pending].astype(np.float32), rays).triangle
        cell, side = hits // 2, hits % 2
        y, x = np.divmod(cell, grid.flipped.shape[1])
        facets[pending[hits >= 0]] = (((y - 1) % 96 * 150 + (x - 1) % 150) * 2 + side)[hits >= 0]
        pending = pending[hits < 0]
        if not len(pending):
            return facets
        with np.errstate(divide="ignore", invalid="ignore"):
            low = np.array([grid.x0, grid.y0])
            high = low + np.array([152, 98])
            wall = np.where(incident[:2] > 0, high, low)
            t = np.where(incident[:2] != 0, (wall - position[pending, :2]) / incident[:2], np.inf)
        axis = np.argmin(t, axis=1)
        position[pending] += (t.min(axis=1) - 1e-4)[:, None] * incident
        position[pending, axis] -= np.sign(incident[axis]) * np.array([150, 96])[axis]
    raise AssertionError("rays that meet nothing")


def test_single_scattering_leaves_out_second_facets(judge):
    surface = tile(bumps())
    alone = wavefront.FacetOptics(1.5, interface=True, substrate=True, multiple_scattering=False)
    whole = follow(surface, 60, seed=judge.seed(1))
    single = follow(surface, 60, alone, seed=judge.seed(2))
    assert single.energy[1:].sum() == 0
    left = ends(single)["left out"] / single.light
    more, error = share(whole, whole.batches[:, 1:].sum((1, 2)))
    # What is left out of light is known as well as what is met again.
    judge.near(left, more, np.sqrt(2) * error)
    judge.tells(left, 1.03 * more, np.sqrt(2) * error)  # negative control
    assert single.rays < whole.rays


def test_tallies_add_up():
    surface = tile(bumps())
    a, b = (
        wavefront.trace(surface, 30, 0.0, IL, count, np.random.default_rng(1))
        for count in (3, 50_000)
    )
    total = a + b
    assert (a.light, b.light) == (2, 25_000)
    assert total.paths == 50_004
    assert total.rays == a.rays + b.rays
    assert total.energy.sum() == pytest.approx(a.energy.sum() + b.energy.sum(), rel=1e-14)
    assert total.batch_light.sum() == total.light


def test_batches_know_the_error_of_a_sum(judge):
    """Against the spread of 40 runs, each of four parts, as squares of errors of as many runs.

    Batches don't know of each other's strata: at worst they say what they would if light fell
    at random, up to twice the variance. Negative control: a quarter and four times the error.
    """
    surface = tile(bumps())
    runs = [
        functools.reduce(
            operator.add,
            (
                wavefront.trace(
                    surface,
                    60,
                    0.0,
                    IL,
                    1000,
                    np.random.default_rng((judge.seed(0), k, p)),
                    part=p,
                    parts=4,
                )
                for p in range(4)
            ),
        )
        for k in range(40)
    ]
    found = [albedo(run, 0.8) for run in runs]
    spread = np.var([mean for mean, _ in found], ddof=1)
    claimed = np.mean([error**2 for _, error in found])

    def p_value(factor):
        """Of a variance claimed ``factor`` times; the claim has more freedom than one run's."""
        ratio, dof = spread / (factor * claimed), (39, 40 * (len(runs[0].batches) - 1))
        return min(2 * stats.f.sf(ratio, *dof), 2 * stats.f.cdf(2 * ratio, *dof), 1)

    judge.keeps(p_value(1))
    judge.catches(p_value(1 / 16))
    judge.catches(p_value(16))


@pytest.mark.parametrize("cells", [(2, 2), (2, 5)])
def test_smallest_meshes(cells):
    heights = np.zeros(cells)
    heights[0, 0] = 3.0
    tally = follow(tile(heights), 80, count=10_000)
    assert tally.energy.sum() == pytest.approx(tally.light, rel=1e-12)
