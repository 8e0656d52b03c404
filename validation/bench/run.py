"""Compare microsurf with Mitsuba 3 on the same meshes, turn by turn, and see how it grows.

    make bench                         # a quarter of an hour; writes reports/bench
    python -m validation.bench.run --quick --out DIR   # a minute, small meshes, rough figures

Wants a quiet machine, and what mitsuba/renderer.py wants.
"""

import argparse
import statistics
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from microsurf import generate_surface, write_surface
from microsurf.errors import MicrosurfError

from ..mitsuba import renderer
from . import efficiency, growth, report
from .rows import Row, of_ratio
from .sides import KD, Player, Turn

Array = NDArray[np.float64]

THETAS = (0.0, 60.0, 80.0)
VARIANTS = {"default": "without Embree's robust mode", "independent": "with independent origins"}
AGREEMENT_CELLS, AGREEMENT_BATCHES = 256, 32
Z = 4.6
"""Of t with 50 degrees of freedom, two-sided: a false alarm in 300 runs of 9 × 13 figures."""
SPEED, SPEED_MEDIAN, INSIDE = 3.0, 4.0, 0.65
EFFICIENCY, EFFICIENCY_BODY = 4.0, 10.0


@dataclass(frozen=True)
class Mesh:
    """One of the benchmark's surfaces."""

    gamma: float
    sigma: float
    cells: int

    @property
    def name(self) -> str:
        """How tables call it."""
        return f"{self.cells}², γ = {self.gamma:g}, σ = {self.sigma:g}"


@dataclass(frozen=True)
class BenchEffort:
    """How much to do.

    A ratio of variances from K and K' batches has a relative standard error near
    √(2/(K−1) + 2/(K'−1)): 0.29 from 32 and 96. Ours builds the mesh anew for each.
    """

    meshes: tuple[Mesh, ...]
    turns: int
    turn_paths: int
    batches_ours: int
    batches_theirs: int
    batch_paths: int
    energy_batches: int
    sizes: tuple[int, ...]
    growth_paths: int


FULL = BenchEffort(
    (Mesh(8.0, 0.7, 512), Mesh(2.0, 0.3, 1024), Mesh(40.0, 1.0, 1024)),
    turns=4,
    turn_paths=2**21,
    batches_ours=32,
    batches_theirs=96,
    batch_paths=2**18,
    energy_batches=4,
    sizes=(128, 256, 512, 1024, 2048, 4096),
    growth_paths=2**22,
)
QUICK = BenchEffort(
    tuple(Mesh(mesh.gamma, mesh.sigma, 128) for mesh in FULL.meshes),
    turns=2,
    turn_paths=2**20,
    batches_ours=12,
    batches_theirs=12,
    batch_paths=2**17,
    energy_batches=2,
    sizes=(128, 256, 512),
    growth_paths=2**20,
)


