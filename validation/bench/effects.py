"""What each effect costs: every engine with all of them, and with one left out, turn by turn.

    make bench                           # runs this too; writes reports/bench/effects.*
    python -m validation.bench.effects   # this alone, some minutes

What a scene does not require is decided once (`Scene.requires`) and must not run. Seconds are
those of the processor, not of the clock, so that a busy machine hardly shows; turns are taken in
rotation, and ratios are between what stands side by side in one turn.
"""

import argparse
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from tqdm import tqdm

from microsurf import generate_surface, model
from microsurf.cli.save import rounded, save
from microsurf.scene import Effects, Light, Material, Roughness, Scene
from microsurf.surface.heightfield import mesh
from microsurf.trace import wavefront, work_items
from microsurf.trace.embree import EmbreeTile
from microsurf.trace.grid import from_heights
from microsurf.trace.plane import Plane

FOLDER = Path(__file__).parents[2] / "reports" / "bench"
MESHES = ((8.0, 0.7, 512), (2.0, 0.3, 1024), (40.0, 1.0, 1024))
"""γ, σ and cells of the benchmark's surfaces."""
THETA = 60.0
LIGHT_RAYS = 2**17
WALKS = 2**18
TURNS = 7
FULL = "everything"
COSTS = "path", "outside", "ray"


def without() -> dict[str, Callable[[Scene], Scene]]:
    """Each effect, and how a scene says that it is not there."""
    return {
        FULL: lambda scene: scene,
        "no interface (n = 1): body alone": lambda s: replace(s, material=Material(1.0, (0.8,))),
        "no substrate (Kd = 0): specular alone": lambda s: replace(
            s, material=Material(1.5, (0.0,))
        ),
        "one order": lambda s: replace(s, effects=Effects(multiple_scattering=False)),
        "no roughness (σ = 0)": lambda s: replace(s, roughness=Roughness(2.0, (0.0,))),
    }


@dataclass(frozen=True)
class Cost:
    """Processor time in nanoseconds of each path of light; outside Embree of it and each ray."""

    path: float
    outside: float | None = None
    ray: float | None = None


class _Clock:
    """Stands for `time` in the tracer: seconds of this thread alone."""

    perf_counter = staticmethod(time.thread_time)


def traced(gamma: float, sigma: float, cells: int) -> Callable[[Scene, int], Cost]:
    """Trace one surface; a scene without roughness has the plane instead."""
    made = mesh(generate_surface(gamma, sigma, cells=cells, seed=1))
    tile = EmbreeTile(from_heights(made.heights, made.flipped))

    def run(scene: Scene, turn: int) -> Cost:
        facet = work_items.facet_optics(scene)
        target = tile if scene.requires.roughness else Plane()
        tally = wavefront.trace(
            target, THETA, 0.0, facet, LIGHT_RAYS * facet.branches, np.random.default_rng(turn)
        )
        seconds, inside = tally.seconds
        whole, outside = 1e9 * seconds / tally.light, 1e9 * (seconds - inside)
        if target is not tile:
            return Cost(whole)
        return Cost(whole, outside / tally.light, outside / tally.rays)

    return run


def walked(kind: str) -> Callable[[Scene, int], Cost]:
    """Walk among the facets of a model; σ = 0 is a closed form."""

    def run(scene: Scene, turn: int) -> Cost:
        begin = time.process_time()
        model.walk(scene, kind, walks=WALKS, seed=turn, workers=1)
        return Cost(1e9 * (time.process_time() - begin) / WALKS)

    return run


def predicted(scene: Scene, _: int) -> Cost:
    """Lobes of the first order, one incidence; the time is for all of it."""
    begin = time.process_time()
    model.predict(scene)
    return Cost(1e9 * (time.process_time() - begin))


