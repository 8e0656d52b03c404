import numpy as np
import pytest
from scipy import stats

from microsurf.surface import Heightfield, Mesh, facet_slopes, mesh
from microsurf.trace import engine, visibility, wavefront
from microsurf.trace.beam import light_direction
from microsurf.trace.embree import Hits
from microsurf.trace.grid import triangles
from microsurf.trace.kernels.state import BATCHES

EDGES = np.array([0.0, 0.5, 1.0, 2.0, np.inf])


def bumps(rows=48, columns=32, seed=0):
    """A periodic rough surface, nothing to do with STD."""
    rng = np.random.default_rng(seed)
    ky, kx = np.fft.fftfreq(rows)[:, None], np.fft.fftfreq(columns)[None]
    white = np.fft.fft2(rng.standard_normal((rows, columns)))
    heights = np.fft.ifft2(white * np.exp(-60 * (kx**2 + ky**2))).real
    return heights / np.abs(np.diff(heights, axis=1)).mean()


def made(heights, edges=EDGES, name="embree"):
    """Tile and facets of one period."""
    tile = engine.tile_of(name, Mesh(heights, np.zeros(heights.shape, bool), 1.0))
    return tile, visibility.facets_of(tile, 1.0, 1.0, edges)


def see(tile, facets, theta, phi=0.0, rays=64_000, seed=1, n=1.5):
    rng = np.random.default_rng(seed)
    return visibility.visibility(tile, facets, theta, phi, rays, rng, n=n)


def binomial(part, rays):
    """Standard error of a part of so many rays: stratified ones spread less."""
    return np.sqrt(np.maximum(part * (1 - part), 1 / rays) / rays)


def vcavity(steepness):
    """Grooves along y, four cells of each slope: V-cavities."""
    profile = steepness * np.array([0, 1, 2, 3, 4, 3, 2, 1.0])
    return np.tile(profile, (16, 2))


def cavity(theta, slope, towards):
    """Masking of one side of a V-cavity (Torrance and Sparrow), and shadowing in its mirror pair.

    ``towards`` 1: the side that faces light from +x, −1: the other.
    """
    tilt = towards * np.arctan(slope)
    i, o = np.radians(theta), 2 * tilt - np.radians(theta)
    facing = max(np.cos(i - tilt), 0.0)
    seen = min(1.0, 2 * np.cos(tilt) * np.cos(i) / facing) if facing else 0.0
    shadow = max(2 * np.cos(tilt) * np.cos(o), 0.0)
    both = min(seen, shadow / facing) if facing and abs(o) < np.pi / 2 else 0.0
    weight = facing / np.cos(tilt) / np.cos(i) / 2
    return weight, weight * seen, weight * both


@pytest.mark.parametrize("name", ["exact", "embree"])
@pytest.mark.parametrize(
    ("theta", "slope"), [(0, 0.5), (10, 0.7), (40, 0.7), (60, 1.0), (80, 0.3), (80, 2.0)]
)
def test_v_cavities_have_their_closed_form(theta, slope, name, judge):
    edges = np.array([0.0, slope / 2, 2 * slope, np.inf])
    found = see(*made(vcavity(slope), edges, name), theta, seed=judge.seed(theta))
    facing, met, both = np.sum([cavity(theta, slope, s) for s in (1, -1)], axis=0)
    assert found.facing == pytest.approx([0, facing, 0], abs=1e-6)
    assert met == pytest.approx(1)  # the identity holds for the formula, too
    assert found.met[:, 1] == pytest.approx(np.ones(BATCHES))
    judge.near(found.open.mean(axis=0)[1], both, binomial(both, 64_000))


def test_flat_is_all_seen():
    found = see(*made(np.zeros((8, 8))), 75.0)
    for values in (found.met, found.open):
        assert values[:, 0] == pytest.approx(np.ones(BATCHES))
        assert not values[:, 1:].any()
    assert found.facing == pytest.approx([1, 0, 0, 0])
    assert found.lost == 0


