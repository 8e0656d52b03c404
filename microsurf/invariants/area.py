"""Projected area: what facets show to a direction is what falls on the mean plane."""

from collections.abc import Iterable
from concurrent.futures import Executor

import numpy as np
from numpy.typing import NDArray

from ..physics import smith
from ..surface import Heightfield, facet_slopes, generate_surface, mesh
from ..trace.beam import light_direction, stratified_points
from ..trace.embree import EmbreeTile
from ..trace.grid import MARGIN, Grid, triangles
from ..trace.kernels.empty_space import OFFSET
from ..trace.wavefront import Tile
from . import false_alarms
from .invariant import Invariant
from .replicates import RUNS, heights_of, tile_of

Array = NDArray[np.float64]

CELLS = 128
POINTS = 16_384
"""Points of each run."""
LIGHT = ((30.0, 20.0), (60.0, 140.0), (80.0, 260.0))
"""Directions (θ, φ) in degrees in which the visible area is measured."""
SURFACES = ((1.75, 0.5), (2.0, 1.0), (8.0, 0.3))
"""γ and σ of the surfaces."""
_EPS = 2.0**-52


def closed(surfaces: Iterable[Heightfield]) -> Invariant:
    """Of every surface: Σ (w·m) area over all its facets, front and back, is w_z for every w.

    The sum is w_z − w·(mean slope), and a period's mean slope is 0: at worst over all
    directions the error is the length of the mean slope.
    """
    gaps, allowed = [], []
    for surface in surfaces:
        slopes = facet_slopes(Heightfield(mesh(surface).heights))
        gaps.append(float(np.hypot(*(slope.mean() for slope in slopes))))
        # Each difference is rounded once, pairwise sums once for each doubling.
        size = max(float(np.abs(slope).mean()) for slope in slopes)
        allowed.append(2 * _EPS * size * (np.log2(slopes[0].size) + 2))
    worst = int(np.argmax(np.array(gaps) / np.array(allowed)))
    return Invariant(
        "projected area, closed",
        "Σ (w·m) · area over all facets of a period, front and back, is cosθ for every direction w",
        gaps[worst],
        allowed[worst],
        "largest |Σ (w·m) · area − cosθ| over all directions, per unit of mean plane; rounding of "
        "its sum",
    )


def vector_area(grid: Grid) -> float:
    """Distance of Σ area · normal from (0, 0, 1): triangles as traced, of one period."""
    vertices, faces = triangles(grid)
    cells = faces.reshape(grid.rows + 2 * MARGIN, grid.columns + 2 * MARGIN, 2, 3)
    inner = cells[MARGIN:-MARGIN, MARGIN:-MARGIN].reshape(-1, 3)
    a, b, c = (vertices[inner[:, k]].astype(float) for k in range(3))
    total = np.cross(b - a, c - a).sum(axis=0) / 2
    return float(np.linalg.norm(total / (grid.rows * grid.columns) - [0, 0, 1]))


def mean_g1(grid: Grid, theta: float, phi: float) -> float:
    """cosθ over the projected area of all facets that face (θ, φ), degrees: exact by its sum."""
    w = light_direction(theta, phi)
    facing = np.maximum(w[2] - np.tensordot(w[:2], _slopes(grid), 1), 0).mean()
    return float(w[2] / facing)


def _slopes(grid: Grid) -> Array:
    """Slopes p and q of both facets of every cell that is not flipped, shape (2, 2, rows, …)."""
    heights = grid.heights[MARGIN:-MARGIN, MARGIN:-MARGIN].astype(float)
    along_x, along_y = np.diff(heights, axis=1), np.diff(heights, axis=0)
    return np.array([[along_x[:-1], along_x[1:]], [along_y[:, 1:], along_y[:, :-1]]])


def visible_area(tile: Tile, theta: float, phi: float, rng: np.random.Generator) -> float:
    """⟨w·m⟩ · visibility · area of the facets, per unit of mean plane, at POINTS points.

    From points of the surface that face (θ, φ), degrees, a ray goes that way; what
    gets out sees the light. Its start is moved off the facet, as the tracer's rays are, by
    a part of 5e−7 of the coordinates: the estimate is biased by about as little.
    """
    grid = tile.grid
    w = light_direction(theta, phi)
    u, v = (stratified_points(POINTS, rng) * (grid.columns, grid.rows)).T
    column, row = u.astype(int), v.astype(int)
    upper = (v - row > u - column).astype(int)
    p, q = _slopes(grid)[:, upper, row, column]
    facing = w[2] - w[0] * p - w[1] * q
    corner = grid.heights[row + MARGIN, column + MARGIN].astype(float)
    height = corner + p * (u - column) + q * (v - row)
    normal = np.stack([-p, -q, np.ones_like(p)]) / np.sqrt(1 + p**2 + q**2)
    step = OFFSET * grid.reach * np.abs(normal).sum(axis=0)
    start = np.stack([u + grid.x0 + MARGIN, v + grid.y0 + MARGIN, height]) + step * normal
    front = facing > 0
    return float(facing[front] @ _gets_out(tile, start.T[front], w) / POINTS)


