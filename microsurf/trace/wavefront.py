"""Paths of light over the tile: a wavefront of rays, Embree and the facet events in turn.

Everything random about a path comes from the generator that is passed in.
"""

import time
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ..physics.fresnel import transmittance_bound
from ..results import detector
from .beam import light_direction, ray_origins
from .embree import Hits, Rays
from .grid import Grid
from .kernels.empty_space import OFFSET, launch
from .kernels.facet_scattering import scatter_batch
from .kernels.lobe_fans import FAN, LIKE, all_rings
from .kernels.state import (
    BATCHES,
    FanWork,
    Frame,
    Scattering,
    Tallies,
    bins_about,
    empty_ray_batch,
    empty_tallies,
)

BATCH_SIZE = 16_384  # rays between two calls: fewer lose to Python, many more to the caches


class Tile(Protocol):
    """Anything rays can meet: `EmbreeTile`, `Plane`."""

    grid: Grid

    def intersect(self, origins: Rays, directions: Rays) -> Hits:
        """Find the first triangle of each ray."""


class FacetOptics(NamedTuple):
    """What the facet events need: index n (k > 0: n + ik of a conductor), which effects run.

    A path of more than detector.BODY_EXACT body events survives each further one with
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

    @property
    def branches(self) -> int:
        """How many paths each light ray becomes at its first facet: mirrored, and a fan."""
        return 2 if self.interface and self.substrate else 1

    def path_weight(self, events: int) -> NDArray[np.float64]:
        """How many paths one path stands for, in the first ``events`` bins of body events."""
        beyond = np.maximum(detector.BODY_EVENTS[:events] - detector.BODY_EXACT, 0)
        return np.asarray(self.survival**-beyond)


class FirstHits(NamedTuple):
    """What light meets first, and what a mirror there sends on, each array of shape (rays,).

    ``facet`` is its number, 2c + s for side s of cell c of the period, −1 if the ray was
    lost; ``free`` whether the mirrored ray goes up and meets nothing more; ``lost`` the number
    of rays that were lost, or whose mirrored ray was.
    """

    facet: NDArray[np.int64]
    free: NDArray[np.bool_]
    lost: int


@dataclass(frozen=True)
class Tally:
    """The sums over a number of paths; tallies of the same bins add up.

    Light is in units of the power of one light ray.

    Attributes
    ----------
    energy : ndarray, shape (order, body_events, rings, sectors)
        Light that arrived in each bin.
    squares : ndarray, shape (kind, rings, sectors)
        Sums of squared weights of order 1, specular and with one body event.
    batches : ndarray, shape (BATCHES, order, body_events)
        Light that arrived, by batches of light rays that know nothing of each other.
    batch_light : ndarray, shape (BATCHES,)
        Light rays of each batch.
    ended : ndarray, shape (len(ENDS),)
        Light that did not arrive: absorbed in the substrate (see `FacetOptics`), left out on
        purpose at a second facet, or lost, by cause.
    lost : ndarray, shape (len(ENDS),)
        Paths it ended with; what is absorbed at the first facet ends no path.
    counts : ndarray, shape (5,)
        Light rays, paths, rays traced, and of these those that grazed a ridge and went
        on, and those that fell through an edge of the mesh and were sent again.
    seconds : ndarray, shape (2,)
        What tracing took, and what of it passed inside Embree.
    inside : ndarray, shape (rows, body_events)
        Of two layers: the table of `kernels.exact_layers`; without rows for one surface.

    """

    energy: NDArray[np.float64]
    squares: NDArray[np.float64]
    batches: NDArray[np.float64]
    batch_light: NDArray[np.float64]
    ended: NDArray[np.float64]
    lost: NDArray[np.int64]
    counts: NDArray[np.int64]
    seconds: NDArray[np.float64]
    inside: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 1)))

    @property
    def light(self) -> int:
        """Light rays that were sent down."""
        return int(self.counts[0])

    @property
    def paths(self) -> int:
        """Paths from the light to their end, `FacetOptics.branches` for each light ray."""
        return int(self.counts[1])

    @property
    def rays(self) -> int:
        """Rays traced."""
        return int(self.counts[2])

    @property
    def grazes(self) -> int:
        """Rays that grazed a ridge and went on."""
        return int(self.counts[3])

    @property
    def leaks(self) -> int:
        """Rays that fell through an edge and were sent again from a little above."""
        return int(self.counts[4])

    def __add__(self, other: "Tally") -> "Tally":
        """Add up; the one with fewer body events is padded with zeros.

        Sums of floats depend on their order: add in the order of the work items.
        """
        events = max(self.energy.shape[1], other.energy.shape[1])

        def padded(values: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
            widths = [(0, 0)] * values.ndim
            widths[axis] = (0, events - values.shape[axis])
            return np.pad(values, widths)

        return Tally(
            padded(self.energy, 1) + padded(other.energy, 1),
            self.squares + other.squares,
            padded(self.batches, 2) + padded(other.batches, 2),
            self.batch_light + other.batch_light,
            self.ended + other.ended,
            self.lost + other.lost,
            self.counts + other.counts,
            self.seconds + other.seconds,
            padded(self.inside, 1) + padded(other.inside, 1),
        )


def trace(
    tile: Tile,
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

    There are ``paths`` of them, or a few more to make whole light rays. They fall on
    all of the tile, or on one of several parts of the same area. Sectors are counted
    from ``azimuth``, by default that of the light.
    """
    begin = time.perf_counter()
    inside = 0.0
    grid = tile.grid
    frame = Frame(grid.x0, grid.y0, grid.top + OFFSET * grid.reach, grid.reach)
    azimuth = phi if azimuth is None else azimuth
    light = -(-paths // facet.branches)
    points = ray_origins(light, grid, rng, part, parts)
    dx, dy, dz = -light_direction(theta, phi)
    bins = bins_about(azimuth)
    bound = transmittance_bound(facet.n) if facet.substrate else 1.0
    scattering = Scattering(facet, facet.branches, bound)
    tallies, rings = empty_tallies(), all_rings(facet.n if facet.interface else 1.0)
    blocked_counts = np.ones((LIKE, detector.RINGS + 1), np.int64)
    fans = FanWork(rings, blocked_counts, np.zeros(len(rings.edges) - 1), np.zeros(FAN))
    # Every light ray needs room for all it is split into.
    size = max(BATCH_SIZE, facet.branches)
    ray_batch, next_batch = (empty_ray_batch(size, grid.aspect) for _ in range(2))
    active = unmet = started = traced = grazes = leaks = 0
    while True:
        room = len(ray_batch.weight) - active - (facet.branches - 1) * unmet
        fresh = min(room // facet.branches, light - started)
        if fresh:
            launch(
                active,
                points,
                started,
                started + fresh,
                dx,
                dy,
                dz,
                BATCHES,
                ray_batch,
                grid,
                frame,
            )
            active, unmet, started = active + fresh, unmet + fresh, started + fresh
        if not active:
            break
        called = time.perf_counter()
        hits = tile.intersect(ray_batch.origins[:active], ray_batch.embree_directions[:active])
        inside += time.perf_counter() - called
        traced += active
        active, unmet, grazed, leaked = scatter_batch(
            active, ray_batch, next_batch, hits, grid, frame, scattering, bins, fans, tallies, rng
        )
        ray_batch, next_batch = next_batch, ray_batch
        grazes, leaks = grazes + grazed, leaks + leaked
    return tally_of(
        tallies,
        facet,
        np.arange(light) % BATCHES,
        (traced, grazes, leaks),
        (time.perf_counter() - begin, inside),
    )


def tally_of(
    tallies: Tallies,
    facet: FacetOptics,
    batch: NDArray[np.int64],
    counts: tuple[int, int, int],
    seconds: tuple[float, float],
) -> Tally:
    """Put together what the detector has seen of light rays, each of one ``batch``.

    ``counts`` are rays, grazes and leaks; ``seconds`` as in `Tally`.
    """
    light = len(batch)
    filled = np.flatnonzero(tallies.batches.any(axis=(0, 1)))
    events = int(filled[-1]) + 1 if len(filled) else 1
    return Tally(
        tallies.energy[:events].transpose(1, 0, 3, 2).copy(),
        tallies.squares.swapaxes(1, 2).copy(),
        tallies.batches[:, :, :events].copy(),
        np.bincount(batch, minlength=BATCHES).astype(float),
        tallies.ended,
        tallies.lost,
        np.array([light, light * facet.branches, *counts]),
        np.array(seconds),
    )
