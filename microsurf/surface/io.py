"""Surfaces in files; the name's ending picks one of `formats.FORMATS`."""

import logging
import warnings
from dataclasses import fields
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..files import check_readable, whole_file
from .declared import Declared
from .formats import FORMATS, Format, endings_text, read_endings, write_endings
from .heightfield import Heightfield, Spacing
from .measured import completed
from .readers.height_map import HeightMap

_SAME_SPACING = 1e-6  # relative; single-precision meshes know their spacing no better


def write_surface(h: Heightfield, path: Path) -> None:
    """Write a surface whole or not at all.

    Raises
    ------
    InputError
        If the ending is unknown, the path can't be written, or a package is missing.

    """
    path = Path(path)
    try:
        ending = _ending(path, write_endings())
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    entry = next(f for f in FORMATS.values() if f.write and ending in f.endings)
    assert entry.write is not None  # noqa: S101 - as just chosen; for the type checker
    with whole_file(path) as temporary:
        try:
            entry.write(h, temporary)
        except ImportError as error:
            raise _missing(entry, error) from error


def read_surface(
    path: Path,
    spacing: Spacing | None = None,
    boundary: str | None = None,
    *,
    channel: str | None = None,
    voids: str | None = None,
    height_unit: str | None = None,
    void_value: float | None = None,
) -> Heightfield:
    """Read a surface.

    Parameters
    ----------
    path : Path
        A file with one of the endings of `formats.FORMATS`. Instruments' files and .x3p come
        out in µm.
    spacing : float or (float, float), optional
        Pixel, or (dx, dy), for what does not know its own: .npy (default 1) and images.
        A file that says another one is refused, because that would change every slope,
        unless its own is impossible (outside 0.1 nm … 1 mm).
    boundary : str, optional
        ``"periodic"`` (default for .npy) or ``"mirror"`` (for instruments' files). For
        .npz it replaces the one in the file. A triangle mesh whose last row and column
        repeat the first is taken as periodic, any other as mirrored, unless stated.
    channel : str, optional
        Name or number of an instrument's channel; default the one that it calls heights.
    voids : str, optional
        ``"refuse"``, ``"crop"`` or ``"fill"``, see `voids.mend`.
    height_unit : str, optional
        For what does not know its own: ``"nm"``, or ``"0.5nm"`` for each half a
        nanometre. Heights come out in µm, and ``spacing`` is in µm then.
    void_value : float, optional
        A height, as stored, that marks voids.

    Raises
    ------
    InputError
        If the file is missing, truncated, not a heightfield or too large, or
        contradicts what is asked.

    """
    path = Path(path)
    check_readable(path, "`microsurf surface --out FILE` writes one")
    declared = Declared(spacing, boundary, channel, voids, height_unit, void_value)
    try:
        h = _read(path, declared)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    if declared.pixel is not None and not np.allclose(
        declared.pixel, h.pixel, rtol=_SAME_SPACING, atol=0
    ):
        raise InputError(f"spacing = {spacing}: {path} says {h.spacing}; leave it out")
    return h


def _read(path: Path, declared: Declared) -> Heightfield:
    """By the first format that knows its ending and its content."""
    ending = _ending(path, read_endings())
    # Libraries warn and log about tags and versions; what matters they raise.
    logging.getLogger("tifffile").addHandler(logging.NullHandler())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for entry in FORMATS.values():
            if entry.read is None or ending not in entry.endings:
                continue
            _check_declared(entry, declared)
            try:
                stored = entry.read(path, declared)
            except ImportError as error:
                raise _missing(entry, error) from error
            if isinstance(stored, HeightMap):
                return completed(stored, path.name, declared)
            if stored is not None:
                return stored
    raise InputError("of no format that is known under its ending; export it again")


def _check_declared(entry: Format, declared: Declared) -> None:
    """Refuse what is said about a file that says it itself."""
    for field in fields(declared):
        value = getattr(declared, field.name)
        if value is not None and field.name not in ("spacing", "boundary", *entry.takes):
            name = field.name
            raise InputError(f"{name} = {value!r}: a file of this ending says it; leave it out")


def _missing(entry: Format, error: ImportError) -> InputError:
    """Give the error of a format whose package is not installed."""
    package = error.name or str(error)
    return InputError(
        f"this format needs {package}, which is not installed; do `pip install "
        f"'{entry.extra or package}'`"
    )


def _ending(path: Path, known: tuple[str, ...]) -> str:
    ending = path.suffix.lower()
    if ending not in known:
        raise InputError(f"unknown ending {ending!r}; must be one of {endings_text(known)}")
    return ending
