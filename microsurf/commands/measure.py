"""microsurf measure: ray-trace a surface."""

from pathlib import Path
from typing import Any

import click

from .. import memory, result, summary
from ..files import check_writable
from ..trace import measure
from .options import (
    PATH,
    as_json,
    check_described,
    check_from_file,
    compose,
    generated,
    light,
    material,
    roughness,
    seed,
    workers,
)
from .output import check_ending, show


@click.command("measure")
@click.argument("scene_file", type=PATH, required=False, metavar="[SCENE.toml]")
@click.option("--surface", "surface_file", type=PATH, help="A heightfield instead of making one.")
@click.option("--spacing", type=float, help="Side of its cells, if the file does not say.")
@click.option("--boundary", help="How it goes on beyond its edge: periodic or mirror.")
@click.option("--level", help="Take out its trend first: none, plane or quadratic.")
@roughness
@material
@generated
@light
@click.option("--paths", type=int, help="For each angle and realisation. Default 1000000.")
@click.option("--realisations", type=int, help="Surfaces of the same kind. Default 4.")
@seed
@workers
@click.option("--out", type=PATH, help="Write the result as FILE.nc.")
@as_json
def measure_command(
    scene_file: Path | None, seed: int, workers: int | None, out: Path | None, as_json: bool,
    **given: Any,
) -> None:  # fmt: skip
    """Ray-trace a surface and print its albedos with their standard errors.

    Example: microsurf measure --gamma 2 --sigma 0.5 --n 1.5 --kd 0.8 --theta 60
    """
    if given["surface_file"] is None:
        check_described(scene_file, given)
    asked = compose(scene_file, **given)
    check_from_file(asked, given)
    memory.require_lobes(asked.surface.realisations, asked.light.angles)
    if out is not None:
        check_ending(out, ".nc")
        check_writable(out)
    measured = measure(asked, seed=seed, workers=workers, progress=True)
    paths = float(measured.paths.sum())
    values = {
        **summary.figures(measured, asked.material.n, asked.material.kd),
        **summary.losses(measured),
        "paths": int(paths),
        "rays": int(measured.attrs["rays"]),
        "grazes": int(measured.attrs["grazes"]),
        "seconds": measured.attrs["seconds"],
        "paths_per_second": paths / measured.attrs["seconds"],
        "embree_ratio": measured.attrs["embree_ratio"],
    }
    if out is not None:
        result.save(measured, out)
        values["file"] = str(out)
    show(values, as_json)
