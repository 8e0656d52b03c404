"""Cells that are longer along one axis, in both engines, against geometry that knows no cells."""

import functools
import operator

import numpy as np
import pytest

from microsurf.errors import InputError
from microsurf.physics.fresnel import reflectance
from microsurf.scene import Accuracy, Light, Material, Scene, Surface
from microsurf.surface import Heightfield, Mesh, generate_surface, mesh, surface_of, write_surface
from microsurf.surface.heightfield import MAX_ASPECT
from microsurf.surface.mesh_io import triangles
from microsurf.trace import engine, measure, visibility
from microsurf.trace.embree import EmbreeTile
from microsurf.trace.exact import exact_tile
from microsurf.trace.kernels.exact_first_hits import first_facets
from microsurf.trace.wavefront import FacetOptics

ENGINES = ("exact", "embree")
IL = FacetOptics(1.5, interface=True, substrate=True, multiple_scattering=True)
MIRROR = FacetOptics(1.5, interface=True, substrate=False, multiple_scattering=True)


def follow(tile, theta, phi, facets, paths, seed):
    parts = [
        engine.trace(
            tile, theta, phi, facets, paths // 8, np.random.default_rng((seed, k)), part=k, parts=8
        )
        for k in range(8)
    ]
    return functools.reduce(operator.add, parts)


def albedos(tally):
    """Of orders 1 … 4, specular and of one body event or more, and their standard errors."""
    light = np.stack([tally.batches[:, :, 0], tally.batches[:, :, 1:].sum(2)], axis=2)
    light = light.reshape(len(light), -1)
    mean = light.sum(0) / tally.light
    rest = light - mean * tally.batch_light[:, None]
    return mean, np.sqrt((rest**2).sum(0) * len(rest) / (len(rest) - 1)) / tally.light


def oblong(pixel, seed=3):
    """Slopes that are isotropic over cells that are not: made on square ones, then stretched."""
    made = generate_surface(2.0, 0.6 * pixel[0], 0.6 * pixel[1], cells=64, seed=seed)
    return Heightfield(made.heights, pixel)


def first_triangle(h, origins, directions):
    """The first triangle of nine periods that each ray meets, by Möller and Trumbore in float64."""
    vertices, faces = triangles(h)
    corners = vertices[faces]
    first, e1, e2 = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    across = np.cross(directions[:, None], e2)
    det = np.sum(e1 * across, axis=-1)
    best, where = np.full(len(origins), np.inf), np.full(len(origins), -1)
    rows, columns = h.heights.shape
    period = np.array([columns * h.pixel[0], rows * h.pixel[1], 0])
    for sx in range(-4, 5):
        for sy in range(-4, 5):
            start = origins[:, None] - first - period * [sx, sy, 0]
            u = np.sum(start * across, axis=-1) / det
            turned = np.cross(start, e1)
            v = np.sum(directions[:, None] * turned, axis=-1) / det
            t = np.sum(e2 * turned, axis=-1) / det
            t = np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0), t, np.inf)
            nearest = t.argmin(axis=1)
            closer = t[np.arange(len(t)), nearest] < best
            best = np.where(closer, t[np.arange(len(t)), nearest], best)
            where = np.where(closer, nearest, where)
    return where, best


