"""How nearly two engines agree about a ray, in units of float32's rounding.

Embree finds a facet by the signs of three edge functions, for a unit direction D and an
edge from a to b seen from the ray's origin: D·((a−b) × (a+b)) = 2 D·(b×a). Its value is
2 |a−b| ρ cosθ, where ρ is how far inside the edge the ray meets the facet's plane and θ
the angle to the normal. So what the sign needs to be right is the *passing distance*
ρ cosθ, whatever the incidence; in the facet it is 1/cosθ as long. With ε = 2⁻²³, and R the
distance from the origin to the facet's farthest vertex, float32 errs in it by at most

* ½ εR: a and b, which are exact, are rounded when the origin is subtracted;
* 5 εR: seven roundings of ½ε in the product (of a−b, of a+b, two in the cross product,
  three in the scalar one), |a+b| ≤ 2R, and √2 because the cross product's terms do not cancel;
* 2 εR: Embree takes in what lies outside by a weight ≤ ε, the facet being at most 2R high.

That is 7.5 εR, to first order; BOUND = 8. So the engines may name different facets only if
the ray passes an edge within d = 8 εR / cosθ in the facet's plane. The plane itself is met
at t ≥ 0 or not by the sign of a·N, whose error moves the plane by about as much: a ray that
starts within 8 εR of a facet may or may not meet it.

On the same facet, the weights (u, v) are edge functions over their sum, 2 A cosθ each: they
differ by at most 8 εR · perimeter / (2 A cosθ), A the facet's area.
"""

import numpy as np
from numpy.typing import NDArray

from microsurf.trace.embree import Hits
from microsurf.trace.grid import Grid, triangles

from .walk import ExactHits, Rays

Array = NDArray[np.float64]

BOUND = 8.0
EPSILON = 2.0**-23
_TIE = 2.0**-40  # of R: float64 does not know which of two planes so near comes first


class FacetsOfRays:
    """What rays, each with a facet of its own, have to do with it.

    Attributes
    ----------
    unit : ndarray, shape (rays,)
        εR in cells.
    inside, outside : ndarray, shape (rays,)
        Passing distance in cells from the nearest edge, if the ray passes inside, and from
        the farthest of those it passes outside; < 0 and 0 if not.
    cosine, height, t : ndarray, shape (rays,)
        |cosθ|; distance of the origin from the facet's plane; where the ray meets it, in cells.
    weight_unit : ndarray, shape (rays,)
        ε R · perimeter / (2 A cosθ).

    """

    def __init__(self, grid: Grid, number: NDArray[np.int32], rays: tuple[Rays, Rays]) -> None:
        vertices, faces = triangles(grid)
        origins, directions = (np.asarray(array, np.float64) for array in rays)
        direction = directions / np.linalg.norm(directions, axis=1)[:, None]
        corner = vertices.astype(np.float64)[faces[number]] - origins[:, None]
        first, second = np.roll(corner, -1, axis=1), np.roll(corner, -2, axis=1)
        side = np.linalg.norm(second - first, axis=2)
        normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        double_area = np.linalg.norm(normal, axis=1)
        facing = np.einsum("ri,ri->r", direction, normal)
        plane = np.einsum("ri,ri->r", corner[:, 0], normal)
        volume = np.einsum("ri,rki->rk", direction, np.cross(first, second))
        self.unit = EPSILON * np.linalg.norm(corner, axis=2).max(axis=1)
        passing = volume / side
        # Seen edge-on a facet has no front: either sense of the signs will do.
        self.inside = np.maximum(passing.min(axis=1), -passing.max(axis=1))
        self.outside = np.maximum(-self.inside, 0)
        self.cosine = np.abs(facing) / double_area
        self.height = np.abs(plane) / double_area
        with np.errstate(divide="ignore", invalid="ignore"):
            self.t = plane / facing
            self.weight_unit = self.unit * side.sum(axis=1) / np.abs(facing)


def facet_discrepancy(
    grid: Grid, rays: tuple[Rays, Rays], seen: NDArray[np.int32], true: NDArray[np.int32]
) -> tuple[Array, Array]:
    """How much float32 must have erred to see other facets than the true ones.

    Parameters
    ----------
    grid, rays
        The tile; origins and directions.
    seen, true : ndarray, shape (rays,)
        Numbers of the facets by float32 and float64, −1 for none; different in each ray.

    Returns
    -------
    units, cells : ndarray, shape (rays,)
        The least error that explains the ray, in units of εR and as a length in the facet
        in cells. It must take float32 into the facet it saw, and past the true facet if
        that comes first. ∞ where float64 itself is wrong: it passed by a facet in front, or
        the ray passes by what it named.

    """
    a, b = FacetsOfRays(grid, true, rays), FacetsOfRays(grid, seen, rays)
    hit_a, hit_b = true >= 0, seen >= 0
    claim = np.maximum(b.outside, np.where(b.t < 0, b.height, 0)) * hit_b
    excuse = np.minimum(np.abs(a.inside), a.height)
    excuse = np.where(hit_b & (b.t <= a.t), 0, excuse) * hit_a
    units = np.maximum(claim / b.unit, excuse / a.unit)
    with np.errstate(divide="ignore", invalid="ignore"):
        cells = np.where(claim / b.unit > excuse / a.unit, claim / b.cosine, excuse / a.cosine)
    cells[units == 0] = 0
    tie = _TIE * np.maximum(a.unit, b.unit) / EPSILON
    in_front = hit_b & (b.inside > tie) & (b.t > tie) & (~hit_a | (b.t < a.t - tie))
    units[in_front | (hit_a & (a.outside > tie))] = np.inf
    return units, cells


def weight_discrepancy(
    grid: Grid, rays: tuple[Rays, Rays], seen: Hits, true: ExactHits
) -> tuple[Array, Array]:
    """Differences of the weights (u, v) on the same facet, in εR·perimeter/(2A cosθ) and in 1."""
    facets = FacetsOfRays(grid, true.triangle, rays)
    u, v = true.u - seen.u, true.v - seen.v
    off = np.max(np.abs([u, v, u + v]), axis=0)
    return off / (facets.weight_unit + EPSILON), off
