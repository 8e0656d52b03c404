"""microsurf convergence: what mesh, tile, realisations and rays leave as error."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from .. import memory
from ..analysis.convergence.steps import EFFORTS
from ..analysis.convergence.study import Convergence, Row, check, converge
from ..analysis.stages import Run
from ..report import make_folder
from ..report.figures.convergence import draw
from ..scene import Scene
from ..surface import notes_on_file
from ..trace import engine
from .options import (
    INPUT,
    PATH,
    allow_truncated_tail,
    as_json,
    check_from_file,
    check_tail,
    resume,
    say,
    seed,
    workers,
)
from .output import show, write
from .save import rounded, save_study

STUDIES = ("mesh", "tile", "realisations", "rays")
_COLUMNS = (
    "study", "cells", "correlation", "tile", "realisations", "groups", "paths", "repeats",
    "quantity", "theta_i", "phi_i", "kd",
    "value", "error", "deviation", "claimed", "difference", "low", "high",
)  # fmt: skip


@click.command("convergence")
@click.argument("scene", type=INPUT, metavar="SCENE.toml")
@click.option("--out", type=PATH, help="Folder; default reports/convergence/ and the scene's name.")
@click.option(
    "--effort",
    type=click.Choice(list(EFFORTS)),
    default="quick",
    show_default=True,
    help="quick: minutes, meshes up to 1024 cells a side; full: more of all, up to 2048.",
)
@allow_truncated_tail
@seed
@workers
@resume
@as_json
def convergence_command(
    scene: Path,
    out: Path | None,
    effort: str,
    allow_truncated_tail: bool,
    seed: int,
    workers: int | None,
    resume: bool,
    as_json: bool,
) -> None:
    """Refine the mesh, enlarge the tile, add realisations and rays, and show what each leaves.

    Example: microsurf convergence my_scene.toml --effort quick
    """
    requested = Scene.read(scene)
    check_tail(requested, allow_truncated_tail)
    check(requested)
    _check_size(requested, EFFORTS[effort].cells)
    out = Path("reports/convergence") / scene.stem if out is None else out
    make_folder(out)
    run = Run(out, resume=resume)
    stages = run.of_scene(requested, command="convergence", effort=effort, seed=seed)
    result = converge(
        requested, EFFORTS[effort], seed=seed, workers=workers, progress=True, stages=stages
    )
    values: dict[str, Any] = {
        "scene": scene.stem, "effort": effort, "seed": seed, **asdict(result), "out": str(out),
    }  # fmt: skip
    _save(result, values, out)
    run.finish()
    if as_json:
        show(values, as_json=True)
        return
    write("\n".join(_summary(requested, result)))
    write(f"\nfigure: {out / 'convergence.png'}   ({result.seconds:.0f} s)")


def _check_size(scene: Scene, most: int) -> None:
    """Refuse what would not fit, and a file that is not there, before any work."""
    if scene.surface.file is not None:
        check_from_file(scene, {})
        say(notes_on_file(scene))
    elif scene.requires.roughness:
        cells = max(most, scene.surface.cells)
        memory.require(cells**2, engine.of_scene(scene).bytes_per_cell, "surface.cells")


def _save(convergence: Convergence, values: dict[str, Any], out: Path) -> None:
    table = [
        dict.fromkeys(_COLUMNS) | {"study": study} | row
        for study in STUDIES
        for row in getattr(convergence, study)
    ]
    figure = draw(convergence, values["scene"])
    save_study(out, "convergence", figure, rounded(table, 7), values)


def _summary(scene: Scene, convergence: Convergence) -> list[str]:
    """What the scene's own settings leave, for people."""
    surface = scene.surface
    lines = [f"note: {convergence.note}"] if convergence.note else []
    if convergence.mesh:
        lines.append(
            f"What {surface.cells} cells, L = {surface.correlation:g}, {surface.realisations} "
            "realisations leave, in %: mesh and tile as differences to the finest measured "
            "(95 % interval), surfaces and rays as standard errors"
        )
    head = ["quantity", "θ_i", "φ_i", "Kd", "mesh", "tile", "surfaces", "rays"]
    table = [head, *(_cells(row) for row in convergence.left)]
    widths = [max(len(row[k]) for row in table) for k in range(len(head))]
    lines += ["  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)) for row in table]
    if convergence.left:
        lines.append(f"(rays: {convergence.left[0]['rays_paths']} paths an angle and surface)")
    resolved = [row for row in convergence.orders if row["order"] is not None]
    if convergence.orders:
        lines.append(
            f"order of convergence: known for {len(resolved)} of {len(convergence.orders)} "
            "(differences of at least three standard errors and one sign)"
        )
    lines += [
        f"  {row['study']}, {row['quantity']}, θ_i {row['theta_i']:g}: {row['order']:.2f} "
        f"({row['low']:.2f} … {row['high']:.2f})"
        for row in resolved
    ]
    return lines


def _cells(row: Row) -> list[str]:
    def interval(study: str) -> str:
        if study not in row:
            return "–"
        ends = (row[study], row[f"{study}_low"], row[f"{study}_high"])
        return "{:+.2f} ({:+.2f} … {:+.2f})".format(*(100 * v for v in ends))

    def error(study: str) -> str:
        return f"{100 * row[study]:.3f}" if study in row else "–"

    cells = [row["quantity"], *(f"{row[key]:g}" for key in ("theta_i", "phi_i", "kd"))]
    return [*cells, interval("mesh"), interval("tile"), error("realisations"), error("rays")]
