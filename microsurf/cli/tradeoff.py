"""microsurf tradeoff: every method's error against its cost, on a scene."""

from pathlib import Path
from typing import Any

import click

from ..analysis.stages import Run
from ..analysis.tradeoff.effort import EFFORTS
from ..analysis.tradeoff.study import QUANTITIES, Tradeoff, check, tradeoff
from ..report import make_folder
from ..report.figures.pareto import figure, rows, within
from ..scene import Scene
from .options import INPUT, PATH, allow_truncated_tail, as_json, check_tail, effort, resume, seed
from .output import show, write
from .save import rounded, save_study


@click.command("tradeoff")
@click.argument("scene", type=INPUT, metavar="SCENE.toml")
@click.option("--out", type=PATH, help="Folder; default reports/tradeoff/ and the scene's name.")
@effort
@seed
@resume
@allow_truncated_tail
@as_json
def tradeoff_command(
    scene: Path,
    out: Path | None,
    effort: str,
    seed: int,
    resume: bool,
    allow_truncated_tail: bool,
    as_json: bool,
) -> None:
    """Run every model, walk and mesh on a scene, and show what accuracy costs.

    Example: microsurf tradeoff my_scene.toml
    """
    requested = Scene.read(scene)
    check(requested)
    stated = check_tail(requested, allow_truncated_tail)
    out = Path("reports/tradeoff") / scene.stem if out is None else out
    make_folder(out)
    run = Run(out, resume=resume)
    stages = run.of_scene(requested, command="tradeoff", effort=effort, seed=seed)
    result = tradeoff(requested, EFFORTS[effort], seed=seed, progress=True, stages=stages)
    values = (
        _values(result)
        | {"scene": scene.stem, "effort": effort, "seed": seed, "out": str(out)}
        | stated
    )
    _save(values, out)
    run.finish()
    if as_json:
        show(values, as_json=True)
        return
    write("\n".join(_lines(result)))
    write(f"\nfigure: {out / 'tradeoff.png'}   ({result.seconds:.0f} s)")


def _values(result: Tradeoff) -> dict[str, Any]:
    table = rows(result)
    reference = result.reference
    return {
        "rungs": table,
        "frontier": {
            name: [
                row["rung"]
                for row in sorted(table, key=lambda row: row["seconds"])
                if row["quantity"] == name and row["dominated_by"] is None
            ]
            for name in result.points
        },
        "within": within(table),
        "reference": {
            "surfaces": reference.surfaces,
            "cells": reference.surface.cells,
            "correlation": reference.surface.correlation,
            "paths": reference.paths,
            "half_width": reference.half_width,
            "seconds": reference.seconds,
        },
        "seconds": result.seconds,
    }


def _save(values: dict[str, Any], out: Path) -> None:
    picture = figure(values["rungs"], values["scene"])
    save_study(out, "tradeoff", picture, rounded(values["rungs"], 5), values)


def _lines(result: Tradeoff) -> list[str]:
    reference = result.reference
    known = ", ".join(f"{name} ± {100 * v:.2g} %" for name, v in reference.half_width.items())
    lines = [
        f"{reference.text}: {known}",
        "seconds: of the processor, an angle; errors: the worst angle, with the method's own noise",
    ]
    width = max(len(run.method.name) for run in result.runs)
    table = rows(result)
    for name in result.points:
        unit, scale = ("degrees", 1) if name in ("position", "width") else ("%", 100)
        lines.append(f"\n{QUANTITIES[name].split(',')[0]}, in {unit} (95 % interval)")
        mine = [row for row in table if row["quantity"] == name]
        for row in sorted(mine, key=lambda row: row["seconds"]):
            behind = f"dominated by {row['dominated_by']}" if row["dominated_by"] else "frontier"
            lines.append(
                f"  {row['rung']:<{width}}  {row['seconds']:8.3g} s  {scale * row['error']:8.3g} "
                f"({scale * row['error_low']:.3g} … {scale * row['error_high']:.3g})  {behind}"
            )
    lines.append("\nto stay below, with 95 % confidence")
    for row in within(table):
        what = f"  {100 * row['level']:g} % of the {row['quantity']}: "
        cost = f"{row['rung']}, {row['seconds']:.3g} s" if row["rung"] else "nothing shown"
        lines.append(what + cost)
    return lines
