"""Projected area: what facets show to a direction is what falls on the mean plane."""

from collections.abc import Iterable
from concurrent.futures import Executor

import numpy as np
from numpy.typing import NDArray

from ..physics import smith
from ..surface import Heightfield, Mesh, facet_slopes, generate_surface, mesh
from ..trace import engine
from ..trace.beam import light_direction, stratified_points
from ..trace.engine import AUTO, AnyTile
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


def vector_area(period: Mesh) -> float:
    """Distance of Σ area · normal from (0, 0, 1): the facets of `engine.period_of` a tile."""
    p, q = _slopes(period)
    return float(np.hypot(p.mean(), q.mean()))


def mean_g1(tile: AnyTile, theta: float, phi: float) -> float:
    """cosθ over the projected area of all facets that face (θ, φ), degrees: exact by its sum."""
    w = light_direction(theta, phi)
    slopes = _slopes(engine.period_of(tile))
    facing = np.maximum(w[2] - np.tensordot(w[:2], slopes, 1), 0).mean()
    return float(w[2] / facing)


def _slopes(period: Mesh) -> Array:
    """Slopes p and q of both facets of every square cell, shape (2, 2, rows, columns)."""
    heights, flipped = period.heights, period.flipped
    along_x, along_y = np.diff(heights, axis=1), np.diff(heights, axis=0)
    left, right = along_y[:, :-1], along_y[:, 1:]
    across = [np.where(flipped, left, right), np.where(flipped, right, left)]
    return np.array([[along_x[:-1], along_x[1:]], across])


def visible_area(tile: AnyTile, theta: float, phi: float, rng: np.random.Generator) -> float:
    """⟨w·m⟩ · visibility · area of the facets, per unit of mean plane, at POINTS points.

    From points of the surface that face (θ, φ), degrees, a ray goes that way; what
    gets out sees the light. No cell may be flipped.
    """
    period = engine.period_of(tile)
    rows, columns = period.flipped.shape
    w = light_direction(theta, phi)
    u, v = (stratified_points(POINTS, rng) * (columns, rows)).T
    column, row = u.astype(int), v.astype(int)
    upper = (v - row > u - column).astype(int)
    p, q = _slopes(period)[:, upper, row, column]
    facing = w[2] - w[0] * p - w[1] * q
    height = period.heights[row, column] + p * (u - column) + q * (v - row)
    normal = np.stack([-p, -q, np.ones_like(p)], axis=1) / np.sqrt(1 + p**2 + q**2)[:, None]
    front = facing > 0
    facets = 2 * (row * columns + column) + upper
    points = np.stack([u, v, height], axis=1)
    out = engine.ways_out(tile, facets[front], points[front], normal[front], w)
    return float(facing[front] @ out / POINTS)


def projected_area(pool: Executor, seed: int, name: str = AUTO) -> list[Invariant]:
    """Check the traced facets and the visible area, on surfaces of SURFACES, with one engine."""
    tiles = [
        tile_of(heights_of(generate_surface(gamma, sigma, cells=CELLS, seed=seed)), engine=name)
        for gamma, sigma in SURFACES
    ]
    periods = [engine.period_of(tile) for tile in tiles]
    whole = max(vector_area(period) for period in periods)
    steepest = max(float(np.abs(_slopes(period)).mean()) for period in periods)
    return [
        Invariant(
            "projected area of the traced facets",
            "Σ area · normal of the facets that rays meet is the mean plane's, each period",
            whole,
            _EPS * (1 + steepest) * 2 * CELLS**2,
            "distance of the vectors per unit of mean plane; rounding of 2 · 128² sums at worst",
        ),
        visible(pool, tiles, (seed, 2)),
    ]


def visible(pool: Executor, tiles: list[AnyTile], seed_words: tuple[int, ...]) -> Invariant:
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
            figures[f"{key}: mean G1 of the mesh"] = mean_g1(tile, theta, phi)
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
