"""How often a ray falls through Embree's mesh: about 1e−9, too rare to be counted directly.

    python -m validation.gridwalk.leaks   # prints a table, writes reports/bench/leaks.csv

Embree leaks at edges only, where a ray passes within float32's rounding of them
(`gridwalk_check.py`). So each ray that `trace` makes is moved, by less than a facet, until it
meets its own facet at a random point within half a unit of `agreement` on either side
of one of its edges, and each leak counts by the share of the facet that this strip is. What
the move hides behind other facets is not made up for: the figure can be somewhat too low.
Counted is what `trace` would lose: rays that end below everything, and those that meet a
back facet, other than at its edge, where float64 meets none.
"""

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from microsurf.cli.save import rounded, save
from microsurf.trace.embree import EmbreeTile
from microsurf.trace.grid import Grid, triangles

from .agreement import FacetsOfRays
from .check import IL, ORDINARY, OUT, ordinary, traced
from .walk import GridWalk, Rays

THETAS = (0.0, 60.0, 80.0, 89.0)
LIGHT = 10_000
REPEATS = 20
STRIP = 0.5  # units, either side: leaks have been seen up to 0.15
GRAZE = 1e-4  # of a weight: nearer to its edge the tracer takes a back facet for a graze
_STEEP = 1e-3  # cosine of incidence below which the strip grows no longer


def from_behind(grid: Grid, number: NDArray[np.int32], directions: Rays) -> NDArray[np.bool_]:
    """Whether each ray meets the back of its facet; none has no back."""
    vertices, faces = triangles(grid)
    a, b, c = (vertices[faces[number, k]].astype(float) for k in range(3))
    back = np.einsum("ri,ri->r", np.cross(b - a, c - a), directions) > 0
    return np.asarray(back & (number >= 0))


def leaks(embree: EmbreeTile, theta: float, rng: np.random.Generator) -> dict[str, float]:
    """Leaks found, and the probability that a ray leaks."""
    grid, walk = embree.grid, GridWalk(embree.grid)
    origins, directions = traced(embree, theta, LIGHT)
    met = walk.first_hits(origins, directions)
    hit = met.triangle >= 0
    origins, directions = origins[hit].astype(float), directions[hit]
    facets = FacetsOfRays(grid, met.triangle[hit], (origins, directions))
    vertices, faces = triangles(grid)
    corner = vertices[faces[met.triangle[hit]]].astype(float)
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    double_area = np.linalg.norm(normal, axis=1)
    width = STRIP * facets.unit / np.maximum(facets.cosine, _STEEP)
    points = origins + met.t[hit, None] * directions
    found, rows, shares = 0, np.arange(len(origins)), []
    for _ in range(REPEATS):
        k = rng.integers(0, 3, len(origins))
        a, b = corner[rows, k], corner[rows, (k + 1) % 3]
        length = np.linalg.norm(b - a, axis=1)
        across = np.cross(normal, b - a) / (double_area * length)[:, None]
        target = a + rng.random((len(a), 1)) * (b - a)
        target += across * (rng.uniform(-1, 1, len(a)) * width)[:, None]
        moved = (origins + target - points).astype(np.float32)
        seen, true = embree.intersect(moved, directions), walk.first_hits(moved, directions)
        alone = np.flatnonzero((seen.triangle < 0) & (true.triangle >= 0))
        down = directions[alone].astype(float)
        behind = moved[alone] + (true.t[alone, None] + 1e-6) * down
        below = alone[(walk.first_hits(behind, down).triangle < 0) & (down[:, 2] < 0)]
        back = from_behind(grid, seen.triangle, directions) & ~from_behind(
            grid, true.triangle, directions
        )
        back &= np.min([seen.u, seen.v, 1 - seen.u - seen.v], axis=0) >= GRAZE
        through = np.concatenate([below, np.flatnonzero(back)])
        found += len(through)
        # A facet has three strips on its own side, of this share of its area each, and one of
        # them was drawn; those on the other side stand for its neighbours'.
        shares.append(np.sum((3 * length * width / (double_area / 2))[through]) / len(rows))
    return {
        "rays": REPEATS * len(rows),
        "leaks": found,
        "probability": float(np.mean(shares)),
        "standard_error": float(np.std(shares, ddof=1)) / REPEATS**0.5,
        "hits_per_path": len(rows) / (LIGHT * IL.branches),
    }


def main() -> None:
    """Write the table."""
    rng = np.random.default_rng(12)
    table = []
    for gamma, sigma, _ in tqdm(ORDINARY, desc="leaks", disable=None):
        embree = EmbreeTile(ordinary(gamma, sigma))
        for theta in THETAS:
            row = leaks(embree, theta, rng)
            table.append({"gamma": gamma, "sigma": sigma, "theta": theta, **row})
    table = rounded(table, 3)
    OUT.mkdir(parents=True, exist_ok=True)
    save(OUT, {"leaks.csv": table})
    for line in [list(table[0]), *(row.values() for row in table)]:
        print(*line, sep="  ")  # noqa: T201


if __name__ == "__main__":
    main()
