"""Heightfields in files; the name's ending picks the format.

``.npz``: native, with spacing, boundary and recipe. ``.npy``: bare heights.
``.ply``, ``.obj``, ``.stl``: triangles, see `mesh_io`. ``.x3p``: ISO 25178-72, in µm.
All others are instruments' own and only read, see `readers`.

Strangers' files are data: nothing is unpickled, and the shape and type that a
header claims are checked against the limits and the file's size before anything
is loaded.
"""

import json
import zipfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from ..errors import InputError
from ..files import check_readable, whole_file
from . import mesh_io, readers
from .heightfield import Heightfield, Spacing, check_layout, spacing_pair
from .measured import PIXELS, from_array, height_factor, marked, read_measured
from .readers import x3p

Array = NDArray[np.float64]

ENDINGS = (".npz", ".npy", *mesh_io.ENDINGS, x3p.ENDING)
"""Of files that are written and read."""
READ_ENDINGS = (*ENDINGS, *(ending for ending in readers.ENDINGS if ending not in ENDINGS))
"""Of all files that are read."""
_MAX_TEXT_BYTES = 1_000_000
_MAX_HEADER_BYTES = 10_000  # as numpy has it
_SAME_SPACING = 1e-6  # relative; single-precision meshes know their spacing no better


def write_surface(h: Heightfield, path: Path) -> None:
    """Write a surface whole or not at all.

    Raises
    ------
    InputError
        If the ending is unknown or the path can't be written.

    """
    path = Path(path)
    ending = _ending(path, ENDINGS)
    with whole_file(path) as temporary:
        if ending in mesh_io.ENDINGS:
            mesh_io.write(h, temporary)
            return
        if ending == x3p.ENDING:
            if not all(PIXELS[0] <= d <= PIXELS[1] for d in h.pixel):
                raise InputError(
                    f"spacing = {h.spacing}: X3P holds metres, so lengths are taken for µm; a "
                    f"pixel must be {PIXELS[0]:g} … {PIXELS[1]:g} µm. Choose another format"
                )
            gaps = h.heights if h.filled is None else np.where(h.filled, np.nan, h.heights)
            x3p.write(gaps, h.pixel, temporary)
            return
        # A stream, because numpy adds its own ending to names such as S.NPY.
        with temporary.open("wb") as stream:
            if ending == ".npy":
                # np.save hands the data to C, where a full disk can go unnoticed.
                npy.write_array_header_1_0(stream, npy.header_data_from_array_1_0(h.heights))
                stream.write(h.heights.tobytes())
            else:
                entries: dict[str, Any] = {
                    "heights": h.heights,
                    "spacing": np.asarray(h.spacing, dtype=np.float64),
                    "boundary": np.str_(h.boundary),
                    "recipe": np.str_(_to_json(h.recipe)),
                }
                if h.provenance:
                    entries["provenance"] = np.str_(_to_json(h.provenance))
                if h.filled is not None:
                    entries["filled"] = h.filled.astype(np.uint8)
                np.savez(stream, **entries)


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
        A file with one of the endings above. Instruments' files and .x3p come out in µm.
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
    ending = _ending(path, READ_ENDINGS)
    pixel = None if spacing is None else spacing_pair(spacing)
    foreign: dict[str, Any] = {"channel": channel, "voids": voids, "height_unit": height_unit,
                               "void_value": void_value}  # fmt: skip
    try:
        if ending in readers.ENDINGS:
            return read_measured(path, spacing=spacing, boundary=boundary, **foreign)
        if ending == ".npy":
            _only({"channel": channel})
            with path.open("rb") as stream:
                heights = _read_array(stream, path.stat().st_size)
            return _bare(heights, pixel, boundary, voids, height_unit, void_value)
        _only(foreign)
        if ending == ".npz":
            h = _read_native(path)
            if boundary not in (None, h.boundary):
                h = replace(h, boundary=str(boundary), recipe={})
        else:
            h = mesh_io.read(path, boundary)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    if pixel is not None and not np.allclose(pixel, h.pixel, rtol=_SAME_SPACING, atol=0):
        raise InputError(f"spacing = {spacing}: {path} says {h.spacing}; leave it out")
    return h


def _bare(
    heights: NDArray[Any],
    pixel: tuple[float, float] | None,
    boundary: str | None,
    voids: str | None,
    height_unit: str | None,
    void_value: float | None,
) -> Heightfield:
    """Bare heights as they are, or in µm if their unit is told."""
    factor, known = 1.0, {}
    if height_unit is not None:
        factor = height_factor(height_unit)
        known = {"unit": "µm", "unit_in_file": height_unit}
        if pixel is None:
            raise InputError(f"height_unit = {height_unit!r}: goes with --spacing, in µm")
    values = marked(heights, void_value)
    return from_array(values * factor, pixel or 1.0, boundary or "periodic", voids, known)


