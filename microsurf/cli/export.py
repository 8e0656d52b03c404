"""microsurf export: a material for other programs."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from ..analysis.export import check as checked
from ..analysis.export import klems, rgl, tables
from ..analysis.export.source import Source, of_fit, of_scene
from ..analysis.export.traced import of_result
from ..errors import InputError
from ..files import check_writable, whole_file
from ..scene import Scene
from .options import INPUT, PATH, as_json, wavelengths
from .output import check_ending, show

WRITERS: dict[str, Callable[[Source, Path], None]] = {
    ".bsdf": rgl.write,
    ".binary": tables.write_merl,
    ".csv": tables.write_pairs,
    ".xml": klems.write,
}


@click.command("export")
@click.argument("file", type=INPUT, metavar="(SCENE.toml | RESULT.nc | FIT.json)")
@click.option(
    "--out", type=PATH, required=True,
    help=".bsdf of RGL (Mitsuba's `measured`), .binary of MERL, .csv of pairs, .xml of LBNL.",
)  # fmt: skip
@wavelengths
@click.option("--check", is_flag=True, help="Load a .bsdf in Mitsuba and compare.")
@as_json
def export_command(
    file: Path, out: Path, wavelengths: tuple[float, ...] | None, check: bool, as_json: bool
) -> None:
    """Write a material for other programs: of a scene, a trace, or what `fit --json` printed.

    Of a scene or a fit it is order 1 by Smith's height-correlated masking; of a trace light of
    all orders, smoothed within its errors. One Kd is grey, three are red, green and blue;
    others need --wavelengths. The .csv holds the scene's incidences, and the .xml means over
    Klems' 145 patches.

    Example: microsurf export scene.toml --out paint.bsdf --check
    """
    begin = time.perf_counter()
    check_ending(out, *WRITERS)
    ending = out.suffix.lower()
    if check and ending != ".bsdf":
        raise InputError(f"--check: only of a .bsdf, which Mitsuba reads; {out} is {ending}")
    check_writable(out)
    source = _source(file, wavelengths or ())
    for note in source.notes:
        click.echo(f"{file}: {note}", err=True)
    values: dict[str, Any] = {"file": str(out), "channels": list(source.channels), "error": None}
    with whole_file(out) as temporary:
        WRITERS[ending](source, temporary)
        if check:
            judged = checked.check if source.traced is None else checked.check_traced
            values |= judged(source, temporary)
    show({**values, "seconds": time.perf_counter() - begin}, as_json)


def _source(file: Path, wavelengths: tuple[float, ...]) -> Source:
    if file.suffix.lower() == ".json":
        if wavelengths:
            raise InputError(f"--wavelengths: {file} names its own; leave it out")
        return of_fit(file)
    if file.suffix.lower() == ".nc":
        return of_result(file, wavelengths)
    return of_scene(Scene.read(file), file.name, wavelengths)
