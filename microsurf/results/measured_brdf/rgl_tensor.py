"""The tensor file of RGL's BRDF database: named arrays, checked before anything is read.

``tensor_file`` and a zero, two bytes of version (1, 0), the number of fields, and for each its
name, dimensions, type, offset and shape; little-endian (Dupuy and Jakob 2018, reference code).
"""

import struct
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError

MAGIC = b"tensor_file\x00\x01\x00"
TYPES = {1: "u1", 2: "i1", 3: "<u2", 4: "<i2", 5: "<u4", 6: "<i4", 7: "<u8", 8: "<i8", 9: "<f2",
         10: "<f4", 11: "<f8"}  # fmt: skip
_MOST_FIELDS = 64
_MOST_NAME = 256
_MOST_DIMENSIONS = 6
_MOST_BYTES = 1_000_000_000


def read_tensors(path: Path) -> dict[str, NDArray[Any]]:
    """Arrays of a tensor file by name.

    Raises
    ------
    InputError
        If it is truncated, damaged, too large, or something else.

    """
    size = path.stat().st_size
    if size > _MOST_BYTES:
        raise InputError(f"{size} bytes: at most {_MOST_BYTES} are read of a tensor file")
    with path.open("rb") as stream:
        if stream.read(len(MAGIC)) != MAGIC:
            raise InputError("does not start as a tensor file of version 1.0: not RGL's .bsdf")
        (count,) = _unpack(stream, "<I")
        if not 1 <= count <= _MOST_FIELDS:
            raise InputError(f"{count} fields: must be 1 … {_MOST_FIELDS}; the file is damaged")
        heads = [_head(stream) for _ in range(count)]
        arrays = {}
        for name, dtype, offset, shape in heads:
            # Python's whole numbers do not overflow, whatever shape a stranger claims.
            length = dtype.itemsize
            for side in shape:
                length *= side
            if offset + length > size:
                raise InputError(
                    f"field {name!r} of shape {shape} ends beyond the file's {size} bytes; "
                    "it is truncated or damaged"
                )
            stream.seek(offset)
            arrays[name] = np.frombuffer(stream.read(length), dtype).reshape(shape)
        return arrays


def _unpack(stream: IO[bytes], layout: str) -> tuple[Any, ...]:
    raw = stream.read(struct.calcsize(layout))
    if len(raw) < struct.calcsize(layout):
        raise InputError("its header ends too early; the file is truncated")
    return struct.unpack(layout, raw)


def _head(stream: IO[bytes]) -> tuple[str, np.dtype[Any], int, tuple[int, ...]]:
    (length,) = _unpack(stream, "<H")
    if length > _MOST_NAME:
        raise InputError(f"the name of a field has {length} bytes; the file is damaged")
    name = b"".join(_unpack(stream, f"{length}c")).decode("ascii", "replace")
    (dimensions,) = _unpack(stream, "<H")
    code, offset = _unpack(stream, "<BQ")
    if dimensions > _MOST_DIMENSIONS or code not in TYPES:
        raise InputError(f"field {name!r}: {dimensions} dimensions of type {code}; damaged")
    return name, np.dtype(TYPES[code]), offset, _unpack(stream, f"<{dimensions}Q")


def write_tensors(path: Path, fields: Mapping[str, NDArray[Any]]) -> None:
    """Write arrays by name, so that `read_tensors` gives them back."""
    codes = {np.dtype(name): code for code, name in TYPES.items()}
    names = {name: name.encode("ascii") for name in fields}
    offset = len(MAGIC) + 4
    offset += sum(13 + len(names[name]) + 8 * array.ndim for name, array in fields.items())
    with path.open("wb") as stream:
        stream.write(MAGIC + struct.pack("<I", len(fields)))
        for name, array in fields.items():
            stream.write(struct.pack("<H", len(names[name])) + names[name])
            stream.write(struct.pack("<HBQ", array.ndim, codes[array.dtype], offset))
            stream.write(struct.pack(f"<{array.ndim}Q", *array.shape))
            offset += array.nbytes
        for array in fields.values():
            stream.write(array.tobytes())
