"""microsurf surface: make a heightfield and say what it realises."""

import time
from pathlib import Path
from typing import Any

import click

from .. import memory, surface
from ..files import check_writable
from .options import (
    PATH,
    Listing,
    allow_truncated_tail,
    as_json,
    check_tail,
    compose,
    generated,
    say,
    seed,
)
from .output import check_ending, show

_ASKED = ("gamma", "sigma_x", "sigma_y", "correlation", "structure", "seed", "iterations")


@click.command("surface")
@click.option("--gamma", type=float, required=True, help="Shape γ of the slopes, > 1.5; 2 is GGX.")
@click.option("--sigma", type=float, required=True, help="Roughness σ ≥ 0 (along x).")
@click.option("--sigma-y", type=float, help="Roughness along y, if another.")
@generated
@click.option("--spacing", type=float, help="Side of a cell in your unit of length. Default 1.")
@seed
@click.option(
    "--out",
    type=PATH,
    required=True,
    cls=Listing,
    listing=lambda: [
        f"FILE{', '.join(f.endings)}: {f.label}" for f in surface.FORMATS.values() if f.write
    ],
)
@allow_truncated_tail
@as_json
def surface_command(
    as_json: bool, seed: int, out: Path, allow_truncated_tail: bool, **given: Any
) -> None:
    """Make a heightfield whose facet slopes follow Student's t-distribution.

    Example: microsurf surface --gamma 2 --sigma 0.5 --seed 7 --out ggx.npz
    """
    wanted = compose(None, **given)
    stated: dict[str, Any] = dict(check_tail(wanted, allow_truncated_tail))
    check_ending(out, *surface.write_endings())
    check_writable(out)
    memory.require(wanted.surface.cells**2, memory.SURFACE_BYTES_PER_CELL, "--cells")
    begin = time.perf_counter()
    heightfield = surface.generate_surface(
        wanted.roughness.gamma,
        wanted.roughness.sigma_x,
        wanted.roughness.sigma_y,
        cells=wanted.surface.cells,
        correlation=wanted.surface.correlation,
        structure=wanted.surface.structure,
        spacing=surface.square_spacing(wanted.surface),
        seed=seed,
    )
    seconds = time.perf_counter() - begin
    surface.write_surface(heightfield, out)
    stated |= say(_not_held(out, heightfield.pixel[0]))
    rough = wanted.roughness
    statistics = surface.surface_statistics(heightfield, rough.gamma, rough.sigma_x, rough.sigma_y)
    statistics["correlation_of_mesh"] = statistics.pop("correlation")
    show(
        {
            **{key: heightfield.recipe[key] for key in _ASKED},
            "cells": wanted.surface.cells,
            **statistics,
            "seconds": seconds,
            "file": str(out),
            **stated,
        },
        as_json,
    )


def _not_held(out: Path, spacing: float) -> list[str]:
    """What a file of bare heights does not say."""
    if out.suffix.lower() != ".npy" or spacing == 1:
        return []
    text = "bare heights, their spacing is not in the file: read it with --spacing"
    return [f"{out}: {text} {spacing!r}, or write .npz"]
