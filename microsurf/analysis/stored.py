"""A value as one file: numbers, text, lists, mappings, arrays, Datasets, dataclasses of ours.

Nothing in a file can run: it holds arrays, and one text in JSON that says what they are
parts of. A file is believed only if it was written under the same key, with the same name,
and its checksum is right; what is read has the types and the bits of what was written.
"""

import hashlib
import json
import sys
import zipfile
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from .. import memory
from ..files import whole_file
from ..jit import PACKAGE

_TEXT, _SUM = "text", "checksum"
_DENSE = 0.5
"""Arrays with a smaller share of numbers other than zero are stored as those and their places."""

Arrays = dict[str, NDArray[Any]]


def save(path: Path, key: str, value: Any) -> None:
    """Write a value, whole or not at all.

    Raises
    ------
    TypeError
        If some part of it is none of those that a file can hold.
    InputError, MicrosurfError
        If there is no room, or the folder can't be written.

    """
    arrays: dict[str, Any] = {}
    text = json.dumps(_encoded(value, arrays))
    arrays[_TEXT] = np.frombuffer(text.encode(), np.uint8)
    arrays[_SUM] = _checksum(path.name, key, arrays)
    with whole_file(path) as temporary, temporary.open("wb") as file:
        np.savez(file, **arrays)


def load(path: Path, key: str) -> tuple[Any] | None:
    """Read a value that `save` wrote, in a tuple; None if there is none, or none to believe."""
    try:
        with zipfile.ZipFile(path) as archive:
            if sum(part.file_size for part in archive.infolist()) > memory.available():
                return None
        with np.load(path, allow_pickle=False) as members:
            arrays = {name: members[name] for name in members.files}
        if not np.array_equal(arrays[_SUM], _checksum(path.name, key, arrays)):
            return None
        return (_decoded(json.loads(arrays[_TEXT].tobytes()), arrays),)
    except Exception:  # noqa: BLE001 - numpy and zipfile raise anything for a damaged file
        return None


def _name(kind: type) -> str:
    return f"{kind.__module__}.{kind.__qualname__}"


def _checksum(name: str, key: str, arrays: Arrays) -> NDArray[np.uint8]:
    digest = hashlib.sha256(f"{key} {name}".encode())
    for label in sorted(arrays.keys() - {_SUM}):
        values = np.ascontiguousarray(arrays[label])
        digest.update(f"{label} {values.dtype.str} {values.shape}".encode())
        digest.update(values.tobytes())
    return np.frombuffer(digest.digest(), np.uint8)


def _encoded(value: Any, arrays: Arrays) -> Any:
    """What JSON can hold; arrays go into ``arrays``. Every object is a pair [kind, content]."""
    if value is None or type(value) in (bool, int, float, str):
        return value
    if isinstance(value, np.generic | np.ndarray):
        return _encoded_array(np.asarray(value), arrays, scalar=isinstance(value, np.generic))
    if isinstance(value, tuple | list) and type(value) in (tuple, list):
        return [type(value).__name__, [_encoded(item, arrays) for item in value]]
    if isinstance(value, xr.Dataset):
        parts = [
            {
                name: (tuple(map(str, of.dims)), of.values, dict(of.attrs))
                for name, of in group.items()
            }
            for group in (value.data_vars, value.coords)
        ]
        return ["dataset", _encoded((*parts, dict(value.attrs)), arrays)]
    if isinstance(value, Mapping):
        return ["dict", [[_encoded(k, arrays), _encoded(v, arrays)] for k, v in value.items()]]
    if is_dataclass(value) and not isinstance(value, type):
        content = {f.name: getattr(value, f.name) for f in fields(value) if f.init}
        return [_name(type(value)), _encoded(content, arrays)]
    raise TypeError(f"{type(value).__name__}: can't be stored")


def _encoded_array(values: NDArray[Any], arrays: Arrays, *, scalar: bool) -> Any:
    if values.dtype.hasobject:
        raise TypeError("an array of objects can't be stored")
    label = f"{len(arrays)}"
    if values.dtype == np.float64 and not scalar:
        # Bits, so that −0 is not taken for nothing.
        flat = np.ascontiguousarray(values).ravel()
        filled = np.flatnonzero(flat.view(np.uint64))
        if len(filled) < _DENSE * flat.size:
            arrays[label], arrays[f"{label} places"] = flat[filled], filled
            return ["sparse", [label, list(values.shape)]]
    arrays[label] = values
    return ["scalar" if scalar else "array", label]


def _decoded(text: Any, arrays: Arrays) -> Any:  # noqa: PLR0911
    if not isinstance(text, list):
        return text
    kind, content = text
    if kind == "array":
        return arrays[content]
    if kind == "scalar":
        return arrays[content][()]
    if kind == "sparse":
        label, shape = content
        flat = np.zeros(int(np.prod(shape)))
        flat[arrays[f"{label} places"]] = arrays[label]
        return flat.reshape(shape)
    if kind in ("list", "tuple"):
        items = [_decoded(item, arrays) for item in content]
        return items if kind == "list" else tuple(items)
    if kind == "dict":
        return {_decoded(k, arrays): _decoded(v, arrays) for k, v in content}
    if kind == "dataset":
        variables, coordinates, attrs = _decoded(content, arrays)
        return xr.Dataset(variables, coordinates, attrs)
    return _class(kind)(**_decoded(content, arrays))


def _class(name: str) -> type:
    """A dataclass of this package, of a module that was imported; nothing else is ever called."""
    module, _, kind = name.rpartition(".")
    resolved = getattr(sys.modules[module], kind)
    if module.split(".")[0] != PACKAGE.name or not (
        isinstance(resolved, type) and is_dataclass(resolved)
    ):
        raise TypeError(name)
    return resolved