@pytest.mark.parametrize("pixel", [(2.0, 1.0), (0.3, 0.45), (1.0, 40.0)])
def test_rays_meet_the_triangle_that_they_meet_in_space(pixel):
    """Facets and points; negative control: the same heights on square cells."""
    h = Heightfield(np.random.default_rng(1).standard_normal((9, 12)) * pixel[0], pixel)
    rng = np.random.default_rng(2)
    count = 400
    turn, theta = rng.uniform(0, 2 * np.pi, count), rng.uniform(0, np.radians(60), count)
    directions = np.stack(
        [np.sin(theta) * np.cos(turn), np.sin(theta) * np.sin(turn), -np.cos(theta)], axis=1
    )
    extent = np.array([12 * pixel[0], 9 * pixel[1]])
    origins = np.column_stack([rng.random((count, 2)) * extent, np.full(count, h.heights.max())])
    true, t = first_triangle(h, origins, directions)
    assert (true >= 0).all()
    cells = 9 * 12
    expected = 2 * (true % cells) + true // cells  # lower triangles come first there
    made = mesh(h)
    in_cells = np.column_stack(
        [origins[:, :2] / pixel, np.full(count, made.heights.astype(np.float32).max())]
    )
    found = []
    for aspect in (made.aspect, 1.0):
        tile = exact_tile(made.heights, made.flipped, aspect)
        facet, point = np.empty(count, np.int64), np.empty((count, 3))
        first_facets(tile, in_cells, directions, facet, point)
        found.append((facet, point))
    (facet, point), (square, _) = found
    # Heights are float32 in the walk: a ray within 1e-6 of an edge may meet its neighbour.
    assert np.count_nonzero(facet != expected) <= 1
    same = facet == expected
    place = (origins + t[:, None] * directions)[same, :2] / pixel % [12, 9]
    gap = np.abs(point[same, :2] - place)
    assert np.minimum(gap, [12, 9] - gap).max() < 1e-4
    assert np.mean(square != expected) > 0.05


def groove(slope, pixel, axis):
    """V-grooves of four cells a side, of that slope across them."""
    profile = slope * pixel[axis] * np.array([0, 1, 2, 3, 4, 3, 2, 1.0])
    heights = np.tile(profile, (16, 2))
    return Heightfield(heights if axis == 0 else heights.T, pixel)


def mirrored(theta, slope, n):
    """Light that one mirror event sends up for good, of V-cavities (Torrance and Sparrow 1967)."""
    i = np.radians(theta)
    total = 0.0
    for tilt in (np.arctan(slope), -np.arctan(slope)):
        facing = max(np.cos(i - tilt), 0.0)
        o = 2 * tilt - i
        if facing == 0 or abs(o) >= np.pi / 2:
            continue
        seen = min(1.0, 2 * np.cos(tilt) * np.cos(i) / facing)
        both = min(seen, 2 * np.cos(tilt) * np.cos(o) / facing)
        total += facing / np.cos(tilt) / np.cos(i) / 2 * both * float(reflectance(facing, n))
    return total


@pytest.mark.parametrize("name", ENGINES)
@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize(("theta", "slope"), [(20, 0.5), (60, 1.0), (75, 0.3)])
def test_grooves_have_their_closed_form(name, axis, theta, slope, judge):
    """Along x and along y on cells twice as wide as deep; negative control: square cells."""
    period = mesh(groove(slope, (2.0, 1.0), axis))
    expected = mirrored(theta, slope, 1.5)
    error = np.sqrt(expected * (1 - expected) / 64_000)  # stratified rays spread less
    seen = [
        follow(engine.tile_of(name, tile), theta, 90.0 * axis, MIRROR, 64_000, judge.seed(axis))
        for tile in (period, Mesh(period.heights, period.flipped))
    ]
    shares = [tally.energy[0, 0].sum() / tally.light for tally in seen]
    judge.near(shares[0], expected, error)
    if axis == 1 and theta == 75:  # near the zenith every slope mirrors 4 % away
        judge.tells(shares[1], expected, error)


def test_both_engines_measure_the_same(judge):
    """By order and kind; negative control: square cells."""
    period = mesh(oblong((2.0, 1.0)))
    tiles = [engine.tile_of(name, period) for name in ENGINES]
    tiles.append(engine.tile_of("exact", Mesh(period.heights, period.flipped)))
    (a, da), (b, db), (c, dc) = (
        albedos(follow(tile, 60, 20.0, IL, 200_000, judge.seed(k))) for k, tile in enumerate(tiles)
    )
    seen = (a > 1e-4) & (b > 1e-4)
    judge.near(a[seen], b[seen], np.hypot(da, db)[seen])
    judge.tells(c[seen], b[seen], np.hypot(dc, db)[seen])