@pytest.mark.parametrize("theta", [0.0, 45.0, 75.0, 85.0])
def test_every_ray_meets_a_facet_and_none_more_than_all(theta, judge):
    """Σ facing G1 = 1: here by construction, lost rays would break it; and each G1 ≤ 1."""
    found = see(*made(bumps()), theta, 30.0, seed=judge.seed(2))
    assert found.lost == 0
    assert found.met.sum(axis=1) == pytest.approx(np.ones(BATCHES))
    seen = found.met.mean(axis=0)
    z = (seen - found.facing) / binomial(seen, 64_000)
    if theta == 0:
        judge.near(seen, found.facing, binomial(seen, 64_000))
    else:
        judge.keeps(stats.norm.sf(z))
        judge.tells(seen, found.facing, binomial(seen, 64_000))
    assert np.all(found.open <= found.met)


def blocked(origins, directions, tile, facet_of_origin, periods):
    """Whether rays meet any triangle so many periods around, by Möller and Trumbore in float64.

    Facet ``facet_of_origin`` of the middle period is the ray's own and left out.
    """
    grid = tile.grid
    vertices, index = triangles(grid)
    inner = np.arange(len(index)).reshape(grid.rows + 2, grid.columns + 2, 2)[1:-1, 1:-1].ravel()
    corners = vertices[index[inner]].astype(float)
    first, e1, e2 = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    across = np.cross(directions[:, None], e2)
    det = np.sum(e1 * across, axis=-1)
    own = np.arange(len(inner)) == facet_of_origin[:, None]
    hit = np.zeros(len(origins), bool)
    for sy in range(-periods, periods + 1):
        for sx in range(-periods, periods + 1):
            start = origins[:, None] - first - np.array([sx * grid.columns, sy * grid.rows, 0.0])
            u = np.sum(start * across, axis=-1) / det
            turned = np.cross(start, e1)
            v = np.sum(directions[:, None] * turned, axis=-1) / det
            t = np.sum(e2 * turned, axis=-1) / det
            met = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
            hit |= np.any(met & ~(own & (sx == sy == 0)), axis=1)
    return hit


def brute(tile, facets, theta, phi, points, rng):
    """Facing, met and open light by bins from random points of all facets, and their errors."""
    grid = tile.grid
    number = rng.integers(0, len(facets.p), points)
    vertices, index = triangles(grid)
    inner = np.arange(len(index)).reshape(grid.rows + 2, grid.columns + 2, 2)[1:-1, 1:-1].ravel()
    corners = vertices[index[inner[number]]].astype(float)
    origins = np.einsum("kc,kcx->kx", rng.dirichlet(np.ones(3), points), corners)
    i = light_direction(theta, phi)
    m = np.stack([-facets.p[number], -facets.q[number], np.ones(points)], axis=-1)
    slant = m @ i
    o = 2 * slant[:, None] * m / np.sum(m * m, axis=1, keepdims=True) - i
    weight = np.maximum(slant, 0) / i[2]
    seen = weight * ~blocked(origins, np.broadcast_to(i, o.shape), tile, number, 4)
    up = o[:, 2] > 0
    both = seen * (up & ~blocked(origins, o, tile, number, 8))
    by_bin = facets.bin[number] == np.arange(facets.bins)[:, None]
    values = np.stack([seen, both])[:, None] * by_bin
    return values.mean(axis=-1), values.std(axis=-1) / np.sqrt(points)


class Sunk:
    """A tile under which rays start a little too low: shadow rays meet their own facet."""

    engine = "embree"

    def __init__(self, tile):
        self.grid, self._tile = tile.grid, tile

    def intersect(self, origins, directions):  # noqa: D102 - as any tile
        low = (origins - np.float32([0, 0, 1e-3])).astype(np.float32)
        return self._tile.intersect(low, directions)


