"""microsurf fit: STD of a measured surface, or of a measured BRDF."""

from pathlib import Path
from typing import Any

import click

from ..errors import InputError
from ..files import check_readable
from ..results import measured_brdf
from ..scene import Surface
from ..surface import endings_text, read_endings
from .fit_brdf import fit_brdf_command, table
from .fit_surface import fit_surface_command
from .options import PATH, as_json, of_brdf, of_file
from .output import show

_OF_SURFACES = ("spacing", "boundary", "level", "channel", "voids", "height_unit", "void_value")


@click.command("fit")
@click.argument("file", type=PATH)
@of_file
@of_brdf
@click.option("--out", type=PATH, help="Write a scene that validates the fit: SCENE.toml.")
@click.option("--figure", type=PATH, help="Draw it: FILE.png, .pdf or .svg.")
@as_json
def fit_command(
    file: Path, out: Path | None, figure: Path | None, as_json: bool, **given: Any
) -> None:
    """Fit Student's t-distribution to a measured surface, or to a measured BRDF.

    The file decides which. A BRDF is .csv (columns theta_i, phi_i, theta_o, phi_o in degrees
    and f_550nm … in sr⁻¹), .brdf of pbrt-v2, .astm, .binary of MERL or .bsdf of RGL.

    Lengths of a surface come out in µm where the file knows its unit. A surface that is not
    periodic has its quadratic trend taken out unless --level says otherwise. The azimuth is
    that of the axes, from +x to the right towards +y, which points down; of a BRDF it is
    that of the file.

    Example: microsurf fit sample.al3d --figure slopes.png --out sample.toml

    Example: microsurf fit paint.brdf --hold-out 30,60 --figure lobes.png
    """
    check_readable(file, "give the file that the instrument wrote")
    of_surface = {name: given.pop(name) for name in _OF_SURFACES}
    if measured_brdf.holds_brdf(file):
        _refuse(of_surface, f"{file} is a measured BRDF")
        scene = {name: value for name, value in given.items() if value is not None}
        values = fit_brdf_command(file, out=out, figure=figure, **scene)
        show(values if as_json else table(values), as_json)
        return
    if file.suffix.lower() not in read_endings():
        known = endings_text(read_endings())
        raise InputError(
            f"{file}: unknown ending {file.suffix!r}; must be one of {known}, or of a measured "
            f"BRDF: {', '.join(measured_brdf.ENDINGS)}"
        )
    _refuse(given, f"{file} is a surface")
    level = of_surface.pop("level")
    surface = Surface(file=str(file), level=level or "none", **of_surface)
    values = fit_surface_command(surface, levelled=level is not None, out=out, figure=figure)
    show(values, as_json)


def _refuse(given: dict[str, Any], why: str) -> None:
    """Refuse options of the other kind of file."""
    for name, value in given.items():
        if value is not None:
            raise InputError(f"--{name.replace('_', '-')} {value}: {why}; leave it out")
