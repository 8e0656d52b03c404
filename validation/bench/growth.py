"""How microsurf grows: time a path and memory with the mesh, speed with threads."""

import multiprocessing
import statistics
import time
from dataclasses import dataclass
from multiprocessing.connection import Connection

import numpy as np
from tqdm import tqdm

from microsurf import Heightfield, generate_surface, memory

from .rows import Row
from .sides import KD, Ours, peak_bytes

GAMMA, SIGMA, THETA = 2.0, 0.3, 60.0
"""The hardest of the benchmark's materials: its cliffs grow with the mesh."""


@dataclass(frozen=True)
class Size:
    """One mesh of cells² cells: time a path, seconds of synthesis and in all, bytes a cell."""

    cells: int
    microseconds_per_path: float
    synthesis_seconds: float
    seconds: float
    bytes_per_cell: float


def _grow(pipe: Connection, cells: int, paths: int) -> None:
    """Make and trace one mesh in a process whose memory nothing else has touched."""
    Ours(Heightfield(np.zeros((8, 8))), SIGMA).batch((0.0,), KD, 2**10, 0)
    generate_surface(GAMMA, SIGMA, cells=8)
    baseline = peak_bytes()
    begin = time.perf_counter()
    surface = generate_surface(GAMMA, SIGMA, cells=cells, seed=1)
    made = time.perf_counter()
    turn = Ours(surface, SIGMA).turn(THETA, paths, 1)
    pipe.send(
        Size(
            cells,
            1e6 * turn.wall_seconds / turn.paths,
            made - begin,
            time.perf_counter() - begin,
            (peak_bytes() - baseline) / cells**2,
        )
    )


def with_cells(sizes: tuple[int, ...], paths: int) -> list[Size]:
    """Trace meshes of these numbers of cells a side, each in a fresh process."""
    context = multiprocessing.get_context("spawn")
    found = []
    for cells in tqdm(sizes, desc="growth with the mesh", unit=" meshes", disable=None):
        pipe, end = context.Pipe()
        process = context.Process(target=_grow, args=(end, cells, paths), daemon=True)
        process.start()
        end.close()
        found.append(pipe.recv())
        process.join()
    return found


def with_threads(cells: int, paths: int, turns: int) -> dict[int, float]:
    """Speed-up over one thread for 1, 2, 4 … all cores; medians of turns taken in rotation."""
    cores = memory.cores()
    counts = sorted({*(2**k for k in range(cores.bit_length()) if 2**k <= cores), cores})
    surface = generate_surface(GAMMA, SIGMA, cells=cells, seed=1)
    speeds: dict[int, list[float]] = {count: [] for count in counts}
    for turn in tqdm(range(turns), desc="growth with threads", unit=" turns", disable=None):
        for count in counts:
            # A work item or two must not decide: each thread has at least eight.
            one = Ours(surface, SIGMA, count).turn(THETA, paths * max(counts), turn)
            speeds[count].append(one.paths / one.wall_seconds)
    return {c: statistics.median(s) / statistics.median(speeds[1]) for c, s in speeds.items()}


def rows(sizes: list[Size], threads: dict[int, float]) -> list[Row]:
    """Rows of the targets that growth has; sizes and threads that were not run have none."""
    found = []
    of = {size.cells: size for size in sizes}
    if 256 in of and 2048 in of:
        cost = of[2048].microseconds_per_path / of[256].microseconds_per_path
        found.append(
            Row("growth", THETA, "cost of a path, 2048² over 256²", cost, 2.5, at_most=True)
        )
    if 2048 in of:
        memory = of[2048].bytes_per_cell
        found.append(Row("growth", None, "peak bytes a cell at 2048²", memory, 400.0, at_most=True))
    found.extend(
        Row("growth", THETA, f"speed-up on {count} threads", gain, 1.8 if count == 2 else None)
        for count, gain in threads.items()
        if count > 1
    )
    return found