def agree(mesh: Mesh, effort: BenchEffort) -> list[Row]:
    """Whether the two engines see the same, before they are timed: z of every albedo.

    On a mesh of 256² cells, with the light at φ = 0 for both.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "surface.npz"
        write_surface(generate_surface(mesh.gamma, mesh.sigma, cells=AGREEMENT_CELLS, seed=1), path)
        name = f"{AGREEMENT_CELLS}², γ = {mesh.gamma:g}, σ = {mesh.sigma:g}"
        fluxes = []
        for kind in ("ours-fixed", "theirs"):
            with Player(kind, path, mesh.sigma) as player:
                fluxes.append(_batches(player, AGREEMENT_BATCHES, effort, f"{name}: {kind}")[0])
    rows = []
    for a, theta in enumerate(THETAS):
        ours, theirs = (efficiency.figures(flux[:, a]) for flux in fluxes)
        z = efficiency.agreement(ours, theirs, effort.batch_paths)
        worst = float(np.nanmax(np.abs(z)))
        rows.append(
            Row(name, theta, "agreement: z of the albedos, the largest", worst, Z, at_most=True)
        )
    return rows


def compare(mesh: Mesh, effort: BenchEffort) -> list[Row]:
    """Rows of one mesh."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "surface.npz"
        write_surface(generate_surface(mesh.gamma, mesh.sigma, cells=mesh.cells, seed=1), path)
        with Player("ours", path, mesh.sigma) as ours, Player("theirs", path, mesh.sigma) as theirs:
            mine, rays = _batches(ours, effort.batches_ours, effort, f"{mesh.name}: ours")
            other, other_rays = _batches(
                theirs, effort.batches_theirs, effort, f"{mesh.name}: theirs"
            )
            rows = _memory(mesh, ours, theirs)
            speeds: list[float] = []
            for theta in THETAS:
                found = _speed(mesh, theta, ours, theirs, effort)
                # Batches a second, ours over theirs.
                speeds.append(found[0].ratio * other_rays / rays)
                rows += found
            rows += _energy(mesh, ours, theirs, effort)
    for a, (theta, speed) in enumerate(zip(THETAS, speeds, strict=True)):
        rows += _efficiencies(mesh, theta, mine[:, a], other[:, a], speed, effort.batch_paths)
    return rows


def _batches(player: Player, count: int, effort: BenchEffort, name: str) -> tuple[Array, float]:
    """Trace independent batches.

    Returns their fluxes, shape (batches, angles, order, kind, ring, sector), and the
    light rays of each batch and angle.
    """
    steps = tqdm(range(count), desc=name, unit=" batches", disable=None)
    runs = [player.ask("batch", THETAS, KD, effort.batch_paths, k) for k in steps]
    return np.stack([run.flux for run in runs]), runs[0].light_rays


def _memory(mesh: Mesh, ours: Player, theirs: Player) -> list[Row]:
    peaks = [player.ask("peak") / 2**20 for player in (ours, theirs)]
    own = [
        peak - player.baseline / 2**20 for peak, player in zip(peaks, (ours, theirs), strict=True)
    ]
    return [
        Row(mesh.name, None, name, a / b, ours=a, theirs=b, unit="MiB")
        for name, (a, b) in (("peak memory", peaks), ("peak memory above imports", own))
    ]


def _speed(
    mesh: Mesh, theta: float, ours: Player, theirs: Player, effort: BenchEffort
) -> list[Row]:
    """Rows of one case's turns; the first one's ratio is that of light rays a second."""
    mine: list[Turn] = []
    others: dict[str, list[Turn]] = {variant: [] for variant in ("", *VARIANTS)}
    name = f"{mesh.name}, θ = {theta:g}°"
    for k in tqdm(range(effort.turns), desc=name, unit=" turns", disable=None):
        mine.append(ours.ask("turn", theta, effort.turn_paths, k))
        for variant, turns in others.items():
            turns.append(theirs.ask("turn", theta, effort.turn_paths, k, variant))
    rows = [
        _turns_row(mesh, theta, "light rays a second", mine, others[""], rays_a_second),
        _turns_row(mesh, theta, "paths a second", mine, others[""], paths_a_second, SPEED),
    ]
    for variant, words in VARIANTS.items():
        quantity = f"paths a second, theirs {words}"
        rows.append(_turns_row(mesh, theta, quantity, mine, others[variant], paths_a_second))
    inside = statistics.median(turn.embree_ratio or 0.0 for turn in mine)
    rows.append(Row(mesh.name, theta, "tracing time inside Embree", inside, INSIDE, ours=inside))
    lost = [
        sum(turn.lost for turn in side) / sum(turn.light_rays for turn in side)
        for side in (mine, others[""])
    ]
    rows.append(
        Row(
            mesh.name, theta, "lost paths", lost[0], 0.0,
            at_most=True, ours=lost[0], theirs=lost[1],
        )
    )  # fmt: skip
    return rows


def rays_a_second(turn: Turn) -> float:
    """Light rays: what comes in."""
    return turn.light_rays / turn.seconds


