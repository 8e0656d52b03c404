"""Embree's float32 beside a float64 walk over the grid, ray by ray and albedo by albedo.

    python -m validation.gridwalk.check                      # writes two tables, half an hour
    python -m validation.gridwalk.check facets --light 2000  # one of them, with fewer light rays

gridwalk.csv: both engines are given the same float32 rays. They may differ about the facet
only where float32 must have erred by at most 8 in the units of `agreement`, about the
weights (u, v) by at most 8 in theirs. A ray *leaks* that Embree alone misses though it ends
below the surface; the others that it misses graze a ridge. Rays are *traced*, as `trace`
makes them, or *aimed* exactly at edges and vertices, half of them at 89.9°, or *vertical* on
vertices and edges. The *control* shows Embree a surface that is off by a hundredth of a cell
at one vertex in a hundred: it must break the bound.

gridwalk_albedo.csv: `trace` with either engine and the same random numbers, Kd = 0.8. A ray
whose answers differ puts all later random numbers of its call out of step, so a call has
few light rays; the standard error is over the calls. The verdict is that of the 95 % interval
of the difference against ±1e-5. The control walks on the surface raised by a cell at one
vertex in a hundred.
"""

import argparse
from itertools import product
from pathlib import Path

import numpy as np
from tqdm import tqdm

from microsurf import generate_surface
from microsurf.cli.save import rounded, save
from microsurf.physics import facet
from microsurf.results import detector
from microsurf.stats import intervals
from microsurf.surface.heightfield import mesh
from microsurf.trace.embree import EmbreeTile, Hits, Rays
from microsurf.trace.grid import MARGIN, Grid, from_heights, triangles
from microsurf.trace.kernels.state import ENDS, LOST
from microsurf.trace.wavefront import FacetOptics, Tally, Tile, trace

from .agreement import BOUND, facet_discrepancy, weight_discrepancy
from .walk import ExactHits, GridWalk

OUT = Path(__file__).parents[2] / "reports" / "bench"
ORDINARY = ((8.0, 0.7, 16), (2.0, 0.3, 16), (1.75, 0.5, 4))
"""γ, σ, and light rays a call: fewer where more paths differ, which costs time."""
N, KD = 1.5, 0.8
WEIGHT = float(facet.body_weight(N, KD))
IL = FacetOptics(N, interface=True, substrate=True, multiple_scattering=True, survival=WEIGHT)
AIMED = 200_000
ALLOWED = 1e-5  # difference of the albedos
THETAS = (0.0, 60.0, 80.0, 89.0)
Pair = tuple[Rays, Rays]


def ordinary(gamma: float, sigma: float, cells: int = 512) -> Grid:
    """Tile of a generated surface."""
    tile = mesh(generate_surface(gamma, sigma, cells=cells, seed=1))
    return from_heights(tile.heights, tile.flipped)


def hostile() -> dict[str, Grid]:
    """Tiles that no theory has in mind; diagonals at random."""
    rng = np.random.default_rng(2)
    needles = 0.3 * rng.standard_normal((64, 64))
    needles[rng.integers(0, 64, 20), rng.integers(0, 64, 20)] += 1000
    heights = {
        "slopes of 1e3": 1000 * rng.random((64, 64)),
        "needles of 1e3": needles,
        "plateaus": np.floor(3 * rng.random((16, 16))).repeat(4, axis=0).repeat(4, axis=1),
        "2 × 2 cells": np.round(4 * rng.standard_normal((2, 2))) / 4,
    }
    return {name: from_heights(h, rng.random(h.shape) < 0.5) for name, h in heights.items()}


class Recorder:
    """A tile that keeps the rays it is asked about."""

    def __init__(self, tile: Tile) -> None:
        self.tile, self.grid = tile, tile.grid
        self.rays: list[Pair] = []

    def intersect(self, origins: Rays, directions: Rays) -> Hits:
        """Pass the rays on."""
        self.rays.append((origins.copy(), directions.copy()))
        return self.tile.intersect(origins, directions)


def traced(tile: Tile, theta: float, light: int) -> Pair:
    """Rays of paths from θ, all orders."""
    recorder = Recorder(tile)
    trace(recorder, theta, 17.0, IL, light * IL.branches, np.random.default_rng(3))
    origins, directions = zip(*recorder.rays, strict=True)
    return np.concatenate(origins), np.concatenate(directions)


