"""Albedos of both engines by order and kind, on twelve meshes and angles from two azimuths.

    python -m validation.gridwalk.engine_albedos   # minutes; reports/bench/engine_albedos.csv

Both trace the same surface in RUNS independent runs; z is Welch's, as the normal deviate that is
as unlikely. The figures of one case are cleared by chance alone if the largest |z| of the table is
below what chance passes once in ten thousand tables, and if z² are not too large together. The
*control* asks the exact engine for facets of another index: it must be noticed in each case.
"""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import product

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from microsurf import generate_surface, memory
from microsurf.cli.save import rounded, save
from microsurf.invariants import false_alarms
from microsurf.invariants.replicates import RUNS, runs, weighted
from microsurf.results import detector
from microsurf.surface.heightfield import mesh
from microsurf.trace import engine
from microsurf.trace.engine import AnyTile

from .check import IL, KD, OUT, N
from .first_hits import SURFACES

CELLS, PATHS = 256, 2**16
THETAS = (0.0, 60.0, 80.0)
PHIS = (0.0, 122.0)
WRONG = 1.52
"""Index of the control."""
RATE = 1e-4
Array = NDArray[np.float64]
Row = dict[str, float | str]


def albedos(tile: AnyTile, theta: float, phi: float, n: float, number: int) -> Array:
    """Albedos of independent runs, shape (runs, order, kind)."""
    with ThreadPoolExecutor(memory.cores()) as pool:
        return runs(
            pool, tile, (theta, phi), IL._replace(n=n), PATHS, (number,),
            lambda tally: weighted(tally, n, KD).sum(axis=(2, 3)),
        )  # fmt: skip


def case(gamma: float, sigma: float, theta: float, phi: float, number: int) -> Iterator[Row]:
    """Rows of one surface and incidence, those of the control last."""
    surface = mesh(generate_surface(gamma, sigma, cells=CELLS, seed=1))
    exact, embree = (engine.tile_of(name, surface) for name in ("exact", "embree"))
    # Seeds of the second engine and of the control are their own.
    theirs = albedos(embree, theta, phi, N, 3 * number)
    for kind_of_row, n, seed in (
        ("agreement", N, 3 * number + 1),
        ("control", WRONG, 3 * number + 2),
    ):
        ours = albedos(exact, theta, phi, n, seed)
        z = false_alarms.between(ours, theirs)
        for order, kind in product(*map(range, z.shape)):
            values = [float(side[:, order, kind].mean()) for side in (ours, theirs)]
            if any(values):
                yield {
                    "row": kind_of_row, "gamma": gamma, "sigma": sigma, "theta": theta, "phi": phi,
                    "order": order + 1, "kind": detector.KINDS[kind], "exact": values[0],
                    "embree": values[1], "z": float(z[order, kind]),
                }  # fmt: skip


def broken(rows: list[Row]) -> list[str]:
    """What is not as it must be, in words."""
    z = np.array([float(row["z"]) for row in rows if row["row"] == "agreement"])
    allowed = false_alarms.critical(len(z), RATE)
    found = []
    if np.abs(z).max() > allowed:
        found.append(f"|z| = {np.abs(z).max():.2f} where chance passes {allowed:.2f}")
    if not _noticed(rows):
        found.append("the control was not noticed in every case")
    return found


def _noticed(rows: list[Row]) -> bool:
    largest: dict[tuple[object, ...], float] = {}
    controls = [row for row in rows if row["row"] == "control"]
    for row in controls:
        where = tuple(row[name] for name in ("gamma", "theta", "phi"))
        largest[where] = max(abs(float(row["z"])), largest.get(where, 0.0))
    return min(largest.values()) > false_alarms.critical(len(controls), RATE)


def table() -> list[Row]:
    """Rows of engine_albedos.csv."""
    cases = list(product(SURFACES, THETAS, PHIS))
    return [
        row
        for number, ((gamma, sigma), theta, phi) in enumerate(tqdm(cases, disable=None))
        for row in case(gamma, sigma, theta, phi, number)
    ]


def main() -> int:
    """Write the table; 1 if the engines differ beyond chance, or the control does not."""
    rows = table()
    OUT.mkdir(parents=True, exist_ok=True)
    save(OUT, {"engine_albedos.csv": rounded(rows, 6)})
    z = np.array([float(row["z"]) for row in rows if row["row"] == "agreement"])
    print(f"{len(z)} albedos, {RUNS} runs of {PATHS} paths: mean z² {np.mean(z**2):.3f}")  # noqa: T201
    print(f"largest |z| {np.abs(z).max():.2f}", *broken(rows), sep="\n")  # noqa: T201
    return int(bool(broken(rows)))


if __name__ == "__main__":
    raise SystemExit(main())
