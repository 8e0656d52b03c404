"""Which facets light sees, and which of these it leaves along the mirror direction: by slope.

A beam meets facets, and each hit sends a shadow ray into its mirror direction. Hits by
bins of the reduced slope ρ = |(p/σ_x, q/σ_y)|, over the light that these facets would take
if nothing stood before them, Σ A ⟨i·m⟩/m_z over the mesh's facets of projected area A, are
G1 of these facets; hits whose shadow ray is free are G2 of their mirror pairs.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..physics.fresnel import reflectance
from .beam import light_direction, ray_origins
from .grid import MARGIN, Grid
from .kernels.empty_space import OFFSET, launch
from .kernels.first_hits import record_first_hits
from .kernels.state import BATCHES, Frame, empty_ray_batch
from .wavefront import BATCH_SIZE, Tile

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MeshFacets:
    """Facets of one period of a mesh, two of each cell, each array of shape (2 cells,).

    Slopes p, q, and the bin of ρ each is in. Facet 2c + s is side s of cell c of the
    period, row by row; all have the same projected area.
    """

    p: Array
    q: Array
    bin: NDArray[np.intp]
    bins: int


@dataclass(frozen=True, eq=False)
class Visibility:
    """What one beam sees, in units of its power, by bins of ρ.

    Attributes
    ----------
    facing : ndarray, shape (bins,)
        Light the bin's facets would take without masking, Σ A ⟨i·m⟩/(m_z cosθ) over the area.
    met : ndarray, shape (BATCHES, bins)
        Light that meets them, by batches of rays that know nothing of each other; its
        mean over ``facing`` is G1.
    open : ndarray, shape (BATCHES, bins)
        The part of it that a mirror sends up, past all other facets; over ``facing`` G2.
        Facets that mirror light below the horizon count as closed.
    specular : ndarray, shape (BATCHES, bins)
        The same weighted by F(i·m): the bin's part of the order-1 specular albedo.
    rays : int
        Rays sent.
    lost : int
        Those of them that were lost, or whose shadow ray was, see `ray_batch.LOST`; they count as
        not met, or as closed.

    """

    facing: Array
    met: Array
    open: Array
    specular: Array
    rays: int
    lost: int


def facets_of(grid: Grid, sigma_x: float, sigma_y: float, edges: Array) -> MeshFacets:
    """Slopes of a mesh as rays meet it, in bins of ρ; ``edges`` ascend from 0 to ∞.

    Raises ValueError if the edges don't, or a σ is not > 0.
    """
    if not (edges[0] == 0 and edges[-1] == np.inf and np.all(np.diff(edges) > 0)):
        raise ValueError(f"edges = {edges}: must ascend from 0 to infinity")
    if not (sigma_x > 0 and sigma_y > 0):
        raise ValueError(f"sigma = ({sigma_x}, {sigma_y}): bins of slope need sigma > 0")
    heights = grid.heights[MARGIN:-MARGIN, MARGIN:-MARGIN].astype(np.float64)
    flipped = grid.flipped[MARGIN:-MARGIN, MARGIN:-MARGIN]
    along_x, along_y = np.diff(heights, axis=1), np.diff(heights, axis=0)
    left, right = along_y[:, :-1], along_y[:, 1:]
    p = np.stack([along_x[:-1], along_x[1:]], axis=-1).ravel()
    q = np.stack([np.where(flipped, left, right), np.where(flipped, right, left)], axis=-1).ravel()
    q *= grid.aspect
    place = np.searchsorted(edges, np.hypot(p / sigma_x, q / sigma_y), "right") - 1
    return MeshFacets(p, q, place, len(edges) - 1)


def visibility(
    tile: Tile,
    facets: MeshFacets,
    theta: float,
    phi: float,
    rays: int,
    rng: np.random.Generator,
    *,
    n: float = 1.0,
    k: float = 0.0,
) -> Visibility:
    """Send ``rays`` from (θ, φ), in degrees, over the tile, and the mirrored ones on from there.

    ``n`` and ``k`` are the facets' index; ``facets`` must be the tile's own. Raises
    ValueError if there are fewer rays than BATCHES.
    """
    if rays < BATCHES:
        raise ValueError(f"rays = {rays}: must be >= {BATCHES}, one for each batch")
    hit, free, lost = _first_hits(tile, theta, phi, rays, rng)
    light = light_direction(theta, phi)
    slant = light[2] - light[0] * facets.p - light[1] * facets.q  # i·m/m_z
    taken = np.bincount(facets.bin, np.maximum(slant, 0), facets.bins)
    found = np.flatnonzero(hit >= 0)
    where = _of_period(hit[found], tile.grid)
    cosine = slant[where] / np.sqrt(1 + facets.p[where] ** 2 + facets.q[where] ** 2)
    batch = found % BATCHES
    cell = batch * facets.bins + facets.bin[where]
    per_ray = 1 / np.bincount(np.arange(rays) % BATCHES, minlength=BATCHES)[batch]

    def by_bin(weight: Array) -> Array:
        total = np.bincount(cell, weight * per_ray, BATCHES * facets.bins)
        return np.asarray(total.reshape(BATCHES, facets.bins), np.float64)

    passed = free[found].astype(np.float64)
    return Visibility(
        facing=taken / (len(facets.p) * light[2]),
        met=by_bin(np.ones(len(found))),
        open=by_bin(passed),
        specular=by_bin(passed * reflectance(np.clip(cosine, 0, 1), n, k)),
        rays=rays,
        lost=lost,
    )


def _of_period(triangle: NDArray[np.int32], grid: Grid) -> NDArray[np.intp]:
    """Number of the facet of the period that a triangle, maybe of the margin, is an image of."""
    cell, side = np.divmod(triangle.astype(np.intp), 2)
    y, x = np.divmod(cell, grid.flipped.shape[1])
    y, x = (y - MARGIN) % grid.rows, (x - MARGIN) % grid.columns
    return np.asarray(2 * (y * grid.columns + x) + side)


def _first_hits(
    tile: Tile, theta: float, phi: float, rays: int, rng: np.random.Generator
) -> tuple[NDArray[np.int32], NDArray[np.bool_], int]:
    """Triangle each ray meets first, −1 if lost; whether its mirror image goes free; the lost."""
    grid = tile.grid
    frame = Frame(grid.x0, grid.y0, grid.top + OFFSET * grid.reach, grid.reach)
    points = ray_origins(rays, grid, rng, 0, 1)
    dx, dy, dz = -light_direction(theta, phi)
    hit, free = np.full(rays, -1, np.int32), np.zeros(rays, np.bool_)
    ray_batch, next_batch = (empty_ray_batch(BATCH_SIZE, grid.aspect) for _ in range(2))
    active = started = lost = 0
    while True:
        fresh = min(BATCH_SIZE - active, rays - started)
        if fresh:
            # A batch for each ray: its number.
            launch(
                active, points, started, started + fresh, dx, dy, dz, rays, ray_batch, grid, frame
            )
            active, started = active + fresh, started + fresh
        if not active:
            return hit, free, lost
        hits = tile.intersect(ray_batch.origins[:active], ray_batch.embree_directions[:active])
        active, more = record_first_hits(
            active, ray_batch, next_batch, hits, grid, frame, hit, free
        )
        ray_batch, next_batch = next_batch, ray_batch
        lost += more
