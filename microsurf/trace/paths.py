"""Paths of light over the tile: a wavefront of rays, Embree and the facet events in turn.

Everything random about a path comes from the generator that is passed in.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .. import result
from ..physics.fresnel import transmittance_bound
from .beam import direction as direction_to
from .beam import stratified_points
from .embree import Hits, Rays
from .events import OFFSET, launch, take_events
from .grid import MARGIN, Grid

WAVE = 65_536  # rays between two calls: fewer lose to Python, many more to the caches
LOST = ("below", "behind", "wrapped")
"""Why a path can be lost: it left the tile beneath its lowest point, it met the back of
a triangle, or it went round the period `events.MOST_WRAPS` times without meeting anything."""
_ENDS = ("absorbed", "left out", *LOST)  # codes −1, −2, … of paths that reach no detector


class Tile(Protocol):
    """Anything rays can meet: `EmbreeTile`, `Plane`."""

    grid: Grid

    def intersect(self, origins: Rays, directions: Rays) -> Hits:
        """Find the first triangle of each ray."""


@dataclass(frozen=True)
class Facet:
    """What the facet events need: index n (k > 0: n + ik of a conductor), which effects run.

    A path of more than result.BODY_EXACT body events survives each further one with
    probability ``survival``, as it would in a substrate of that body weight, and is
    counted for more. In the clefts of heavy-tailed surfaces paths have 1e5 events;
    where the substrate leaves nothing of them, nobody should wait for them.
    """

    n: float
    interface: bool
    substrate: bool
    multiple_scattering: bool
    survival: float = 1.0
    k: float = 0.0

    def path_weight(self, events: int) -> NDArray[np.float64]:
        """How many paths one path stands for, in the first ``events`` bins of body events."""
        beyond = np.maximum(result.BODY_EVENTS[:events] - result.BODY_EXACT, 0)
        return np.asarray(self.survival**-beyond)


@dataclass(frozen=True)
class Tally:
    """What a number of paths came to; tallies of the same bins add up.

    Attributes
    ----------
    counts : ndarray of int64, shape (order, body_events, rings, sectors)
        Paths that reached the detector.
    ends : dict
        Paths that did not: absorbed in the substrate (see `Facet`), left out on
        purpose at a second facet, or lost, by cause.
    paths, rays, grazes : int
        Paths started, rays traced, and rays that grazed a ridge and went on.

    """

    counts: NDArray[np.int64]
    ends: dict[str, int]
    paths: int
    rays: int
    grazes: int

    def __add__(self, other: "Tally") -> "Tally":
        """Add up; the one with fewer body events is padded with zeros."""
        events = max(self.counts.shape[1], other.counts.shape[1])
        counts = np.zeros((len(result.ORDERS), events, result.RINGS, result.SECTORS), np.int64)
        for tally in (self, other):
            counts[:, : tally.counts.shape[1]] += tally.counts
        return Tally(
            counts,
            {cause: self.ends[cause] + other.ends[cause] for cause in _ENDS},
            self.paths + other.paths,
            self.rays + other.rays,
            self.grazes + other.grazes,
        )


def trace(
    tile: Tile,
    theta: float,
    phi: float,
    facet_event: Facet,
    paths: int,
    rng: np.random.Generator,
    record: Callable[[Rays, Rays], None] | None = None,
) -> Tally:
    """Follow ``paths`` paths of light from (θ, φ), in degrees, until each has ended.

    ``record`` is shown the rays of every call to the tile, for timing them alone.
    """
    grid = tile.grid
    wave = min(WAVE, paths)
    starts = stratified_points(paths, rng) * (grid.columns, grid.rows)
    starts += (grid.x0 + MARGIN, grid.y0 + MARGIN)
    incident = -direction_to(theta, phi)
    reach = grid.reach
    top = grid.top + OFFSET * reach
    ring_cosines = np.cos(np.radians(result.RING_EDGES[1:]))
    bound = transmittance_bound(facet_event.n) if facet_event.substrate else 1.0

    origins = np.zeros((wave, 3), np.float32)
    rays = np.zeros((wave, 3), np.float32)
    directions = np.zeros((wave, 3))
    state = np.zeros((wave, 3), np.int64)  # order, body events, wraps
    ended = np.zeros(wave, np.int64)
    uniform = np.zeros((wave, 4))
    codes: list[NDArray[np.int64]] = []
    active = started = traced = grazes = 0
    while True:
        fresh = min(wave - active, paths - started)
        if fresh:
            launch(
                active, active + fresh, starts[started : started + fresh], incident,
                origins, rays, directions, state,
                grid.tops, grid.levels, grid.x0, grid.y0, grid.columns, grid.rows, top, reach,
            )  # fmt: skip
            active += fresh
            started += fresh
        if not active:
            break
        hits = tile.intersect(origins[:active], rays[:active])
        if record is not None:
            record(origins[:active].copy(), rays[:active].copy())
        traced += active
        active, over, grazed = take_events(
            active, origins, rays, directions, state, ended,
            hits.triangle, hits.u, hits.v,
            grid.heights, grid.flipped, grid.x0, grid.y0, grid.columns, grid.rows,
            grid.bottom, top, reach,
            facet_event.n, facet_event.k, bound,
            facet_event.interface, facet_event.substrate, facet_event.multiple_scattering,
            facet_event.survival, result.BODY_EDGES,
            grid.tops, grid.levels, ring_cosines, phi,
            rng.random(out=uniform[:active]), rng,
        )  # fmt: skip
        codes.append(ended[:over].copy())
        grazes += grazed
    return _tally(np.concatenate(codes), paths, traced, grazes)


def _tally(codes: NDArray[np.int64], paths: int, rays: int, grazes: int) -> Tally:
    """Count codes of ended paths: bins if ≥ 0, −1 − (index in _ENDS) otherwise."""
    shape = (-1, len(result.ORDERS), result.RINGS, result.SECTORS)
    size = int(np.prod(shape[1:]))
    seen = np.bincount(codes[codes >= 0], minlength=size)
    seen = np.pad(seen, (0, -len(seen) % size)).reshape(shape).swapaxes(0, 1)
    ends = np.bincount(-1 - codes[codes < 0], minlength=len(_ENDS))
    return Tally(seen, dict(zip(_ENDS, map(int, ends), strict=True)), paths, rays, grazes)