def _only(given: Mapping[str, Any]) -> None:
    """Refuse what is said about a file that says it itself."""
    for name, value in given.items():
        if value is not None:
            raise InputError(f"{name} = {value!r}: a file of this ending says it; leave it out")


def _ending(path: Path, known: tuple[str, ...]) -> str:
    ending = path.suffix.lower()
    if ending not in known:
        shown = ", ".join(e for e in known if not e[1:].isdecimal())
        raise InputError(f"{path}: unknown ending {ending!r}; must be one of {shown}")
    return ending


def _read_array(stream: IO[bytes], size: int, text: bool = False) -> NDArray[Any]:
    """Read an array in .npy format of ``size`` bytes: heights, or a number or text of shape ()."""
    shape, dtype = _read_header(stream)
    if not text:
        check_layout(shape, dtype)
    elif shape not in ((), (2,)) or dtype.kind not in "Uf" or dtype.itemsize > 4 * _MAX_TEXT_BYTES:
        raise InputError(f"an entry of shape {shape} and type {dtype}: not a microsurf surface")
    expected = int(np.prod(shape, dtype=np.int64)) * dtype.itemsize
    if size - stream.tell() != expected:
        raise InputError(
            f"{size - stream.tell()} bytes of data for heights of shape {shape} that take "
            f"{expected}; the file is truncated or damaged"
        )
    stream.seek(0)
    return np.asarray(npy.read_array(stream, allow_pickle=False))


def _read_header(stream: IO[bytes]) -> tuple[tuple[int, ...], np.dtype[Any]]:
    try:
        version = npy.read_magic(stream)
        if version == (1, 0):
            shape, _, dtype = npy.read_array_header_1_0(stream)
            return shape, dtype
        # Versions 2 and 3 differ in the encoding of names, which heights have none of. Their
        # headers may claim 4 GiB: numpy reads all of it before it looks at the length.
        start = stream.tell()
        if (
            version in ((2, 0), (3, 0))
            and int.from_bytes(stream.read(4), "little") <= _MAX_HEADER_BYTES
        ):
            stream.seek(start)
            shape, _, dtype = npy.read_array_header_2_0(stream)
            return shape, dtype
    except Exception as error:  # numpy's parser raises whatever the bytes provoke
        raise InputError("not a .npy array, or truncated; save it with numpy.save") from error
    raise InputError(
        f".npy format {version[0]}.{version[1]}, or its header too long: must be 1.0 … 3.0 and "
        f"{_MAX_HEADER_BYTES} bytes; save it with numpy.save"
    )


def _read_native(path: Path) -> Heightfield:
    needed = ("heights", "spacing", "boundary", "recipe")
    text = {"heights": False, "spacing": True, "boundary": True, "recipe": True, "filled": False,
            "provenance": True}  # fmt: skip
    arrays: dict[str, NDArray[Any]] = {}
    try:
        with zipfile.ZipFile(path) as archive:
            there = {name.removesuffix(".npy") for name in archive.namelist()}
            missing = [name for name in needed if name not in there]
            for name in text if not missing else ():
                if name in there:
                    with archive.open(f"{name}.npy") as stream:
                        size = archive.getinfo(f"{name}.npy").file_size
                        arrays[name] = _read_array(stream, size, text=text[name])
    except InputError:
        raise
    except Exception as error:  # zipfile and zlib raise whatever the bytes provoke
        raise InputError("not a .npz archive, truncated or damaged; write it again") from error
    if missing:
        raise InputError(
            f"no {', '.join(missing)} inside: not a microsurf surface; save bare heights as .npy"
        )
    return Heightfield(
        arrays["heights"],
        _pixel(arrays["spacing"]),
        str(arrays["boundary"][()]),
        _from_json(str(arrays["recipe"][()])),
        filled=arrays.get("filled"),
        provenance=_from_json(str(arrays["provenance"][()])) if "provenance" in arrays else {},
    )


def _pixel(stored: NDArray[Any]) -> tuple[float, float]:
    """One number, or two."""
    return spacing_pair(stored[()] if stored.shape == () else tuple(stored))


def _to_json(recipe: Mapping[str, Any]) -> str:
    try:
        return json.dumps(dict(recipe), allow_nan=False)
    except (TypeError, ValueError) as error:
        raise InputError(f"recipe {dict(recipe)}: not JSON ({error})") from error


def _from_json(text: str) -> dict[str, Any]:
    try:
        recipe = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError("its recipe is not JSON; write the surface again") from error
    if not isinstance(recipe, dict):
        raise InputError("its recipe is not a JSON object; write the surface again")
    return recipe
