"""Processor time a light ray of both engines, in turns on the same surfaces, one thread each.

    python -m validation.bench.engines   # minutes; writes reports/bench/engines.csv

Three questions at each of the benchmark's nine cases: *fans*, all orders of a facet with a
substrate, as `measure` traces them; *mirrors*, all orders of an interface alone, which are single
paths; *two rays*, what light meets first and whether a mirror there sends it up for good.
Figures are ratios of medians over the turns; low and high are the extreme ratios of single turns.
Processor time stays comparable on a machine with other work, wall time does not.
"""

import statistics
import time
from collections.abc import Callable
from itertools import product

import numpy as np
from tqdm import tqdm

from microsurf import generate_surface
from microsurf.cli.save import rounded, save
from microsurf.physics import facet
from microsurf.surface import mesh
from microsurf.trace import engine
from microsurf.trace.engine import AnyTile
from microsurf.trace.wavefront import FacetOptics

from ..gridwalk.check import OUT
from .run import FULL, THETAS
from .sides import KD, N

ENGINES = ("exact", "embree")
TURNS, LIGHT = 5, 20_000
TARGET = 8.0
_WEIGHT = float(facet.body_weight(N, KD))
_OPTICS = {
    "fans": FacetOptics(
        N, interface=True, substrate=True, multiple_scattering=True, survival=_WEIGHT
    ),
    "mirrors": FacetOptics(N, interface=True, substrate=False, multiple_scattering=True),
}


def asked(kind: str, tile: AnyTile, theta: float, light: int) -> Callable[[int], object]:
    """One turn of a question, by its seed."""
    if kind == "two rays":
        return lambda seed: engine.first_hits(tile, theta, 0.0, light, np.random.default_rng(seed))
    optics = _OPTICS[kind]
    return lambda seed: engine.trace(
        tile, theta, 0.0, optics, light * optics.branches, np.random.default_rng(seed)
    )


def compare(
    tiles: dict[str, AnyTile], kind: str, theta: float, light: int = LIGHT
) -> dict[str, float]:
    """Nanoseconds of both engines a light ray, and their ratio."""
    runs = {name: asked(kind, tile, theta, light) for name, tile in tiles.items()}
    spent: dict[str, list[float]] = {name: [] for name in runs}
    for turn in range(TURNS + 1):  # the first one compiles
        for name, run in runs.items():
            begin = time.process_time()
            run(turn)
            spent[name].append((time.process_time() - begin) / light * 1e9)
    exact, embree = (spent[name][1:] for name in ENGINES)
    ratios = [b / a for a, b in zip(exact, embree, strict=True)]
    return {
        "exact_ns": statistics.median(exact),
        "embree_ns": statistics.median(embree),
        "ratio": statistics.median(embree) / statistics.median(exact),
        "low": min(ratios),
        "high": max(ratios),
    }


def rows(light: int = LIGHT) -> list[dict[str, object]]:
    """Of all cases."""
    made: list[dict[str, object]] = []
    for asked_mesh in tqdm(FULL.meshes, disable=None):
        heights = mesh(
            generate_surface(asked_mesh.gamma, asked_mesh.sigma, cells=asked_mesh.cells, seed=1)
        )
        tiles = {name: engine.tile_of(name, heights) for name in ENGINES}
        for kind, theta in product((*_OPTICS, "two rays"), THETAS):
            found = compare(tiles, kind, theta, light)
            made.append({"surface": asked_mesh.name, "theta": theta, "kind": kind, **found})
    return made


def main() -> None:
    """Write the table and print it."""
    found = rows()
    written = rounded(found, 4)
    OUT.mkdir(parents=True, exist_ok=True)
    save(OUT, {"engines.csv": written})
    for row, shown in zip(found, written, strict=True):
        verdict = "met" if float(str(row["ratio"])) >= TARGET else "missed"
        print(*shown.values(), verdict)  # noqa: T201


if __name__ == "__main__":
    main()
