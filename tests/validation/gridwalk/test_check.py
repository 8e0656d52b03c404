"""The float64 walk against exact rational arithmetic, and Embree against the walk."""

from fractions import Fraction

import numpy as np
import pytest

from microsurf.trace import wavefront
from microsurf.trace.embree import EmbreeTile
from microsurf.trace.grid import from_heights, triangles
from validation.gridwalk import check
from validation.gridwalk.agreement import BOUND, facet_discrepancy
from validation.gridwalk.walk import GridWalk

HOSTILE = check.hostile()


def small(scale=1.0, seed=0):
    """Five by four cells, diagonals at random, heights of few bits: much meets exactly."""
    rng = np.random.default_rng(seed)
    heights = np.round(4 * rng.standard_normal((5, 4))) / 4 * scale
    return from_heights(heights, rng.random(heights.shape) < 0.5)


def exact(grid, origin, direction):
    """First t ≥ 0 by rational arithmetic over all triangles, and all those met there.

    The products of the ray with the three edges decide, boundaries included; a triangle
    that the ray lies in is left out, as its neighbours are met where the ray enters it.
    """
    vertices, faces = triangles(grid)
    corner = whole(vertices)[faces] - whole(origin)
    d = whole(direction)
    a, b, c = corner[:, 0], corner[:, 1], corner[:, 2]
    normal = cross(b - a, c - a)
    facing, plane = (normal * d).sum(axis=1), (normal * a).sum(axis=1)
    volumes = np.stack([(cross(p, q) * d).sum(axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=1)
    signs = np.where(facing < 0, -1, 1)
    met = (volumes * signs[:, None] >= 0).all(axis=1) & (facing != 0) & (plane * signs >= 0)
    t = {int(k): Fraction(plane[k], facing[k]) for k in np.flatnonzero(met)}
    first = min(t.values(), default=np.inf)
    return float(first), {k for k, value in t.items() if value == first}


def whole(values):
    """Floats in units of 2⁻⁸⁰ as Python's integers, which lose nothing."""
    as_integers = np.vectorize(lambda x: int(Fraction(float(x)) * 2**80), otypes=[object])
    assert (np.asarray(values, float) * 2.0**80 % 1 == 0).all()
    return as_integers(values)


def cross(p, q):
    return np.roll(np.roll(p, -1, 1) * np.roll(q, -2, 1) - np.roll(p, -2, 1) * np.roll(q, -1, 1), 0)


def rays(grid, kind, count=300):
    rng = np.random.default_rng(7)
    origins = np.column_stack(
        [rng.uniform(-5, 5, (count, 2)), rng.uniform(grid.bottom - 1, grid.top + 3, count)]
    )
    directions = rng.standard_normal((count, 3))
    if kind == "aimed":
        origins, directions = check.aimed(grid, count, rng)
    elif kind == "vertical":
        origins, directions = check.vertical(grid, count, rng)
    elif kind == "upward":
        origins, directions = check.vertical(grid, count, rng)
        origins[:, 2], directions[:, 2] = grid.bottom - 1, 1
    elif kind == "along x":
        origins[:, 1] = np.round(origins[:, 1] * 2) / 2  # half of them on the grid's lines
        directions[:, 1] = 0
    elif kind == "along y":
        directions[:, 0] = 0
    elif kind == "along the diagonal":
        origins[:, 1] = origins[:, 0]
        directions[:, 1] = directions[:, 0]
    elif kind == "horizontal":
        origins[:, 2] = rng.uniform(grid.bottom, grid.top, count)
        directions[:, 2] = 0
    return origins.astype(np.float32), directions.astype(np.float32)


KINDS = (
    "any", "aimed", "vertical", "upward", "along x", "along y", "along the diagonal", "horizontal",
)  # fmt: skip


@pytest.mark.parametrize("scale", [1.0, 1024.0])
@pytest.mark.parametrize("kind", KINDS)
def test_the_walk_finds_what_exact_arithmetic_finds(kind, scale):
    """To 1e−12 of the coordinates; a touch of that size may go either way."""
    grid = small(scale)
    origins, directions = (array.astype(float) for array in rays(grid, kind))
    found = GridWalk(grid).first_hits(origins, directions)
    reach = max(grid.reach, 10)
    hits = touches = 0
    for r, (o, d) in enumerate(zip(origins, directions, strict=True)):
        t, facets = exact(grid, o, d)
        hits += bool(facets)
        if found.triangle[r] in facets or (not facets and found.triangle[r] < 0):
            near = 1e-12 * reach / np.linalg.norm(d)
            assert not facets or abs(found.t[r] - t) <= near * steepness(grid, d, facets)
            continue
        # Another facet than any of the exact ones: only by a touch.
        touches += 1
        one = np.array([min(facets, default=-1)], np.int32)
        units, _ = facet_discrepancy(grid, (o[None], d[None]), found.triangle[r : r + 1], one)
        assert units[0] * 2.0**-23 < 1e-12, (o, d, facets, found.triangle[r])
    assert hits > 20
    assert touches <= (5 if kind == "aimed" else 0)


def steepness(grid, direction, facets):
    """1/|cosθ| of the facet that is met most at grazing: by that an error of height grows."""
    vertices, faces = triangles(grid)
    a, b, c = (vertices[faces[sorted(facets), k]].astype(float) for k in range(3))
    normal = np.cross(b - a, c - a)
    cosine = normal @ direction / np.linalg.norm(normal, axis=1) / np.linalg.norm(direction)
    return 1 / np.abs(cosine).min()


@pytest.mark.parametrize("name", HOSTILE)
def test_nothing_falls_through(name):
    """Rays from above everything that end below everything inside the tile: all meet it."""
    grid = HOSTILE[name]
    rng = np.random.default_rng(8)
    vertices, faces = triangles(grid)
    count = 50_000
    start = vertices[rng.choice(len(vertices), count)].astype(float)
    target = vertices[faces[rng.choice(len(faces), count), 0]].astype(float)
    start[:, 2], target[:, 2] = grid.top + 1, grid.bottom - 1
    found = GridWalk(grid).first_hits(start, target - start)
    assert (found.triangle >= 0).all()
    assert ((found.t >= 0) & (found.t <= 1)).all()


def test_weights_and_t_say_the_same_point():
    grid = HOSTILE["slopes of 1e3"]
    origins, directions = check.aimed(grid, 20_000, np.random.default_rng(9))
    origins, directions = origins.astype(float), directions.astype(float)
    found = GridWalk(grid).first_hits(origins, directions)
    hit = found.triangle >= 0
    vertices, faces = triangles(grid)
    a, b, c = (vertices[faces[found.triangle[hit], k]].astype(float) for k in range(3))
    u, v = found.u[hit, None], found.v[hit, None]
    assert min(u.min(), v.min(), (1 - u - v).min()) > -1e-12
    point = (a + u * (b - a) + v * (c - a))[:, :2]
    along = (origins + found.t[:, None] * directions)[hit, :2]
    assert np.abs(point - along).max() < 1e-11


def test_the_back_of_a_facet_is_met_from_below_as_by_embree():
    grid = small()
    origins, directions = rays(grid, "any", 5000)
    origins[:, 2] = grid.bottom - 1
    directions[:, 2] = np.abs(directions[:, 2])
    walked, seen = (t(grid).intersect(origins, directions) for t in (GridWalk, EmbreeTile))
    assert (walked.triangle >= 0).sum() > 500
    assert (walked.triangle == seen.triangle).all()


def test_float64_rays_stay_so():
    """10⁻⁹ cells beside a diagonal: float64 knows the side, float32 does not."""
    grid = from_heights(np.zeros((4, 4)), np.zeros((4, 4), bool))
    origins = np.array([[0.3, 0.3 + side * 1e-9, 1] for side in (-1, 1)])
    down = np.tile([0.0, 0, -1], (2, 1))
    beside = GridWalk(grid).first_hits(origins, down).triangle
    assert beside[1] == beside[0] + 1
    assert len(set(GridWalk(grid).first_hits(origins.astype(np.float32), down).triangle)) == 1


def test_discrepancy_is_the_distance_that_float32_must_have_erred():
    """A level facet missed by 1 mm of a cell: as long at normal incidence, 1/cosθ at 60°."""
    grid = from_heights(np.zeros((4, 4)), np.zeros((4, 4), bool))
    cell = 2 * (2 * 6 + 2)  # from −1 to 0 in both; its diagonal is the edge y = x
    for tilt in (0.0, 60.0):
        slope = np.tan(np.radians(tilt)) / np.sqrt(2)
        direction = np.array([[slope, -slope, -1.0]])
        point = np.array([-0.5, -0.5 - 1e-3 * np.sqrt(2), 0.0])
        both = np.array([cell], np.int32), np.array([cell + 1], np.int32)
        units, cells = facet_discrepancy(grid, (point - direction, direction), both[1], both[0])
        farthest = np.linalg.norm(grid_corners(grid, cell + 1) - (point - direction), axis=1).max()
        assert cells[0] == pytest.approx(1e-3, rel=1e-9)
        passing = 1e-3 * np.cos(np.radians(tilt))
        assert units[0] == pytest.approx(passing / farthest * 2**23, rel=0.3)
        # The other way round float64 itself would be wrong.
        assert facet_discrepancy(grid, (point - direction, direction), *both)[0][0] == np.inf


def grid_corners(grid, number):
    vertices, faces = triangles(grid)
    return vertices[faces[number]].astype(float)


@pytest.mark.parametrize("name", [*HOSTILE, "ordinary"])
def test_embree_names_another_facet_only_within_rounding_of_an_edge(name):
    """The bound is derived in `agreement`; a hundredth of it, or another surface, must fail."""
    grid = HOSTILE.get(name) or check.ordinary(2.0, 0.3, 128)
    embree = EmbreeTile(grid)
    row = check.compare(grid, embree, check.traced(embree, 80, 300))
    assert max(row["worst_facet_units"], row["worst_weight_units"]) <= BOUND
    aimed = check.aimed(grid, 20_000, np.random.default_rng(10))
    row = check.compare(grid, embree, aimed)
    assert row["facets_differ"] > 1000
    assert max(row["worst_facet_units"], row["worst_weight_units"]) <= BOUND
    assert row["worst_facet_units"] > BOUND / 100
    off = EmbreeTile(check.raised(grid))
    if name == "ordinary":
        assert check.compare(grid, off, aimed)["worst_facet_units"] > BOUND


def test_paths_on_either_engine_are_the_same_paths():
    """Bit for bit where no ray differs; raised by a cell here and there they are not."""
    grid = check.ordinary(8.0, 0.7, 64)
    tiles = {"embree": EmbreeTile(grid), "float64": GridWalk(grid)}
    row = check.paired(tiles, 60.0, 800, 16)
    assert row["calls_that_differ"] <= 1
    tiles["float64"] = GridWalk(check.raised(grid, 1.0))
    assert check.paired(tiles, 60.0, 800, 16)["calls_that_differ"] > 10


@pytest.mark.parametrize("name", HOSTILE)
def test_no_path_is_lost_on_either_engine(name):
    for tile in (EmbreeTile(HOSTILE[name]), GridWalk(HOSTILE[name])):
        tally = wavefront.trace(tile, 80, 0, check.IL, 150, np.random.default_rng(11))
        assert tally.lost[2:].sum() == 0
