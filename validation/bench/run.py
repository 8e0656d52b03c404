"""Compare our exact engine with our Embree engine and Mitsuba 3 on the same meshes, turn by turn.

    make bench                         # half an hour; writes reports/bench
    python -m validation.bench.run --quick --out DIR   # a minute, small meshes, rough figures

Speeds are by processor time, so that a busy machine hardly shows; growth with threads wants a
quiet one. Wants what mitsuba/renderer.py wants.
"""

import argparse
import statistics
import sys
import tempfile
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from microsurf import generate_surface, write_surface
from microsurf.errors import MicrosurfError

from ..mitsuba import renderer
from . import efficiency, growth, report
from .rows import Row, of_ratio
from .sides import EMBREE, EXACT, KD, MITSUBA, RIVALS, Player, Turn

Array = NDArray[np.float64]

THETAS = (0.0, 60.0, 80.0)
VARIANTS = {"default": "without Embree's robust mode", "independent": "with independent origins"}
AGREEMENT_CELLS, AGREEMENT_BATCHES = 256, 32
Z = 4.8
"""Of t with 50 degrees of freedom, two-sided: a false alarm in 300 runs of 18 × 13 figures."""


@dataclass(frozen=True)
class Target:
    """Efficiency that the exact engine shall have in each case, and in the middle one."""

    worst: float
    median: float | None = None


_LATER = tuple(f"albedo of order {order}" for order in ("2", "3", "4+"))
TARGETS = {
    EMBREE: {
        "total albedo": Target(3, 5),
        **dict.fromkeys(_LATER, Target(2, 4)),
        "bins of the order-1 specular lobe": Target(6, 8),
        "bins of the order-1 body lobe": Target(1.5, 3),
    },
    MITSUBA: {
        "total albedo": Target(3),
        "albedo of order 1": Target(2),
        **dict.fromkeys(_LATER, Target(1)),
        "bins of the order-1 specular lobe": Target(10),
        "bins of the order-1 body lobe": Target(8),
    },
}


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
    turn_paths=2**20,
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
    """Whether all see the same, before they are timed: z of every albedo against Mitsuba's.

    On a mesh of 256² cells, with the light at φ = 0 for all.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "surface.npz"
        write_surface(generate_surface(mesh.gamma, mesh.sigma, cells=AGREEMENT_CELLS, seed=1), path)
        name = f"{AGREEMENT_CELLS}², γ = {mesh.gamma:g}, σ = {mesh.sigma:g}"
        fluxes = {}
        for kind in (f"{EXACT}-fixed", f"{EMBREE}-fixed", MITSUBA):
            with Player(kind, path, mesh.sigma) as player:
                fluxes[kind] = _batches(player, AGREEMENT_BATCHES, effort, f"{name}: {kind}")[0]
    rows = []
    theirs = fluxes.pop(MITSUBA)
    for (kind, flux), (a, theta) in product(fluxes.items(), enumerate(THETAS)):
        z = efficiency.agreement(
            efficiency.figures(flux[:, a]), efficiency.figures(theirs[:, a]), effort.batch_paths
        )
        engine = kind.partition("-")[0]
        quantity = f"agreement with Mitsuba, {engine}: z of the albedos, the largest"
        rows.append(Row(name, theta, quantity, float(np.nanmax(np.abs(z))), Z, at_most=True))
    return rows


def compare(mesh: Mesh, effort: BenchEffort) -> list[Row]:
    """Rows of one mesh."""
    with tempfile.TemporaryDirectory() as folder, ExitStack() as open_players:
        path = Path(folder) / "surface.npz"
        write_surface(generate_surface(mesh.gamma, mesh.sigma, cells=mesh.cells, seed=1), path)
        players = {
            kind: open_players.enter_context(Player(kind, path, mesh.sigma))
            for kind in (EXACT, *RIVALS)
        }
        fluxes, rays = {}, {}
        for kind, player in players.items():
            count = effort.batches_theirs if kind == MITSUBA else effort.batches_ours
            fluxes[kind], rays[kind] = _batches(player, count, effort, f"{mesh.name}: {kind}")
        rows = _memory(mesh, players)
        # Batches a second of the exact engine over a rival's.
        speeds: dict[tuple[str, float], float] = {}
        for theta in THETAS:
            turns = _turns(mesh, theta, players, effort)
            for rival in RIVALS:
                of_rival = _speed(mesh, theta, rival, turns)
                speeds[rival, theta] = of_rival[0].ratio * rays[rival] / rays[EXACT]
                rows += of_rival
            rows.append(_lost(mesh, theta, turns))
        rows += _energy(mesh, players, effort)
    for (rival, theta), speed in speeds.items():
        a = THETAS.index(theta)
        mine, other = fluxes[EXACT][:, a], fluxes[rival][:, a]
        rows += _efficiencies(mesh, theta, rival, mine, other, speed, effort.batch_paths)
    return rows


def _batches(player: Player, count: int, effort: BenchEffort, name: str) -> tuple[Array, float]:
    """Trace independent batches.

    Returns their fluxes, shape (batches, angles, order, kind, ring, sector), and the
    light rays of each batch and angle.
    """
    steps = tqdm(range(count), desc=name, unit=" batches", disable=None)
    runs = [player.ask("batch", THETAS, KD, effort.batch_paths, k) for k in steps]
    return np.stack([run.flux for run in runs]), runs[0].light_rays


def _memory(mesh: Mesh, players: dict[str, Player]) -> list[Row]:
    peaks = {kind: player.ask("peak") / 2**20 for kind, player in players.items()}
    above = {kind: peak - players[kind].baseline / 2**20 for kind, peak in peaks.items()}
    return [
        Row(
            mesh.name, None, f"{name}, over {words}", of[EXACT] / of[rival],
            ours=of[EXACT], theirs=of[rival], unit="MiB",
        )
        for name, of in (("peak memory", peaks), ("peak memory above imports", above))
        for rival, words in RIVALS.items()
    ]  # fmt: skip


def _turns(
    mesh: Mesh, theta: float, players: dict[str, Player], effort: BenchEffort
) -> dict[str, list[Turn]]:
    """Turns of all in rotation, by player; Mitsuba's variants by their own names."""
    turns: dict[str, list[Turn]] = {kind: [] for kind in (*players, *VARIANTS)}
    name = f"{mesh.name}, θ = {theta:g}°"
    for k in tqdm(range(effort.turns), desc=name, unit=" turns", disable=None):
        for kind, player in players.items():
            turns[kind].append(player.ask("turn", theta, effort.turn_paths, k))
        for variant in VARIANTS:
            turn = players[MITSUBA].ask("turn", theta, effort.turn_paths, k, variant)
            turns[variant].append(turn)
    return turns


