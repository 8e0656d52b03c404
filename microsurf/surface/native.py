"""microsurf's own archive, .npz, and bare heights, .npy.

Strangers' files are data: nothing is unpickled, and the shape and type that a header claims
are checked against the limits and the file's size before anything is loaded.
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
from .declared import Declared
from .heightfield import Heightfield, check_layout, spacing_pair
from .measured import from_array, height_factor, marked

_MAX_TEXT_BYTES = 1_000_000
_MAX_HEADER_BYTES = 10_000  # as numpy has it


def write_archive(h: Heightfield, path: Path) -> None:
    """Write all that is known of a surface."""
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
    # A stream, because numpy adds its own ending to names such as S.NPZ.
    with path.open("wb") as stream:
        np.savez(stream, **entries)


def write_heights(h: Heightfield, path: Path) -> None:
    """Write bare heights."""
    with path.open("wb") as stream:
        # np.save hands the data to C, where a full disk can go unnoticed.
        npy.write_array_header_1_0(stream, npy.header_data_from_array_1_0(h.heights))
        stream.write(h.heights.tobytes())


def read_archive(path: Path, declared: Declared) -> Heightfield:
    """Read what `write_archive` wrote; another boundary takes the place of its own.

    Raises
    ------
    InputError
        If it is no such archive, or damaged.

    """
    h = _read_entries(path)
    if declared.boundary not in (None, h.boundary):
        h = replace(h, boundary=str(declared.boundary), recipe={})
    return h


def read_heights(path: Path, declared: Declared) -> Heightfield:
    """Read bare heights as they are, or in µm if their unit is declared.

    Raises
    ------
    InputError
        If it holds no heights, is damaged, or a unit is declared without a spacing.

    """
    with path.open("rb") as stream:
        heights = _read_array(stream, path.stat().st_size)
    factor, known = 1.0, {}
    if declared.height_unit is not None:
        factor = height_factor(declared.height_unit)
        known = {"unit": "µm", "unit_in_file": declared.height_unit}
        if declared.pixel is None:
            raise InputError(
                f"height_unit = {declared.height_unit!r}: puts heights into µm, and the file has "
                "no spacing; give --spacing, or surface.spacing in a scene, in µm"
            )
    values = marked(heights, declared.void_value)
    boundary = declared.boundary or "periodic"
    return from_array(values * factor, declared.pixel or 1.0, boundary, declared.voids, known)


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


def _read_entries(path: Path) -> Heightfield:
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