def paths_a_second(turn: Turn) -> float:
    """Paths: what light rays are split into, by whoever splits them."""
    return turn.paths / turn.seconds


def _turns_row(
    mesh: Mesh,
    theta: float,
    quantity: str,
    mine: list[Turn],
    others: list[Turn],
    speed: Callable[[Turn], float],
    target: float | None = None,
) -> Row:
    """Median of the turns' ratios of a speed."""
    return Row(
        mesh.name,
        theta,
        quantity,
        statistics.median(speed(a) / speed(b) for a, b in zip(mine, others, strict=True)),
        target,
        ours=statistics.median(map(speed, mine)) / 1e6,
        theirs=statistics.median(map(speed, others)) / 1e6,
        unit="10⁶/s",
    )


def _energy(mesh: Mesh, ours: Player, theirs: Player, effort: BenchEffort) -> list[Row]:
    """Albedo + lost − 1 at Kd = 1, where nothing is absorbed, with its standard error."""
    rows = []
    sides = []
    for player in (ours, theirs):
        runs = [
            player.ask("batch", THETAS, 1.0, effort.batch_paths, k)
            for k in range(effort.energy_batches)
        ]
        sides.append(np.array([run.flux.sum((1, 2, 3, 4)) + run.lost - 1 for run in runs]))
    for a, theta in enumerate(THETAS):
        mean = [float(side[:, a].mean()) for side in sides]
        error = [float(side[:, a].std(ddof=1) / np.sqrt(len(side))) for side in sides]
        for who, value, spread in zip(("ours", "theirs"), mean, error, strict=True):
            rows.append(
                Row(
                    mesh.name, theta, f"energy error at Kd = 1, {who}", value,
                    low=value - 2 * spread, high=value + 2 * spread,
                )
            )  # fmt: skip
    return rows


def _efficiencies(
    mesh: Mesh, theta: float, ours: Array, theirs: Array, speed: float, paths: int
) -> list[Row]:
    """Efficiencies of one case from batches of shape (batches, order, kind, ring, sector)."""
    rng = np.random.default_rng(0)
    rows = []
    mine, other = efficiency.figures(ours), efficiency.figures(theirs)
    for q, name in enumerate(efficiency.FIGURES):
        ratio = efficiency.figure_ratio(mine[:, q], other[:, q], speed, paths)
        rows += of_ratio(mesh.name, theta, f"efficiency: {name}", ratio, EFFICIENCY)
    pairs = zip(efficiency.LOBES, efficiency.lobes(ours), efficiency.lobes(theirs), strict=True)
    for name, a, b in pairs:
        ratio = efficiency.lobe_ratio(a, b, speed, paths, rng)
        target = EFFICIENCY_BODY if "body" in name else EFFICIENCY
        rows += of_ratio(mesh.name, theta, f"efficiency: {name}", ratio, target)
    return rows


def main() -> None:
    """Run it and write the tables and plots."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="small meshes, rough figures")
    parser.add_argument("--out", type=Path, default=report.FOLDER, help="folder to write into")
    arguments = parser.parse_args()
    effort = QUICK if arguments.quick else FULL
    try:
        renderer.load()
    except MicrosurfError as error:
        sys.exit(f"bench: {error}")
    rows = [row for mesh in effort.meshes for row in agree(mesh, effort)]
    rows += [row for mesh in effort.meshes for row in compare(mesh, effort)]
    speeds = [row.ratio for row in rows if row.quantity == "paths a second"]
    rows.append(Row("all", None, "median paths a second", statistics.median(speeds), SPEED_MEDIAN))
    sizes = growth.with_cells(effort.sizes, effort.growth_paths)
    threads = growth.with_threads(effort.meshes[0].cells, effort.turn_paths // 2, effort.turns)
    rows += growth.rows(sizes, threads)
    report.write(arguments.out, rows, sizes, threads)


if __name__ == "__main__":
    main()
