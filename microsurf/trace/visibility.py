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
from . import engine
from .beam import light_direction
from .kernels.state import BATCHES

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
        Those of them that were lost, or whose shadow ray was, see `state.LOST`; they count as
        not met, or as closed.

    """

    facing: Array
    met: Array
    open: Array
    specular: Array
    rays: int
    lost: int


def facets_of(tile: engine.AnyTile, sigma_x: float, sigma_y: float, edges: Array) -> MeshFacets:
    """Slopes of a tile as rays meet it, in bins of ρ; ``edges`` ascend from 0 to ∞.

    Raises ValueError if the edges don't, or a σ is not > 0.
    """
    if not (edges[0] == 0 and edges[-1] == np.inf and np.all(np.diff(edges) > 0)):
        raise ValueError(f"edges = {edges}: must ascend from 0 to infinity")
    if not (sigma_x > 0 and sigma_y > 0):
        raise ValueError(f"sigma = ({sigma_x}, {sigma_y}): bins of slope need sigma > 0")
    period = engine.period_of(tile)
    heights, flipped = period.heights, period.flipped
    along_x, along_y = np.diff(heights, axis=1), np.diff(heights, axis=0)
    left, right = along_y[:, :-1], along_y[:, 1:]
    p = np.stack([along_x[:-1], along_x[1:]], axis=-1).ravel()
    q = np.stack([np.where(flipped, left, right), np.where(flipped, right, left)], axis=-1).ravel()
    q *= period.aspect
    slope_bin = np.searchsorted(edges, np.hypot(p / sigma_x, q / sigma_y), "right") - 1
    return MeshFacets(p, q, slope_bin, len(edges) - 1)


def visibility(
    tile: engine.AnyTile,
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
    hit, free, lost = engine.first_hits(tile, theta, phi, rays, rng)
    light = light_direction(theta, phi)
    slant = light[2] - light[0] * facets.p - light[1] * facets.q  # i·m/m_z
    taken = np.bincount(facets.bin, np.maximum(slant, 0), facets.bins)
    reached = np.flatnonzero(hit >= 0)
    where = hit[reached]
    cosine = slant[where] / np.sqrt(1 + facets.p[where] ** 2 + facets.q[where] ** 2)
    batch = reached % BATCHES
    cell = batch * facets.bins + facets.bin[where]
    per_ray = 1 / np.bincount(np.arange(rays) % BATCHES, minlength=BATCHES)[batch]

    def by_bin(weight: Array) -> Array:
        total = np.bincount(cell, weight * per_ray, BATCHES * facets.bins)
        return np.asarray(total.reshape(BATCHES, facets.bins), np.float64)

    passed = free[reached].astype(np.float64)
    return Visibility(
        facing=taken / (len(facets.p) * light[2]),
        met=by_bin(np.ones(len(reached))),
        open=by_bin(passed),
        specular=by_bin(passed * reflectance(np.clip(cosine, 0, 1), n, k)),
        rays=rays,
        lost=lost,
    )
