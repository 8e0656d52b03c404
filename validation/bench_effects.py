"""What each effect costs: every engine with all of them, and with one left out, turn by turn.

    make bench                           # runs this too; writes reports/bench/effects.*
    python validation/bench_effects.py   # this alone, some minutes

What a scene does not require is decided once (`Scene.requires`) and must not run. Seconds are
those of the processor, not of the clock, so that a busy machine hardly shows; turns are taken in
rotation, and ratios are between what stands side by side in one turn.
"""

import argparse
import csv
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from tqdm import tqdm

from microsurf import generate_surface, model
from microsurf.scene import Effects, Light, Material, Roughness, Scene
from microsurf.surface.heightfield import mesh
from microsurf.trace import paths, pieces
from microsurf.trace.embree import EmbreeTile
from microsurf.trace.grid import from_heights
from microsurf.trace.plane import Plane

FOLDER = Path(__file__).parents[1] / "reports" / "bench"
MESHES = ((8.0, 0.7, 512), (2.0, 0.3, 1024), (40.0, 1.0, 1024))
"""γ, σ and cells of the benchmark's surfaces."""
THETA = 60.0
LIGHT_RAYS = 2**17
WALKS = 2**18
TURNS = 7
FULL = "everything"


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
    """Processor time in nanoseconds: for each path of light, and each ray outside Embree."""

    path: float
    ray: float | None = None


class _Clock:
    """Stands for `time` in the tracer: seconds of this thread alone."""

    perf_counter = staticmethod(time.thread_time)


def traced(gamma: float, sigma: float, cells: int) -> Callable[[Scene, int], Cost]:
    """Trace one surface; a scene without roughness has the plane instead."""
    made = mesh(generate_surface(gamma, sigma, cells=cells, seed=1))
    tile = EmbreeTile(from_heights(made.heights, made.flipped))

    def run(scene: Scene, turn: int) -> Cost:
        facet = pieces.facet_of(scene)
        meets = tile if scene.requires.roughness else Plane()
        tally = paths.trace(
            meets, THETA, 0.0, facet, LIGHT_RAYS * facet.branches, np.random.default_rng(turn)
        )
        seconds, inside = tally.seconds
        outside = 1e9 * (seconds - inside) / tally.rays
        return Cost(1e9 * seconds / tally.light, outside if meets is tile else None)

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
        ratios = sorted(turn[key].path / turn[FULL].path for turn in turns)
        row: dict[str, object] = {
            "engine": name,
            "without": key,
            "path": statistics.median(ratios),
            "path_low": ratios[0],
            "path_high": ratios[-1],
        }
        rays = [(turn[key].ray, turn[FULL].ray) for turn in turns]
        outside = sorted(mine / full for mine, full in rays if mine and full)
        if outside:
            row |= {"ray": statistics.median(outside), "ray_low": outside[0]}
            row["ray_high"] = outside[-1]
        rows.append(row)
    return rows


def measure() -> list[dict[str, object]]:
    """All engines."""
    paths.time = _Clock  # type: ignore[misc, assignment]
    rows = []
    for gamma, sigma, cells in MESHES:
        scene = Scene(roughness=Roughness(gamma, (sigma,)), light=Light((THETA,)))
        name = f"traced, {cells}², γ = {gamma:g}, σ = {sigma:g}"
        rows += compare(name, traced(gamma, sigma, cells), scene)
    scene = Scene(roughness=Roughness(2.0, (0.5,)), light=Light((THETA,)))
    for kind in model.KINDS:
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
    return [
        {
            "engine": "smith, order 1, four azimuths",
            "without": "anisotropy",
            "path": statistics.median(ratios),
            "path_low": ratios[0],
            "path_high": ratios[-1],
        }
    ]


_METHOD = (
    "Processor time with one effect left out over that with all of them (n = 1.5, Kd = 0.8, "
    f"all orders), θ = {THETA:g}°, one thread, {TURNS} turns in rotation: median and range. "
    "*Path*: for each light ray, walk or prediction: what a user pays. *Ray*: for each ray "
    "traced, outside Embree; leaving out an effect also changes how many rays a light ray "
    "takes, and which. Without roughness the plane stands for the mesh, and a prediction is a "
    "closed form."
)


def text(rows: list[dict[str, object]]) -> str:
    """The table for people."""
    lines = [
        "# What each effect costs",
        "",
        _METHOD,
        "",
        "| engine | without | path | ray outside Embree |",
        "|---|---|---|---|",
    ]
    lines += [
        f"| {row['engine']} | {row['without']} | {_cell(row, 'path')} | {_cell(row, 'ray')} |"
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
    columns = ("engine", "without", "path", "path_low", "path_high", "ray", "ray_low", "ray_high")
    with (out / "effects.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, columns, lineterminator="\n")
        writer.writeheader()
        writer.writerows(
            {k: f"{v:.4g}" if isinstance(v, float) else v for k, v in row.items()} for row in rows
        )
    (out / "effects.md").write_text(text(rows), encoding="utf-8")


if __name__ == "__main__":
    main()
