"""Two explicit surfaces traced by Embree: a second opinion on the exact engine between them.

Nothing of the path is shared with `kernels.exact_layers`: triangles in float32 in the place of the
walk over heights, whole arrays of rays in the place of a compiled loop, a choice at each facet in
the place of chains of mirrors with weights, refraction by vectors. What both share is the
detector.
"""

import time
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..physics.fresnel import transmittance
from ..results import detector
from ..surface import LayeredMesh
from .beam import light_direction, ray_origins
from .embree import EmbreeLayers, Hits
from .grid import MARGIN, from_heights, points_on
from .kernels.empty_space import MOST_WRAPS, OFFSET
from .kernels.exact_layers import ROWS
from .kernels.state import (
    ABSORBED,
    BATCHES,
    BEHIND,
    BELOW,
    WRAPPED,
    Tallies,
    empty_tallies,
)
from .layer_paths import Flags, LayerPaths, count_exits
from .wavefront import FacetOptics, Tally, tally_of

Array = NDArray[np.float64]

TOGETHER = 32_768
"""Light rays that are followed at once."""
INTERFACE, SUBSTRATE = 0, 1
_BACK = 1e-6  # cosine by which float32 may meet a grazed facet from behind


def layered_tile(pair: LayeredMesh, absorption: float = 0.0) -> EmbreeLayers:
    """Triangulate both surfaces; ``absorption`` is per cell."""
    above, below = pair.interface, pair.substrate
    return EmbreeLayers(
        from_heights(above.heights, above.flipped, above.aspect),
        from_heights(below.heights, below.flipped, below.aspect),
        absorption,
    )


