"""microsurf fit: STD of a measured surface."""

from pathlib import Path
from typing import Any

import click

from ..errors import InputError
from ..files import check_readable
from ..scene import Surface
from ..surface import READ_ENDINGS
from .fit_surface import fit_surface_command
from .options import PATH, as_json, of_file
from .output import show


@click.command("fit")
@click.argument("file", type=PATH)
@of_file
@click.option("--out", type=PATH, help="Write a scene that validates the fit: SCENE.toml.")
@click.option("--figure", type=PATH, help="Draw it: FILE.png, .pdf or .svg.")
@as_json
def fit_command(
    file: Path, out: Path | None, figure: Path | None, as_json: bool, **given: Any
) -> None:
    """Fit Student's t-distribution to the slopes of a measured surface.

    Lengths come out in µm where the file knows its unit. A surface that is not periodic
    has its quadratic trend taken out unless --level says otherwise. The azimuth is that of
    the axes, from +x to the right towards +y, which points down.

    Example: microsurf fit sample.al3d --figure slopes.png --out sample.toml
    """
    check_readable(file, "give the file that the instrument wrote")
    if file.suffix.lower() not in READ_ENDINGS:
        shown = ", ".join(e for e in READ_ENDINGS if not e[1:].isdecimal())
        raise InputError(f"{file}: unknown ending {file.suffix!r}; must be one of {shown}")
    level = given.pop("level")
    asked = Surface(file=str(file), level=level or "none", **given)
    values = fit_surface_command(asked, levelled=level is not None, out=out, figure=figure)
    show(values, as_json)
