"""Every format of surfaces as one entry: its endings, what reads it, what writes it.

A new format is one file with a function and one entry in FORMATS. `read_surface`,
`write_surface`, `--surface`, `surface --out`, `fit`, the help and the errors take what they
know of formats from here.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from . import mesh_io, native
from .declared import OF_BARE_HEIGHTS, OF_INSTRUMENTS, Declared
from .heightfield import Heightfield
from .readers import image, surface_topography, x3p
from .readers.height_map import HeightMap


@dataclass(frozen=True)
class Format:
    """One entry.

    Attributes
    ----------
    key : str
        Its name in the list.
    label : str
        Its name in the help, with what a file of it keeps of a surface.
    endings : tuple of str
        Of its files, in lower case with their dots. Formats may share one: they are tried in
        the order of the list.
    read : callable or None
        Of a path and what the user says of the file. It gives a `Heightfield`; or a `HeightMap`,
        the heights as an instrument's file stores them, which are then brought into µm, mended
        and named in the provenance; or None if the file is of another format with that ending.
        It raises InputError if the file is of its own and can't be read.
    write : callable or None
        Writes a surface into a path; a file that stays unfinished is never seen.
    takes : tuple of str
        Names of what a user may say of such a file besides spacing and boundary, see `Declared`.
    extra : str
        What to install if a package is missing, as pip calls it.

    """

    key: str
    label: str
    endings: tuple[str, ...]
    read: Callable[[Path, Declared], Heightfield | HeightMap | None] | None = None
    write: Callable[[Heightfield, Path], None] | None = None
    takes: tuple[str, ...] = ()
    extra: str = ""


FORMATS: dict[str, Format] = {
    entry.key: entry
    for entry in (
        Format(
            "npz", "microsurf's own, which keeps everything", (".npz",),
            native.read_archive, native.write_archive,
        ),
        Format(
            "npy", "numpy's, which keeps bare heights", (".npy",),
            native.read_heights, native.write_heights, OF_BARE_HEIGHTS,
        ),
        Format(
            "mesh", "triangles, which keep the spacing too", mesh_io.ENDINGS,
            mesh_io.read, mesh_io.write,
        ),
        Format(
            "x3p", "ISO 25178-72, in µm, which keeps the spacing and voids too", (".x3p",),
            x3p.read, x3p.write, OF_INSTRUMENTS, "microsurf[topography]",
        ),
        Format(
            "instruments", "instruments' own by SurfaceTopography",
            tuple(surface_topography.FORMATS), surface_topography.read,
            takes=OF_INSTRUMENTS, extra="microsurf[topography]",
        ),
        Format(
            "image", "grey levels of an image", image.ENDINGS, image.read, takes=OF_INSTRUMENTS
        ),
    )
}  # fmt: skip
"""In the order of trying, and of the help."""


def read_endings() -> tuple[str, ...]:
    """Endings of all files that are read, each once, in the order of the list."""
    return tuple(dict.fromkeys(e for f in FORMATS.values() if f.read for e in f.endings))


def write_endings() -> tuple[str, ...]:
    """Endings of all files that are written, each once, in the order of the list."""
    return tuple(dict.fromkeys(e for f in FORMATS.values() if f.write for e in f.endings))


def endings_text(endings: tuple[str, ...]) -> str:
    """List endings for people: without the thousand that Bruker numbers its files by."""
    return ", ".join(ending for ending in endings if not ending[1:].isdecimal())