def aimed(grid: Grid, count: int, rng: np.random.Generator) -> Pair:
    """Rays down at points of edges, three in ten at vertices; half of them at 89.9°.

    Targets lie in the period, not in its margin. Directions are multiples of 1/1024 and
    distances powers of two, so that with heights of few bits the ray meets its vertex exactly.
    """
    vertices, faces = triangles(grid)
    y, x = np.divmod(np.arange(len(faces)) // 2, grid.flipped.shape[1])
    inner = (np.minimum(x, y) >= MARGIN) & (x < grid.columns + MARGIN) & (y < grid.rows + MARGIN)
    chosen, corner = rng.choice(np.flatnonzero(inner), count), rng.integers(0, 3, count)
    a, b = vertices[faces[chosen, corner]], vertices[faces[chosen, (corner + 1) % 3]]
    along = np.where(rng.random(count) < 0.3, 0.0, rng.random(count))[:, None]
    turn = rng.uniform(0, 2 * np.pi, count)
    down = np.where(rng.random(count) < 0.5, rng.uniform(0.1, 4, count), np.cos(np.radians(89.9)))
    directions = np.stack([np.cos(turn), np.sin(turn), -down], axis=1)
    directions = np.round(directions * 1024) / 1024
    origins = a + along * (b - a) - directions * 2.0 ** rng.integers(-2, 8, count)[:, None]
    return origins.astype(np.float32), directions.astype(np.float32)


def vertical(grid: Grid, count: int, rng: np.random.Generator) -> Pair:
    """Rays straight down on vertices, sides and diagonals, exactly."""
    x, y = rng.integers(0, grid.columns, count), rng.integers(0, grid.rows, count)
    part = rng.integers(0, 1024, count) / 1024
    on_x, on_y = part * rng.integers(0, 2, (2, count))
    origins = np.stack([grid.x0 + MARGIN + x + on_x, grid.y0 + MARGIN + y + on_y,
                        np.full(count, grid.top + 1)], axis=1)  # fmt: skip
    return origins.astype(np.float32), np.tile(np.array([0, 0, -1], np.float32), (count, 1))


def compare(grid: Grid, embree: Tile, rays: Pair) -> dict[str, float]:
    """One row of the table; ``grid`` is what float64 walks on."""
    walk = GridWalk(grid)
    seen, true = embree.intersect(*rays), walk.first_hits(*rays)
    differ = np.flatnonzero(seen.triangle != true.triangle)
    same = np.flatnonzero((seen.triangle == true.triangle) & (true.triangle >= 0))
    units, cells = facet_discrepancy(
        grid, (rays[0][differ], rays[1][differ]), seen.triangle[differ], true.triangle[differ]
    )
    weight_units, weights = weight_discrepancy(
        grid,
        (rays[0][same], rays[1][same]),
        Hits(seen.triangle[same], seen.u[same], seen.v[same]),
        ExactHits(true.triangle[same], true.t[same], true.u[same], true.v[same]),
    )
    alone = np.flatnonzero((seen.triangle < 0) & (true.triangle >= 0))
    origins, directions = rays[0][alone].astype(float), rays[1][alone].astype(float)
    behind = origins + (true.t[alone, None] + 1e-6) * directions
    leaks = (walk.first_hits(behind, directions).triangle < 0) & (directions[:, 2] < 0)
    return {
        "rays": len(rays[0]),
        "facets_differ": len(differ),
        "embree_alone_misses": len(alone),
        "embree_leaks": int(leaks.sum()),
        "float64_alone_misses": int((true.triangle[differ] < 0).sum()),
        "worst_facet_units": units.max(initial=0),
        "worst_facet_cells": cells.max(initial=0),
        "worst_weight_units": weight_units.max(initial=0),
        "worst_weight": weights.max(initial=0),
    }


def raised(grid: Grid, by: float = 0.01) -> Grid:
    """The same tile, off by so many cells at one vertex in a hundred."""
    period = grid.heights[MARGIN : MARGIN + grid.rows, MARGIN : MARGIN + grid.columns].astype(float)
    chosen = np.random.default_rng(4).random(period.shape) < 0.01
    flipped = grid.flipped[MARGIN : MARGIN + grid.rows, MARGIN : MARGIN + grid.columns]
    return from_heights(period + by * chosen, flipped)


def facets(light: int) -> list[dict[str, float | str]]:
    """Rows of gridwalk.csv."""
    surfaces = {f"γ = {g:g}, σ = {s:g}": ordinary(g, s) for g, s, _ in ORDINARY} | hostile()
    rows: list[dict[str, float | str]] = []
    for name, grid in tqdm(surfaces.items(), desc="facets", disable=None):
        embree = EmbreeTile(grid)
        rng = np.random.default_rng(5)
        kinds = {f"traced from {t:g}°": traced(embree, t, light) for t in (0, 60, 80, 89.9)}
        kinds["aimed"] = aimed(grid, AIMED, rng)
        kinds["vertical"] = vertical(grid, AIMED, rng)
        for kind, rays in kinds.items():
            rows.append({"surface": name, "kind": kind, **compare(grid, embree, rays)})
        if "γ" in name:
            off = compare(grid, EmbreeTile(raised(grid)), kinds["traced from 60°"])
            rows.append({"surface": name, "kind": "control", **off})
    return rows


def albedo(tally: Tally) -> float:
    """Total albedo at Kd."""
    light = tally.energy.sum(axis=(0, 2, 3))
    weights = WEIGHT ** detector.BODY_EVENTS[: len(light)] * IL.path_weight(len(light))
    return float(light @ weights) / tally.light


def paired(tiles: dict[str, Tile], theta: float, light: int, call: int) -> dict[str, float | str]:
    """Albedos on two tiles from the same random numbers, ``call`` light rays at a time."""
    calls = light // call
    albedos = np.zeros((2, calls))
    lost = np.zeros((2, len(ENDS)), np.int64)
    for batch, (k, tile) in product(range(calls), enumerate(tiles.values())):
        rng = np.random.Generator(np.random.SFC64([6, batch]))
        tally = trace(tile, theta, 17.0, IL, call * IL.branches, rng)
        albedos[k, batch] = albedo(tally)
        lost[k] += tally.lost
    off = albedos[1] - albedos[0]
    # None of many calls that differ may still be up to 3 more (95 %), each out of step all over.
    error = float(np.sqrt(off.var() * calls + 3 * 2 * albedos[0].var())) / calls
    half = intervals.normal() * error
    low, high = float(off.mean()) - half, float(off.mean()) + half
    within = max(abs(low), abs(high)) <= ALLOWED
    row: dict[str, float | str] = {
        "theta": theta,
        "paths": calls * call * IL.branches,
        "albedo_embree": float(albedos[0].mean()),
        "difference": float(off.mean()),
        "standard_error": error,
        "calls": calls,
        "calls_that_differ": int((np.abs(off) > 1e-12).sum()),
        "verdict": "holds" if within else "undecided",
    }
    if low > ALLOWED or high < -ALLOWED:
        row["verdict"] = "departs"
    for cause, (name, counts) in product(LOST, zip(tiles, lost, strict=True)):
        row[f"lost_{cause}_{name}"] = int(counts[ENDS.index(cause)])
    return row


def albedos(light: int) -> list[dict[str, float | str]]:
    """Rows of gridwalk_albedo.csv."""
    rows: list[dict[str, float | str]] = []
    for gamma, sigma, call in tqdm(ORDINARY, desc="albedos", disable=None):
        grid = ordinary(gamma, sigma)
        tiles: dict[str, Tile] = {"embree": EmbreeTile(grid), "float64": GridWalk(grid)}
        runs = {f"{theta:g}°": (tiles, theta) for theta in THETAS}
        if not rows:
            runs["control"] = (tiles | {"float64": GridWalk(raised(grid, 1.0))}, 60.0)
        for kind, (pair, theta) in runs.items():
            row = paired(pair, theta, light, call)
            rows.append({"surface": f"γ = {gamma:g}, σ = {sigma:g}", "kind": kind, **row})
    return rows


def show(rows: list[dict[str, float | str]], name: str) -> None:
    """Print a table and write it."""
    table = rounded(rows, 6)
    OUT.mkdir(parents=True, exist_ok=True)
    save(OUT, {name: table})
    for line in [list(rows[0]), *(row.values() for row in table)]:
        print("  ".join(map(str, line)))  # noqa: T201


def main() -> int:
    """Write both tables; 1 if a bound is broken, or the control does not break it."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("table", nargs="*", help="facets, albedos, or both if none is named")
    parser.add_argument("--light", type=int, default=200_000, help="light rays of each run")
    asked = parser.parse_args()
    broken: list[dict[str, float | str]] = []
    if "facets" in asked.table or not asked.table:
        rows = facets(asked.light // 20)
        show(rows, "gridwalk.csv")
        for row in rows:
            worst = max(float(row["worst_facet_units"]), float(row["worst_weight_units"]))
            if (worst > BOUND) != (row["kind"] == "control"):
                broken.append(row)
    if "albedos" in asked.table or not asked.table:
        rows = albedos(asked.light)
        show(rows, "gridwalk_albedo.csv")
        broken += [
            row for row in rows if (row["verdict"] == "departs") != (row["kind"] == "control")
        ]
    for row in broken:
        print("broken:", row)  # noqa: T201
    return 1 if broken else 0


if __name__ == "__main__":
    raise SystemExit(main())