def compare(name: str, run: Callable[[Scene, int], Cost], scene: Scene) -> list[dict[str, object]]:
    """Rows of one engine: time without an effect over time with all, the median of the turns."""
    variants = {key: change(scene) for key, change in without().items()}
    for variant in variants.values():
        run(variant, 0)  # compiled, and in the cache
    turns = [
        {key: run(variant, turn) for key, variant in variants.items()}
        for turn in tqdm(range(TURNS), desc=name, unit=" turns", disable=None)
    ]
    rows = []
    for key in variants:
        row: dict[str, object] = {"engine": name, "without": key}
        for cost in COSTS:
            pairs = [(getattr(turn[key], cost), getattr(turn[FULL], cost)) for turn in turns]
            ratios = sorted(mine / full for mine, full in pairs if mine and full)
            if ratios:
                row |= _spread(cost, ratios)
        rows.append(row)
    return rows


def _spread(cost: str, ratios: list[float]) -> dict[str, float]:
    """Median and ends of sorted ratios."""
    return {cost: statistics.median(ratios), f"{cost}_low": ratios[0], f"{cost}_high": ratios[-1]}


def measure() -> list[dict[str, object]]:
    """All engines."""
    wavefront.time = _Clock  # type: ignore[attr-defined, assignment]
    rows = []
    for gamma, sigma, cells in MESHES:
        scene = Scene(roughness=Roughness(gamma, (sigma,)), light=Light((THETA,)))
        name = f"traced, {cells}², γ = {gamma:g}, σ = {sigma:g}"
        rows += compare(name, traced(gamma, sigma, cells), scene)
    scene = Scene(roughness=Roughness(2.0, (0.5,)), light=Light((THETA,)))
    for kind in model.all_orders():
        rows += compare(kind, walked(kind), scene)
    rows += compare("smith, order 1", predicted, scene)
    rows += _isotropy(scene)
    return rows


def _isotropy(scene: Scene) -> list[dict[str, object]]:
    """Four azimuths of incidence: where none matters, one prediction stands for all."""
    phis = Light((THETA,), (0.0, 30.0, 60.0, 90.0))
    stretched = replace(scene, light=phis, roughness=Roughness(2.0, (0.5, 0.5000001)))
    plain = replace(scene, light=phis)
    turns = [
        (predicted(stretched, 0).path, predicted(plain, 0).path) for _ in range(max(TURNS // 2, 3))
    ]
    ratios = sorted(plain / full for full, plain in turns)
    engine = {"engine": "smith, order 1, four azimuths", "without": "anisotropy"}
    return [{**engine, **_spread("path", ratios)}]


_METHOD = (
    "Processor time with one effect left out over that with all of them (n = 1.5, Kd = 0.8, "
    f"all orders), θ = {THETA:g}°, one thread, {TURNS} turns in rotation: median and range. "
    "*Path*: for each light ray, walk or prediction: what a user pays; *path outside Embree* is "
    "what of it is ours. *Ray outside Embree*: the latter for each ray traced; leaving out an "
    "effect also changes how many rays a light ray takes, and which: those of the mirror are the "
    "cheapest. Where the highest peaks stand far above the rest (γ = 2, 1024²) carrying rays "
    "round the period, which no effect needs less of, is a larger part of it. Without roughness "
    "the plane stands for the mesh, and a prediction is a closed form."
)


def text(rows: list[dict[str, object]]) -> str:
    """The table for people."""
    lines = [
        "# What each effect costs",
        "",
        _METHOD,
        "",
        "| engine | without | path | path outside Embree | ray outside Embree |",
        "|---|---|---|---|---|",
    ]
    lines += [
        f"| {row['engine']} | {row['without']} | "
        + " | ".join(_cell(row, cost) for cost in COSTS)
        + " |"
        for row in rows
        if row["without"] != FULL
    ]
    return "\n".join(lines) + "\n"


def _cell(row: dict[str, object], key: str) -> str:
    if key not in row:
        return ""
    return f"{row[key]:.3g} ({row[f'{key}_low']:.3g} … {row[f'{key}_high']:.3g})"


def main() -> None:
    """Run and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=FOLDER, help="folder to write into")
    out = parser.parse_args().out
    rows = measure()
    out.mkdir(parents=True, exist_ok=True)
    save(out, {"effects.csv": rounded(rows, 4), "effects.md": text(rows)})


if __name__ == "__main__":
    main()
