"""First hits of both engines beside the float64 walk over the grid, a million rays a surface.

    python -m validation.gridwalk.first_hits   # writes reports/bench/first_hits.csv, minutes

A quarter of the rays goes to points of facets, a quarter to points of edges, a quarter exactly
to vertices, and a quarter, at 89° to 89.99°, to any of these. Heights have few bits, directions
are multiples of 2⁻¹⁷, distances powers of two: a ray that is aimed at a vertex meets it exactly.
All three get the same float32 rays, which start above the surface.

A ray that meets an edge or a vertex belongs to all facets there, and one that passes within
rounding of it may be given to any of them: that is a *tie*. The exact engine and the walk may
differ only in ties, in which one of them must have erred by at most TIE roundings of float64,
2⁻⁵³ R, in the ray's distance from an edge; R is the distance from the ray's start to the facet's
farthest vertex. Both take a handful of roundings to place the ray beside an edge. Embree may
differ by as many of float32's, see `agreement`. The *control* moves one vertex in a
hundred by a hundredth of a cell: the exact engine must then differ by more.
"""

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from microsurf import generate_surface
from microsurf.cli.save import save
from microsurf.stability import first_hit
from microsurf.surface.heightfield import mesh
from microsurf.trace.grid import MARGIN, Grid, from_heights, triangles

from .agreement import BOUND, EPSILON, facet_discrepancy
from .check import OUT, raised
from .walk import GridWalk

Rays = tuple[NDArray[np.float64], NDArray[np.float64]]

SURFACES = ((8.0, 0.7), (2.0, 0.3), (40.0, 1.0), (1.75, 0.5))
"""γ and σ."""
KINDS = ("facets", "edges", "vertices", "grazing")
CELLS = 256
RAYS = 250_000
"""Of each kind on each surface."""
TIE = 8.0
_FARTHEST = 5  # power of two
_BITS = 2.0**10
_STEP = 2.0**17
_CLEAR = 1e-6  # cells: a ray that starts nearer than that may be on either side of the surface


def surface(gamma: float, sigma: float) -> Grid:
    """Tile of a generated surface, with heights of few bits and diagonals at random."""
    heights = mesh(generate_surface(gamma, sigma, cells=CELLS, seed=1)).heights
    flipped = np.random.default_rng(2).random(heights.shape) < 0.5
    return from_heights(np.round(heights * _BITS) / _BITS, flipped)


def aimed(grid: Grid, kind: str, count: int, rng: np.random.Generator) -> Rays:
    """Rays of one kind that start above the surface, far from the border of the period."""
    walk = GridWalk(grid)
    vertices, faces = triangles(grid)
    corners = vertices.astype(np.float64)[faces]
    y, x = np.divmod(np.arange(len(faces)) // 2, grid.flipped.shape[1])
    least = MARGIN + 2**_FARTHEST + 1
    inner = np.flatnonzero(
        (np.minimum(x, y) >= least)
        & (np.maximum(x - grid.columns, y - grid.rows) < 2 * MARGIN - least)
    )
    found: list[Rays] = []
    while sum(len(origins) for origins, _ in found) < count:
        chosen = corners[rng.choice(inner, count)]
        share = rng.dirichlet(np.ones(3), count)
        on = {"facets": 0, "edges": 1, "vertices": 2}.get(kind, rng.integers(0, 3, count))
        share = np.where(np.equal(on, 2)[..., None], [1.0, 0.0, 0.0], share)
        edge = np.column_stack([share[:, 0] + share[:, 1], share[:, 2], np.zeros(count)])
        share = np.where(np.equal(on, 1)[..., None], edge, share)
        target = np.einsum("rk,rkc->rc", share, chosen)
        low, high = (89.0, 89.99) if kind == "grazing" else (0.0, 89.0)
        theta = np.radians(rng.uniform(low, high, count))
        turn = rng.uniform(0, 2 * np.pi, count)
        directions = np.column_stack(
            [np.sin(theta) * np.cos(turn), np.sin(theta) * np.sin(turn), -np.cos(theta)]
        )
        directions = (np.rint(directions * _STEP) / _STEP).astype(np.float32).astype(float)
        origins = target - directions * 2.0 ** rng.integers(-4, _FARTHEST + 1, count)[:, None]
        origins = origins.astype(np.float32).astype(float)
        down = walk.first_hits(origins, np.tile([0.0, 0.0, -1.0], (count, 1)))
        above = (down.triangle >= 0) & (down.t > _CLEAR)
        found.append((origins[above], directions[above]))
    origins, directions = (np.concatenate(arrays)[:count] for arrays in zip(*found, strict=True))
    return origins, directions


def compare(grid: Grid, seen_by: Grid, rays: Rays) -> dict[str, float]:
    """How often engines that are shown ``seen_by`` differ from the walk over ``grid``."""
    true = GridWalk(grid).first_hits(*rays).triangle
    row: dict[str, float] = {"rays": len(true), "missed": int((true < 0).sum())}
    for name, look in (("exact", first_hit.by_exact), ("embree", first_hit.by_embree)):
        seen = look(seen_by, *rays).astype(np.int32)
        differ = np.flatnonzero(seen != true)
        units, _ = facet_discrepancy(
            grid, (rays[0][differ], rays[1][differ]), seen[differ], true[differ]
        )
        row[f"{name}_differs"] = len(differ)
        if name == "exact":
            units *= EPSILON * 2.0**53
            row["exact_beyond_ties"] = int((units > TIE).sum())
            row["exact_worst_roundings"] = float(units.max(initial=0))
        else:
            row["embree_beyond_rounding"] = int((units > BOUND).sum())
            row["embree_worst_units"] = float(units.max(initial=0))
    return row


def rows(count: int = RAYS) -> list[dict[str, float | str]]:
    """Rows of first_hits.csv."""
    made: list[dict[str, float | str]] = []
    for gamma, sigma in tqdm(SURFACES, disable=None):
        grid = surface(gamma, sigma)
        name = f"γ = {gamma:g}, σ = {sigma:g}"
        for number, kind in enumerate(KINDS):
            rays = aimed(grid, kind, count, np.random.default_rng([3, number]))
            made.append({"surface": name, "kind": kind, **compare(grid, grid, rays)})
        off = compare(grid, raised(grid), rays)
        made.append({"surface": name, "kind": "control", **off})
    return made


def broken(row: dict[str, float | str]) -> bool:
    """Whether a row is not as it must be."""
    beyond = float(row["exact_beyond_ties"]) > 0
    return beyond != (row["kind"] == "control")


def main() -> int:
    """Write the table; 1 if the engine differs beyond ties, or the control does not."""
    found = rows()
    OUT.mkdir(parents=True, exist_ok=True)
    save(OUT, {"first_hits.csv": found})
    for row in found:
        print(*row.values(), "BROKEN" * broken(row))  # noqa: T201
    return int(any(broken(row) for row in found))


if __name__ == "__main__":
    raise SystemExit(main())
