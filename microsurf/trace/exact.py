"""The exact engine: one compiled loop from the light to the end, over heights without a mesh."""

import time
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..physics.fresnel import transmittance_bound
from ..surface import Mesh
from .beam import light_direction, stratified_points
from .kernels.exact_first_hits import mirrored_light, unblocked
from .kernels.exact_lobe_fans import nodes_of
from .kernels.exact_path import trace_light
from .kernels.lobe_fans import FAN, all_rings
from .kernels.splitmix import stream
from .kernels.state import BATCHES, bins_about, empty_tallies
from .wavefront import FacetOptics, FirstHits, Tally, tally_of

FINE = 1024.0
"""Cells: heights beyond it are kept in float64; float32 resolves 3e−5 of a cell there."""

Heights = NDArray[np.floating[Any]]


class ExactTile(NamedTuple):
    """One period of heights in cells, and what lets a ray skip most of them.

    Attributes
    ----------
    heights : ndarray, shape (rows + 1, columns + 1)
        Heights of all vertices in cells, the first row and column once more at the end;
        float32, or float64 where they go beyond FINE.
    flipped : ndarray of bool, shape (rows, columns)
        Cells split by the other diagonal.
    plain : bool
        No cell is.
    tops : ndarray, shape (rows, columns)
        Greatest height of each cell.
    ahead : ndarray
        Greatest heights of 2 × 2 blocks, level by level; of each level for the four
        quadrants of direction, (+x, +y), (−x, +y), (+x, −y), (−x, −y), row by row.
    levels : ndarray of int64, shape (levels, 3)
        Of level k, whose blocks have 2^(k+1) cells a side: its first entry in ``ahead``,
        its blocks along x and along y. The last level has one block.
    columns, rows : int
        Cells of the period.
    bottom, top : float
        Lowest and greatest height.
    aspect : float
        Width of a cell over its depth, see `grid.Grid`.

    """

    heights: Heights
    flipped: NDArray[np.bool_]
    plain: bool
    tops: Heights
    ahead: Heights
    levels: NDArray[np.int64]
    columns: int
    rows: int
    bottom: float
    top: float
    aspect: float

    @property
    def engine(self) -> str:
        """Which engine it is ready for."""
        return "exact"

    @property
    def layered(self) -> bool:
        """One surface."""
        return False


def exact_tile(
    heights: NDArray[np.float64],
    flipped: NDArray[np.bool_],
    aspect: float = 1.0,
    *,
    precise: bool = False,
) -> ExactTile:
    """Prepare one period of heights in cells, shape (rows, columns), see `surface.mesh`.

    With ``precise`` heights are float64 in any case: two surfaces may be close to each other.
    """
    rows, columns = heights.shape
    small = np.abs(heights).max() <= FINE and not precise
    kind = np.float32 if small else np.float64
    vertices = np.pad(heights.astype(kind), (0, 1), mode="wrap")
    cells = np.maximum(vertices[:-1], vertices[1:])
    tops = np.ascontiguousarray(np.maximum(cells[:, :-1], cells[:, 1:]))
    ahead, levels = _pyramid(tops)
    return ExactTile(
        vertices,
        np.ascontiguousarray(flipped),
        not flipped.any(),
        tops,
        ahead,
        levels,
        columns,
        rows,
        float(vertices.min()),
        float(vertices.max()),
        aspect,
    )


def _pyramid(tops: Heights) -> tuple[Heights, NDArray[np.int64]]:
    """Greatest heights ahead and their levels, see `ExactTile`."""
    parts: list[Heights] = []
    levels: list[tuple[int, int, int]] = []
    start = 0
    blocks = tops
    while not levels or blocks.size > 1:
        blocks = _halved(_halved(blocks, 0), 1)
        levels.append((start, blocks.shape[1], blocks.shape[0]))
        for step_y in (-1, 1):
            for step_x in (-1, 1):
                both = np.maximum(blocks, np.roll(blocks, step_x, axis=1))
                parts.append(np.maximum(both, np.roll(both, step_y, axis=0)).ravel())
                start += blocks.size
    return np.concatenate(parts), np.array(levels, np.int64)


def _halved(blocks: Heights, axis: int) -> Heights:
    """Greatest of every two neighbours; an odd last one stays alone."""
    starts = np.arange(0, blocks.shape[axis], 2)
    halved: Heights = np.maximum.reduceat(blocks, starts, axis=axis)
    return halved


def trace(
    tile: ExactTile,
    theta: float,
    phi: float,
    facet: FacetOptics,
    paths: int,
    rng: np.random.Generator,
    *,
    part: int = 0,
    parts: int = 1,
    azimuth: float | None = None,
) -> Tally:
    """Follow paths of light from (θ, φ), in degrees, until each has ended.

    As `wavefront.trace`, over heights instead of triangles; nothing is ever lost.
    """
    begin = time.perf_counter()
    light = -(-paths // facet.branches)
    starts = stratified_points(light, rng, part, parts) * (tile.columns, tile.rows)
    rings = all_rings(facet.n if facet.interface else 1.0)
    count = len(rings.edges) - 1
    room = np.zeros(FAN), np.zeros(2 * count), np.zeros(count)
    tallies = empty_tallies()
    rays = trace_light(
        tile, starts, *-light_direction(theta, phi), facet,
        transmittance_bound(facet.n) if facet.substrate else 1.0,
        bins_about(phi if azimuth is None else azimuth),
        rings, nodes_of(rings), room, (rng.random(), rng.random()), tallies, stream(rng),
    )  # fmt: skip
    batch = np.arange(light) % BATCHES
    return tally_of(tallies, facet, batch, (rays, 0, 0), (time.perf_counter() - begin, 0.0))


def first_hits(
    tile: ExactTile, theta: float, phi: float, rays: int, rng: np.random.Generator
) -> FirstHits:
    """As `embree_hits.first_hits`; nothing is ever lost."""
    starts = stratified_points(rays, rng) * (tile.columns, tile.rows)
    facet, free = np.empty(rays, np.int64), np.empty(rays, np.bool_)
    mirrored_light(tile, starts, *-light_direction(theta, phi), facet, free)
    return FirstHits(facet, free, 0)


def ways_out(
    tile: ExactTile,
    facets: NDArray[np.int64],
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    w: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """As `embree_hits.ways_out`; a ray can't meet the facet it starts on, nor needs an offset."""
    del normals
    out = np.empty(len(points), np.bool_)
    unblocked(tile, facets, points, *w, out)
    return out


def period_of(tile: ExactTile) -> Mesh:
    """Heights as rays meet them, see `engine.period_of`."""
    return Mesh(tile.heights.astype(np.float64), tile.flipped, tile.aspect)