def _gets_out(tile: Tile, origins: Array, w: Array) -> NDArray[np.bool_]:
    """Which rays from ``origins`` along w, one direction for all, meet no triangle."""
    grid = tile.grid
    period = np.array([grid.columns, grid.rows])
    low = np.array([grid.x0, grid.y0])
    high = low + period + 2 * MARGIN
    out = np.zeros(len(origins), bool)
    pending = np.arange(len(origins))
    position = origins.copy()
    while len(pending):
        rays = np.tile(w.astype(np.float32), (len(pending), 1))
        hits = tile.intersect(position[pending].astype(np.float32), rays).triangle
        pending = pending[hits < 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            wall = np.where(w[:2] > 0, high, low)
            t = np.where(w[:2] != 0, (wall - position[pending, :2]) / w[:2], np.inf)
        last = t.min(axis=1)
        above = position[pending, 2] + last * w[2] >= grid.top
        out[pending[above]] = True
        pending, axis, last = pending[~above], np.argmin(t, axis=1)[~above], last[~above]
        # A little back, so that rounding leaves no gap between the two parts.
        position[pending] += (last - 2.0**-18 * grid.reach)[:, None] * w
        position[pending, axis] -= np.sign(w[axis]) * period[axis]
    return out


def projected_area(pool: Executor, seed: int) -> list[Invariant]:
    """Check the traced triangles and the visible area, on surfaces of SURFACES."""
    grids = [
        tile_of(heights_of(generate_surface(gamma, sigma, cells=CELLS, seed=seed)))
        for gamma, sigma in SURFACES
    ]
    whole = max(vector_area(tile.grid) for tile in grids)
    steepest = max(float(np.abs(_slopes(tile.grid)).mean()) for tile in grids)
    return [
        Invariant(
            "projected area of the traced triangles",
            "Σ area · normal of the triangles given to Embree is the mean plane's, each period",
            whole,
            _EPS * (1 + steepest) * 2 * CELLS**2,
            "distance of the vectors per unit of mean plane; rounding of 2 · 128² sums at worst",
        ),
        visible(pool, grids, (seed, 2)),
    ]


def visible(pool: Executor, tiles: list[EmbreeTile], seed_words: tuple[int, ...]) -> Invariant:
    """Σ ⟨w·m⟩ · visible area = cosθ, by rays from the surface towards the light."""
    jobs = [(k, light, run) for k in range(len(tiles)) for light in LIGHT for run in range(RUNS)]

    def one(job: tuple[int, tuple[float, float], int]) -> float:
        k, (theta, phi), run = job
        rng = np.random.default_rng((*seed_words, k, int(theta), run))
        return visible_area(tiles[k], theta, phi, rng)

    areas = np.array(list(pool.map(one, jobs))).reshape(len(tiles), len(LIGHT), RUNS)
    cosines = np.cos(np.radians([theta for theta, _ in LIGHT]))
    figures = {}
    for (gamma, sigma), tile, of_tile in zip(SURFACES, tiles, areas, strict=True):
        for (theta, phi), values, cosine in zip(LIGHT, of_tile, cosines, strict=True):
            key = f"γ = {gamma:g}, σ = {sigma:g}, θ = {theta:g}"
            figures[f"{key}: visible area / cosθ − 1 in %"] = 100 * (values.mean() / cosine - 1)
            error = values.std(ddof=1) / np.sqrt(RUNS)
            figures[f"{key}: standard error in %"] = 100 * error / cosine
            figures[f"{key}: mean G1 of the mesh"] = mean_g1(tile.grid, theta, phi)
            figures[f"{key}: Smith's G1"] = float(
                smith.g1(light_direction(theta, phi), gamma, sigma)
            )
    return false_alarms.by_chance(
        "projected area, visible",
        "Σ ⟨w·m⟩ · G1 · area = cosθ: the facets that see the light show it what falls in",
        [false_alarms.against(areas[:, k].T, cosine) for k, cosine in enumerate(cosines)],
        f"{len(tiles)} surfaces at {len(LIGHT)} angles, rays from the surface towards the light",
        figures,
    )
