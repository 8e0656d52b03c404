"""Heightfields in files; the name's ending picks the format.

``.npz``: native, with spacing, boundary and recipe. ``.npy``: bare heights.
``.ply``, ``.obj``, ``.stl``: triangles, see `mesh_io`.

Strangers' files are data: nothing is unpickled, and the shape and type that a
header claims are checked against the limits and the file's size before anything
is loaded.
"""

import json
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from ..errors import InputError
from ..files import whole_file
from . import mesh_io
from .heightfield import Heightfield, check_layout, check_spacing

Array = NDArray[np.float64]

ENDINGS = (".npz", ".npy", *mesh_io.ENDINGS)
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
    ending = _ending(path)
    with whole_file(path) as temporary:
        if ending in mesh_io.ENDINGS:
            mesh_io.write(h, temporary)
            return
        # A stream, because numpy adds its own ending to names such as S.NPY.
        with temporary.open("wb") as stream:
            if ending == ".npy":
                # np.save hands the data to C, where a full disk can go unnoticed.
                npy.write_array_header_1_0(stream, npy.header_data_from_array_1_0(h.heights))
                stream.write(h.heights.tobytes())
            else:
                np.savez(
                    stream,
                    heights=h.heights,
                    spacing=np.float64(h.spacing),
                    boundary=np.str_(h.boundary),
                    recipe=np.str_(_to_json(h.recipe)),
                )


def read_surface(
    path: Path, spacing: float | None = None, boundary: str | None = None
) -> Heightfield:
    """Read a surface.

    Parameters
    ----------
    path : Path
        A file with one of the endings above.
    spacing : float, optional
        Needed for .npy only (default 1). The other formats know theirs; another
        one is refused, because it would change every slope.
    boundary : str, optional
        ``"periodic"`` (default for .npy) or ``"mirror"``. For .npz it replaces the
        one in the file. A triangle mesh whose last row and column repeat the first
        is taken as periodic, any other as mirrored, unless told.

    Raises
    ------
    InputError
        If the file is missing, truncated, not a heightfield or too large, or
        contradicts what is asked.

    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: no such file; `microsurf surface --out FILE` writes one")
    ending = _ending(path)
    if spacing is not None:
        spacing = check_spacing(spacing)
    try:
        if ending == ".npy":
            with path.open("rb") as stream:
                heights = _read_array(stream, path.stat().st_size)
            return Heightfield(heights, spacing or 1.0, boundary or "periodic")
        if ending == ".npz":
            h = _read_native(path)
            if boundary not in (None, h.boundary):
                h = Heightfield(h.heights, h.spacing, str(boundary))
        else:
            h = mesh_io.read(path, boundary)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    if spacing is not None and abs(spacing - h.spacing) > _SAME_SPACING * h.spacing:
        raise InputError(f"spacing = {spacing}: {path} says {h.spacing}; leave it out")
    return h


def _ending(path: Path) -> str:
    ending = path.suffix.lower()
    if ending not in ENDINGS:
        raise InputError(f"{path}: unknown ending {ending!r}; must be one of {', '.join(ENDINGS)}")
    return ending


def _read_array(stream: IO[bytes], size: int, text: bool = False) -> NDArray[Any]:
    """Read an array in .npy format of ``size`` bytes: heights, or a number or text of shape ()."""
    shape, dtype = _read_header(stream)
    if not text:
        check_layout(shape, dtype)
    elif shape != () or dtype.kind not in "Uf" or dtype.itemsize > 4 * _MAX_TEXT_BYTES:
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
    names = {"heights.npy": False, "spacing.npy": True, "boundary.npy": True, "recipe.npy": True}
    arrays: dict[str, NDArray[Any]] = {}
    try:
        with zipfile.ZipFile(path) as archive:
            missing = sorted(set(names) - set(archive.namelist()))
            for name, text in names.items() if not missing else ():
                with archive.open(name) as stream:
                    arrays[name] = _read_array(stream, archive.getinfo(name).file_size, text=text)
    except InputError:
        raise
    except Exception as error:  # zipfile and zlib raise whatever the bytes provoke
        raise InputError("not a .npz archive, truncated or damaged; write it again") from error
    if missing:
        raise InputError(
            f"no {', '.join(name.removesuffix('.npy') for name in missing)} inside: not a "
            "microsurf surface; save bare heights as .npy"
        )
    return Heightfield(
        arrays["heights.npy"],
        check_spacing(arrays["spacing.npy"][()]),
        str(arrays["boundary.npy"][()]),
        _from_json(str(arrays["recipe.npy"][()])),
    )


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