def _speed(mesh: Mesh, theta: float, rival: str, turns: dict[str, list[Turn]]) -> list[Row]:
    """Rows of one case's turns against a rival; the first one's ratio is that of light rays."""
    over = f", over {RIVALS[rival]}"
    rows = [
        _turns_row(mesh, theta, f"{name} a second{over}", turns[EXACT], turns[rival], speed)
        for name, speed in (("light rays", rays_a_second), ("paths", paths_a_second))
    ]
    if rival == MITSUBA:
        for variant, words in VARIANTS.items():
            quantity = f"paths a second{over} {words}"
            rows.append(
                _turns_row(mesh, theta, quantity, turns[EXACT], turns[variant], paths_a_second)
            )
    return rows


def _lost(mesh: Mesh, theta: float, turns: dict[str, list[Turn]]) -> Row:
    """Light that the exact engine and Mitsuba lose; of the first nothing may be."""
    lost = [
        sum(turn.lost for turn in turns[kind]) / sum(turn.light_rays for turn in turns[kind])
        for kind in (EXACT, MITSUBA)
    ]
    return Row(
        mesh.name, theta, "lost paths", lost[0], 0.0, at_most=True, ours=lost[0], theirs=lost[1]
    )


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
) -> Row:
    """Median of the turns' ratios of a speed."""
    return Row(
        mesh.name,
        theta,
        quantity,
        statistics.median(speed(a) / speed(b) for a, b in zip(mine, others, strict=True)),
        ours=statistics.median(map(speed, mine)) / 1e6,
        theirs=statistics.median(map(speed, others)) / 1e6,
        unit="10⁶/s",
    )


def _energy(mesh: Mesh, players: dict[str, Player], effort: BenchEffort) -> list[Row]:
    """Albedo + lost − 1 at Kd = 1, where nothing is absorbed, with its standard error."""
    rows = []
    for kind, player in players.items():
        runs = [
            player.ask("batch", THETAS, 1.0, effort.batch_paths, k)
            for k in range(effort.energy_batches)
        ]
        excess = np.array([run.flux.sum((1, 2, 3, 4)) + run.lost - 1 for run in runs])
        for theta, values in zip(THETAS, excess.T, strict=True):
            mean = float(values.mean())
            spread = float(values.std(ddof=1) / np.sqrt(len(values)))
            quantity = f"energy error at Kd = 1, {kind}"
            rows.append(
                Row(mesh.name, theta, quantity, mean, low=mean - 2 * spread, high=mean + 2 * spread)
            )
    return rows


def _efficiencies(
    mesh: Mesh, theta: float, rival: str, ours: Array, theirs: Array, speed: float, paths: int
) -> list[Row]:
    """Efficiencies of one case from batches of shape (batches, order, kind, ring, sector)."""
    rng = np.random.default_rng(0)
    mine, other = efficiency.figures(ours), efficiency.figures(theirs)
    ratios = {
        name: efficiency.figure_ratio(mine[:, q], other[:, q], speed, paths)
        for q, name in enumerate(efficiency.FIGURES)
    }
    pairs = zip(efficiency.LOBES, efficiency.lobes(ours), efficiency.lobes(theirs), strict=True)
    for name, a, b in pairs:
        ratios[name] = efficiency.lobe_ratio(a, b, speed, paths, rng)
    rows = []
    for name, ratio in ratios.items():
        target = TARGETS[rival].get(name)
        quantity = f"efficiency over {RIVALS[rival]}: {name}"
        rows += of_ratio(mesh.name, theta, quantity, ratio, target.worst if target else None)
    return rows


def medians(rows: list[Row]) -> list[Row]:
    """Rows of the targets that the middle case has."""
    found = []
    for rival, targets in TARGETS.items():
        for name, target in targets.items():
            quantity = f"efficiency over {RIVALS[rival]}: {name}"
            ratios = [row.ratio for row in rows if row.quantity == quantity]
            if target.median is not None and ratios:
                middle = statistics.median(ratios)
                found.append(Row("all", None, f"{quantity}, median", middle, target.median))
    return found


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
    rows += medians(rows)
    sizes = growth.with_cells(effort.sizes, effort.growth_paths)
    threads = growth.with_threads(effort.meshes[0].cells, effort.turn_paths // 2, effort.turns)
    rows += growth.rows(sizes, threads)
    report.write(arguments.out, rows, sizes, threads)


if __name__ == "__main__":
    main()