@pytest.mark.parametrize("name", ENGINES)
def test_a_surface_seen_in_a_mirror_is_the_same(name, judge):
    """x and y exchanged, light from 90° − φ; negative control: light from φ."""
    made = generate_surface(2.0, 0.3, 1.2, cells=64, seed=3)
    one = Heightfield(made.heights, (2.0, 1.0))
    other = Heightfield(made.heights.T, (1.0, 2.0))
    (a, da), (b, db), (c, dc) = (
        albedos(follow(engine.tile_of(name, mesh(h)), 60, phi, IL, 200_000, judge.seed(k)))
        for k, (h, phi) in enumerate(((one, 20.0), (other, 70.0), (other, 20.0)))
    )
    seen = (a > 1e-4) & (b > 1e-4)
    judge.near(a[seen], b[seen], np.hypot(da, db)[seen])
    judge.tells(c[seen], b[seen], np.hypot(dc, db)[seen])


def test_slopes_of_the_traced_mesh_are_those_of_the_surface():
    period = mesh(oblong((2.0, 1.0)))
    tile = engine.tile_of("embree", period)
    seen = visibility.facets_of(tile, 1.0, 1.0, np.array([0, 1, np.inf]))
    made = generate_surface(2.0, 1.2, 0.6, cells=64, seed=3)
    square = mesh(made)
    square_tile = engine.tile_of("embree", square)
    made_seen = visibility.facets_of(square_tile, 1.0, 1.0, np.array([0, 1, np.inf]))
    np.testing.assert_allclose(seen.p, made_seen.p / 2, atol=2e-5)
    np.testing.assert_allclose(seen.q, made_seen.q, atol=2e-5)
    tile = EmbreeTile(square_tile.grid._replace(aspect=period.aspect))
    found = visibility.visibility(tile, seen, 75.0, 30.0, 32_000, np.random.default_rng(1))
    assert found.met.sum(axis=1) == pytest.approx(np.ones(len(found.met)))


@pytest.mark.parametrize("ending", [".npz", ".ply", ".x3p"])
def test_files_of_oblong_pixels_are_measured(ending, tmp_path):
    h = Heightfield(oblong((2.0, 1.0)).heights, (2.0, 1.0), "mirror")
    path = tmp_path / f"s{ending}"
    write_surface(h, path)
    scene = Scene(
        material=Material(1.5, (0.8,)),
        surface=Surface(file=str(path)),
        light=Light((60.0,)),
        accuracy=Accuracy(paths=2_000),
    )
    read = surface_of(scene, 0, 0)
    assert read.pixel == pytest.approx((2.0, 1.0), rel=1e-12)
    measured = measure(scene, seed=1, workers=1)
    direct = measure(scene, [h], seed=1, workers=1)
    np.testing.assert_allclose(measured.flux.values, direct.flux.values, rtol=1e-4, atol=1e-4)
    assert float(measured.arrived.sum()) > 0


def test_cells_a_thousand_times_as_long_are_traced_and_longer_ones_refused(judge):
    heights = oblong((1.0, 1.0)).heights
    period = mesh(Heightfield(heights, (1.0, MAX_ASPECT)))
    (a, da), (b, db) = (
        albedos(follow(engine.tile_of(name, period), 60, 20.0, IL, 100_000, judge.seed(k)))
        for k, name in enumerate(ENGINES)
    )
    seen = (a > 1e-4) & (b > 1e-4)
    judge.near(a[seen], b[seen], np.hypot(da, db)[seen])
    with pytest.raises(InputError, match=r"a pixel of 1 × 1001: rays take sides up to 1000 times"):
        mesh(Heightfield(heights, (1.0, 1001.0)))