class Wrong:
    """A tile that names the other side of the cell that was hit."""

    engine = "embree"

    def __init__(self, tile):
        self.grid, self._tile = tile.grid, tile

    def intersect(self, origins, directions):  # noqa: D102 - as any tile
        hits = self._tile.intersect(origins, directions)
        return Hits(np.where(hits.triangle >= 0, hits.triangle ^ 1, -1), hits.u, hits.v)


def test_as_points_of_facets_see_it(judge):
    """Area sampling in float64 against the beam; both defects are caught by it."""
    heights = 1.2 * np.random.default_rng(3).standard_normal((4, 4))
    tile, facets = made(heights)
    expected, error = brute(tile, facets, 65.0, 20.0, 4_000, np.random.default_rng(judge.seed(4)))

    def compared(found):
        values = np.stack([found.met.mean(axis=0), found.open.mean(axis=0)])
        return values, expected, np.hypot(error, binomial(values, 64_000)) + 1e-9

    judge.near(*compared(see(tile, facets, 65.0, 20.0, seed=judge.seed(5))))
    exact, _ = made(heights, name="exact")
    judge.near(*compared(see(exact, facets, 65.0, 20.0, seed=judge.seed(8))))
    judge.tells(*compared(see(Sunk(tile), facets, 65.0, 20.0)))
    judge.tells(*compared(see(Wrong(tile), facets, 65.0, 20.0)))


@pytest.mark.parametrize("theta", [20.0, 70.0])
def test_specular_is_that_of_the_tracer(theta, judge):
    tile, facets = made(bumps())
    found = see(tile, facets, theta, 10.0, seed=judge.seed(6))
    facet = wavefront.FacetOptics(1.5, interface=True, substrate=False, multiple_scattering=False)
    traced = wavefront.trace(tile, theta, 10.0, facet, 64_000, np.random.default_rng(judge.seed(7)))
    ours = found.specular.sum(axis=1)
    theirs = traced.batches[:, 0].sum(axis=1) / traced.batch_light
    error = np.hypot(ours.std(ddof=1), theirs.std(ddof=1)) / np.sqrt(BATCHES)
    z = (ours.mean() - theirs.mean()) / error
    judge.keeps(2 * stats.t.sf(abs(z), BATCHES - 1))


@pytest.mark.parametrize("name", ["exact", "embree"])
@pytest.mark.parametrize("boundary", ["periodic", "mirror"])
def test_facets_are_those_of_the_surface(boundary, name):
    """In number, bin and slope; a mirrored surface has each facet and its three images."""
    surface = Heightfield(bumps().astype(np.float32), boundary=boundary)
    tile = engine.tile_of(name, mesh(surface))
    found = visibility.facets_of(tile, 0.7, 0.4, EDGES)
    p, q = facet_slopes(surface)
    images = len(found.p) // p.size
    for mine, theirs in ((found.p, p), (found.q, q)):
        expected = np.sort(np.repeat(np.abs(theirs).ravel(), images))
        assert np.sort(np.abs(mine)) == pytest.approx(expected, abs=1e-5)
    rho = np.hypot(found.p / 0.7, found.q / 0.4)
    assert np.all((EDGES[found.bin] <= rho) & (rho < EDGES[found.bin + 1]))


@pytest.mark.parametrize(
    ("sigma", "edges"), [(0.0, [0, np.inf]), (1.0, [0, 1]), (1.0, [0, 2, 1, np.inf])]
)
def test_bins_that_are_none(sigma, edges):
    tile = engine.tile_of("exact", Mesh(bumps(), np.zeros((48, 32), bool), 1.0))
    with pytest.raises(ValueError, match=r"must ascend|sigma > 0"):
        visibility.facets_of(tile, sigma, 1.0, np.array(edges, float))


def test_each_batch_has_a_ray():
    surface = made(bumps())
    assert see(*surface, 30.0, rays=BATCHES).met.sum(axis=1) == pytest.approx(np.ones(BATCHES))
    with pytest.raises(ValueError, match="one for each batch"):
        see(*surface, 30.0, rays=BATCHES - 1)
