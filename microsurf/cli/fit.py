"""microsurf fit: STD of a measured surface, or of a measured BRDF."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

from ..errors import InputError
from ..files import check_readable, read_once
from ..results import measured_brdf
from ..scene import Surface
from ..surface import endings_text, read_endings
from . import fit_brdf, fit_surface
from .options import INPUT, PATH, as_json, of_brdf, of_file, say
from .output import show

_INSTEAD = "give the file that the instrument wrote"
_MOST_PIPED = 2**30
_NPY = b"\x93NUMPY"
_OF_SURFACES = ("spacing", "boundary", "level", "channel", "voids", "height_unit", "void_value")


@click.command("fit")
@click.argument("file", type=INPUT)
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
    that of the file. - is what is piped in: CSV, ASTM's text, or .npy.

    Example: microsurf fit sample.al3d --figure slopes.png --out sample.toml

    Example: microsurf fit paint.brdf --hold-out 30,60 --figure lobes.png
    """
    with _as_file(file) as named:
        if named != file and out is not None and not measured_brdf.holds_brdf(named):
            raise InputError(f"--out {out}: a scene names the file of its surface; save it first")
        try:
            values = _fit(named, out, figure, given)
        except InputError as error:
            raise InputError(str(error).replace(str(named), str(file))) from error
    notes = [note.replace(str(named), str(file)) for note in values.pop("notes", [])]
    values |= say(notes)
    readable = fit_surface.table if values["kind"] == "surface" else fit_brdf.table
    show(values if as_json else readable(values), as_json)


@contextmanager
def _as_file(file: Path) -> Iterator[Path]:
    """Keep what is piped in under the ending that its first bytes tell; a file is itself."""
    if str(file) != "/dev/stdin" and (file.is_file() or file.is_dir() or not file.exists()):
        check_readable(file, _INSTEAD)
        yield file
        return
    content = read_once(file, _INSTEAD, _MOST_PIPED)
    with tempfile.TemporaryDirectory() as folder:
        named = Path(folder) / "stdin.npy"
        if not content.startswith(_NPY):
            named = named.with_suffix(".txt")  # of ASTM, if it has its line VARS
            if b"\0" in content:
                raise InputError(
                    f"{file}: what is piped in must be CSV, ASTM's text or .npy; "
                    "save it under the ending of its format"
                )
        named.write_bytes(content)
        if named.suffix == ".txt" and not measured_brdf.holds_brdf(named):
            named = named.rename(named.with_suffix(".csv"))
        yield named


def _fit(
    file: Path, out: Path | None, figure: Path | None, given: dict[str, Any]
) -> dict[str, Any]:
    """Fit a file by its kind."""
    of_surface = {name: given.pop(name) for name in _OF_SURFACES}
    if measured_brdf.holds_brdf(file):
        _refuse(of_surface, f"{file} is a measured BRDF")
        scene = {name: value for name, value in given.items() if value is not None}
        return fit_brdf.fit_brdf_command(file, out=out, figure=figure, **scene)
    if file.suffix.lower() not in read_endings():
        known = endings_text(read_endings())
        raise InputError(
            f"{file}: unknown ending {file.suffix!r}; must be one of {known}, or of a measured "
            f"BRDF: {', '.join(measured_brdf.ENDINGS)}"
        )
    _refuse(given, f"{file} is a surface")
    level = of_surface.pop("level")
    surface = Surface(file=str(file), level=level or "none", **of_surface)
    return fit_surface.fit_surface_command(
        surface, levelled=level is not None, out=out, figure=figure
    )


def _refuse(given: dict[str, Any], why: str) -> None:
    """Refuse options of the other kind of file."""
    for name, value in given.items():
        if value is not None:
            raise InputError(f"--{name.replace('_', '-')} {value}: {why}; leave it out")