def trace(
    tile: EmbreeLayers,
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
    """Follow paths of light from (θ, φ), in degrees, until each has ended, as `layers.trace`.

    A ray that slips between two triangles meets a surface from its wrong side, and is lost
    as "behind".
    """
    begin = time.perf_counter()
    light = -(-paths // facet.branches)
    batch = np.arange(light) % BATCHES
    azimuth = phi if azimuth is None else azimuth
    grid = tile.interface
    points = ray_origins(light, grid, rng, part, parts)
    tallies, inside = empty_tallies(), np.zeros((ROWS, len(detector.BODY_EVENTS)))
    follow = _Follower(tile, facet, azimuth, tallies, inside, rng)
    for first in range(0, light, TOGETHER):
        rows = slice(first, first + TOGETHER)
        follow.light(points[rows], -light_direction(theta, phi), batch[rows])
    seconds = time.perf_counter() - begin
    tally = tally_of(tallies, facet, batch, (follow.rays, 0, 0), (seconds, follow.seconds))
    return replace(tally, inside=inside[:, : tally.energy.shape[1]].copy())


class _Follower:
    """Follows paths over one tile, and counts how they end."""

    def __init__(
        self,
        tile: EmbreeLayers,
        facet: FacetOptics,
        azimuth: float,
        tallies: Tallies,
        inside: Array,
        rng: np.random.Generator,
    ) -> None:
        self.tile, self.facet, self.azimuth, self.rng = tile, facet, azimuth, rng
        self.tallies, self.inside = tallies, inside
        self.rays, self.seconds = 0, 0.0
        above, below = tile.interface, tile.substrate
        self.top, self.bottom = above.top, below.bottom
        self.step = OFFSET * max(above.reach, below.reach)
        self.period = np.array([above.columns, above.rows], float)
        self.low = np.array([above.x0, above.y0])
        self.in_cells = np.array([1.0, above.aspect, 1.0])

    def light(self, points: Array, d: Array, batch: NDArray[np.int64]) -> None:
        """Follow light rays that start above ``points`` along d."""
        count = len(points)
        start = np.column_stack([points, np.full(count, self.top + self.step)])
        paths = LayerPaths.begin(start, np.tile(d, (count, 1)), batch)
        while len(paths.length):
            paths = self._next(paths)

    def _next(self, paths: LayerPaths) -> LayerPaths:
        """One ray of each path; the paths that go on."""
        directions = paths.d * self.in_cells
        begin = time.perf_counter()
        surface, hits = self.tile.intersect(
            paths.start.astype(np.float32), directions.astype(np.float32)
        )
        self.seconds += time.perf_counter() - begin
        self.rays += len(surface)
        missed = surface < 0
        active = ~missed
        if missed.any():
            active[missed] = self._round(paths, missed)
        point, normal = _points(self.tile, surface, hits)
        cosine = (paths.d * normal).sum(1)
        # From below only the interface is met from inside; all else is a wrong side.
        sign = np.where(paths.within & (surface == INTERFACE), 1.0, -1.0)
        wrong = ~missed & ((sign * cosine < -_BACK) | (~paths.within & (surface == SUBSTRATE)))
        self._lose(wrong, BEHIND)
        active &= ~wrong
        hit = active & ~missed
        mu = np.clip(sign * cosine, 1e-12, 1.0)
        apart = (point - paths.point) / self.in_cells
        paths.length += np.where(hit & paths.within, np.sqrt((apart**2).sum(1)), 0.0)
        paths.point = np.where(hit[:, None], point, paths.point)
        outside = hit & ~paths.within
        below = hit & paths.within & (surface == INTERFACE)
        active &= self._substrate(paths, hit & (surface == SUBSTRATE), normal)
        self._interface(paths, outside, below, normal, mu)
        # Up off what is below the ray, down off what is above: a heightfield hides nothing there.
        size = np.abs(normal).sum(1) / np.where(normal[:, 2] > 0, normal[:, 2], 1.0)
        off = self.step * size * np.where(paths.within & (surface == INTERFACE), -1.0, 1.0)
        paths.start = np.where(hit[:, None], point, paths.start)
        paths.start[:, 2] += np.where(hit, off, 0.0)
        return paths.of(active)

    def _round(self, paths: LayerPaths, missed: Flags) -> Flags:
        """Carry rays that met nothing round the period; which of them go on."""
        low, high = self.low, self.low + self.period + 2 * MARGIN
        d = (paths.d * self.in_cells)[missed]
        start, point = paths.start[missed], paths.point[missed]
        with np.errstate(divide="ignore", invalid="ignore"):
            wall = np.where(d[:, :2] > 0, high, low)
            t = np.where(d[:, :2] != 0, (wall - start[:, :2]) / d[:, :2], np.inf)
        axis, last = t.argmin(1), t.min(1)
        with np.errstate(invalid="ignore"):
            z = start[:, 2] + last * d[:, 2]
        within, up = paths.within[missed], d[:, 2] > 0
        out = ~within & up & (z >= self.top)
        away = ~out & (up & (z >= self.top) | ~up & (z < self.bottom))
        wraps = paths.wraps[missed] + 1
        tired = ~out & ~away & (wraps > MOST_WRAPS)
        rows = np.flatnonzero(missed)
        left_up = np.zeros(len(missed), bool)
        left_up[rows[out]] = True
        count_exits(
            paths.of(left_up), self.tile.absorption, self.azimuth, self.tallies, self.inside
        )
        self._lose(away, BELOW)
        self._lose(tired, WRAPPED)
        on = ~out & ~away & ~tired
        rows, axis = rows[on], axis[on]
        # A little back, so that rounding leaves no gap between the two parts.
        moved = start[on] + (last[on] - self.step)[:, None] * d[on]
        shift = np.zeros((len(rows), 3))
        shift[np.arange(len(rows)), axis] = np.sign(d[on, axis]) * self.period[axis]
        paths.start[rows], paths.point[rows] = moved - shift, point[on] - shift
        paths.wraps[rows] = wraps[on]
        return np.asarray(on)

    def _substrate(self, paths: LayerPaths, rows: Flags, normal: Array) -> Flags:
        """Substrate events; False for paths that end there."""
        left = np.ones(len(rows), bool)
        count = int(rows.sum())
        if not self.facet.substrate:
            left[rows] = False
        else:
            thinned = paths.events[rows] + 1 >= detector.BODY_EXACT
            left[rows] = ~thinned | (self.rng.random(count) < self.facet.survival)
        self._lose(~left, ABSORBED)
        paths.events[rows] += 1
        sphere = self.rng.standard_normal((count, 3))
        sphere /= np.sqrt((sphere**2).sum(1, keepdims=True))
        paths.d[rows] = _unit(normal[rows] + sphere)
        return left

    def _interface(
        self, paths: LayerPaths, outside: Flags, below: Flags, normal: Array, mu: Array
    ) -> None:
        """Mirror or refract what meets the interface from outside and from below."""
        n = self.facet.n
        paths.order[outside] += 1
        paths.hits[below] += 1
        squared = np.where(below, 1 - n**2 * (1 - mu**2), 1 - (1 - mu**2) / n**2)
        through = np.sqrt(np.clip(squared, 0.0, 1.0))  # cosine beyond the interface
        share = transmittance(np.where(below, through, mu), n) if self.facet.interface else 1.0
        passes = (outside | below) & (squared > 0) & (self.rng.random(len(mu)) < share)
        mirrored = (outside | below) & ~passes
        # Normal on the side that the light comes from, d = along the facet − μ m.
        m = np.where(below[:, None], -normal, normal)
        along = paths.d + mu[:, None] * m
        ratio = np.where(below, n, 1 / n)
        bent = ratio[:, None] * along - through[:, None] * m
        paths.d[passes] = _unit(bent[passes])
        paths.d[mirrored] = _unit((along + mu[:, None] * m)[mirrored])
        paths.entries[passes & outside] += 1
        paths.within[passes] = ~paths.within[passes]

    def _lose(self, rows: Flags, cause: int) -> None:
        count = int(rows.sum())
        self.tallies.ended[cause] += count
        self.tallies.lost[cause] += count


def _unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.sqrt((vectors**2).sum(1, keepdims=True)))


def _points(tile: EmbreeLayers, surface: NDArray[np.int32], hits: Hits) -> tuple[Array, Array]:
    """Points hit, in cells, and unit normals upwards; of misses any."""
    point, normal = np.zeros((len(surface), 3)), np.zeros((len(surface), 3))
    normal[:, 2] = 1.0
    for number, grid in enumerate((tile.interface, tile.substrate)):
        rows = surface == number
        point[rows], normal[rows] = points_on(grid, hits.triangle[rows], hits.u[rows], hits.v[rows])
    return point, normal
