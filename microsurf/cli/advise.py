"""microsurf advise: the cheapest method that is good enough for a scene."""

from pathlib import Path
from typing import Any

import click

from ..analysis import il_assumption
from ..analysis.stages import Run
from ..analysis.tradeoff.effort import EFFORTS
from ..analysis.tradeoff.recommend import Judged, Recommendation, advise, check_tolerance
from ..analysis.tradeoff.study import CHOICES
from ..errors import InputError
from ..report import make_folder
from ..scene import Scene
from .options import (
    INPUT,
    PATH,
    allow_truncated_tail,
    as_json,
    check_tail,
    effort,
    resume,
    seed,
)
from .output import show, write


@click.command("advise")
@click.argument("scene", type=INPUT, metavar="SCENE.toml")
@click.option("--tolerance", type=float, required=True, help="Largest relative error, 1e-4 … 1.")
@click.option(
    "--quantity",
    type=click.Choice(CHOICES),
    default="albedo",
    show_default=True,
    help="Total albedo, height of the specular peak, or body lobe over its bins.",
)
@click.option("--out", type=PATH, help="Folder in which to keep what is finished, until all is.")
@effort
@seed
@resume
@allow_truncated_tail
@as_json
def advise_command(
    scene: Path,
    tolerance: float,
    quantity: str,
    out: Path | None,
    effort: str,
    seed: int,
    resume: bool,
    allow_truncated_tail: bool,
    as_json: bool,
) -> None:
    """Find the cheapest way to a reflectance whose measured error stays below a tolerance.

    Of a scene with two layers: whether IL facets in their place are good enough, by the atlas.

    Example: microsurf advise my_scene.toml --tolerance 0.02 --quantity albedo
    """
    requested = Scene.read(scene)
    stated = check_tail(requested, allow_truncated_tail)
    assumption = il_assumption.answer(requested, quantity)
    if requested.layers is not None:
        check_tolerance(tolerance)
        values = _of_layers(assumption, quantity, tolerance)
        show(values | stated, as_json=True) if as_json else write(assumption.text)
        return
    run, stages = None, None
    if out is not None:
        make_folder(out)
        run = Run(out, resume=resume)
        what = {"quantity": quantity, "tolerance": tolerance, "effort": effort, "seed": seed}
        stages = run.of_scene(requested, command="advise", **what)
    elif resume:
        raise InputError("--resume: goes with --out FOLDER, in which finished stages lie")
    result = advise(
        requested, tolerance, quantity, EFFORTS[effort], seed=seed, progress=True, stages=stages
    )
    if run is not None:
        run.finish()
    if as_json:
        more = {"il_assumption": il_assumption.as_json(assumption)}
        show(_values(result) | more | stated, as_json=True)
        return
    write("\n".join([*_lines(result), f"\n{assumption.text}"]))


def _of_layers(assumption: il_assumption.Answer, quantity: str, tolerance: float) -> dict[str, Any]:
    """The keys of every advice, for IL facets in the place of two layers; nothing is run."""
    of = il_assumption.as_json(assumption)
    good = assumption.deviation is not None and assumption.deviation.high <= tolerance
    return {
        "quantity": quantity,
        "tolerance": tolerance,
        "rung": "IL facets" if good else None,
        "error": of["error"],
        "error_ci": of["error_ci"],
        "seconds": 0.0,
        "alternatives": [],
        "il_assumption": of,
    }


def _values(recommendation: Recommendation) -> dict[str, Any]:
    best = recommendation.best
    return {
        "quantity": recommendation.quantity,
        "tolerance": recommendation.tolerance,
        "rung": recommendation.chosen.point.name if recommendation.chosen else None,
        "best": best.point.name,
        "error": best.error.value,
        "error_ci": [best.error.low, best.error.high],
        "error_below": best.error.below,
        "seconds": best.point.seconds,
        "alternatives": [_row(one) for one in recommendation.tried if one is not best],
        "not_run": recommendation.skipped,
        "effects": [vars(effect) for effect in recommendation.effects],
        "reference": {
            "surfaces": recommendation.reference.surfaces,
            "cells": recommendation.reference.surface.cells,
            "correlation": recommendation.reference.surface.correlation,
            "paths": recommendation.reference.paths,
            "half_width": recommendation.reference.half_width[recommendation.quantity],
            "seconds": recommendation.reference.seconds,
        },
        "note": recommendation.note,
        "total_seconds": recommendation.seconds,
    }


def _row(one: Judged) -> dict[str, Any]:
    return {
        "rung": one.point.name,
        "seconds": one.point.seconds,
        "error": one.error.value,
        "error_ci": [one.error.low, one.error.high],
        "verdict": one.verdict,
        "why": one.why,
    }


def _lines(recommendation: Recommendation) -> list[str]:
    reference = recommendation.reference
    best = recommendation.best
    if recommendation.chosen:
        head = f"use {best.point.name}: error of the {recommendation.quantity} {best.why}"
    else:
        head = f"nothing shown to hold {recommendation.tolerance:g}; best found: {best.point.name}"
    lines = [
        f"{head}, {best.point.seconds:.3g} s an angle",
        f"{reference.text}: ± {100 * reference.half_width[recommendation.quantity]:.2g} %",
    ]
    if recommendation.note:
        lines.append(f"note: {recommendation.note}")
    lines.append("\nrung, seconds an angle, error in % (95 % interval)")
    width = max(len(one.point.name) for one in recommendation.tried)
    lines += [
        f"  {one.point.name:<{width}}  {one.point.seconds:8.3g}  {100 * one.error.value:7.2f} "
        f"({100 * one.error.low:.2f} … {100 * one.error.high:.2f})  {one.verdict}"
        for one in recommendation.tried
    ]
    if recommendation.skipped:
        lines.append(f"not run, dearer: {', '.join(recommendation.skipped)}")
    if recommendation.effects:
        lines.append(
            f"\nleft out, it changes the {recommendation.quantity} by, in % (95 % interval)"
        )
    lines += [
        f"  {e.name:<22}  {100 * e.change:+7.2f} "
        f"({100 * e.low:+.2f} … {100 * e.high:+.2f})  {e.how}"
        for e in recommendation.effects
    ]
    return lines
