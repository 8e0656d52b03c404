"""Scenes as TOML: read with errors that teach, written so that they read back the same."""

import difflib
import io
import tomllib
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import tomli_w

from ..errors import InputError
from ..files import read_once
from .accuracy import Accuracy
from .effects import Effects
from .expectation import QUANTITIES, Expectation
from .layers import Layers, Substrate
from .light import Light
from .material import Material
from .roughness import Roughness
from .surface import Surface

_MAX_BYTES = 1_000_000
_SECTIONS = {
    "material": Material,
    "roughness": Roughness,
    "surface": Surface,
    "light": Light,
    "accuracy": Accuracy,
    "effects": Effects,
}


def _known(key: str, known: list[str], where: str) -> None:
    if key not in known:
        near = difflib.get_close_matches(key, known, n=1, cutoff=0)
        raise InputError(f"unknown key {key!r} in {where}; did you mean {near[0]!r}?")


def _section(kind: type, table: Any, where: str) -> Any:
    if not isinstance(table, dict):
        raise InputError(f"{where} = {table!r}: must be a table [{where}]")
    names = [f.name for f in fields(kind)]
    for key in table:
        _known(key, names, f"[{where}]")
    return kind(**table)


def _layers(table: Any) -> Layers:
    """Build two layers; without a substrate's table there is nothing to build them from."""
    if isinstance(table, dict):
        if "gap" not in table:
            raise InputError("[layers] without a gap: give the cells between the mean planes")
        if "substrate" not in table:
            raise InputError(
                "[layers] without [layers.substrate]: give its gamma and sigma, "
                'or shape = "same" or "flat", or a file'
            )
        table = table | {"substrate": _section(Substrate, table["substrate"], "layers.substrate")}
    return _section(Layers, table, "layers")  # type: ignore[no-any-return]


def values_of(document: Mapping[str, Any]) -> dict[str, Any]:
    """Build the parts of a scene, by their names in `Scene`, from the tables of a scene file."""
    values: dict[str, Any] = {}
    for key, table in document.items():
        _known(key, [*_SECTIONS, "layers", "title", "rationale", "expect"], "the scene")
        if key in _SECTIONS:
            values[key] = _section(_SECTIONS[key], table, key)
        elif key == "layers":
            values[key] = _layers(table)
        elif key == "expect":
            if not isinstance(table, dict):
                raise InputError(f"expect = {table!r}: must hold tables such as [expect.specular]")
            for quantity in table:
                _known(quantity, list(QUANTITIES), "[expect]")
            values[key] = {q: _section(Expectation, t, f"expect.{q}") for q, t in table.items()}
        else:
            values[key] = table
    return values


def read_text(path: Path) -> str:
    """Read a scene file's text, also from a pipe."""
    content = read_once(path, "give a scene file (.toml)", _MAX_BYTES)
    try:
        return io.StringIO(content.decode("utf-8-sig"), newline=None).read()
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not a text in UTF-8; give a scene file (.toml)") from error


def tables_of(text: str) -> dict[str, Any]:
    """Tables of a scene file's text."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"not a scene: {error}") from error
    except RecursionError as error:
        raise InputError("not a scene: nested too deeply; a scene is tables of values") from error


def text_of(values: Mapping[str, Any]) -> str:
    """Text of a scene file that holds some tables; what is None is left out."""

    def plain(value: Any) -> Any:
        if isinstance(value, Mapping):
            return {k: plain(v) for k, v in value.items() if v is not None}
        if isinstance(value, tuple):
            return [plain(v) for v in value]
        return value

    return tomli_w.dumps(plain(values), multiline_strings=False)


def marked(text: str, values: Mapping[str, Any], defaults: Mapping[str, Any]) -> str:
    """Mark in a scene file's text the lines that it could do without."""
    lines, table = [], ""
    for line in text.split("\n"):
        if line.startswith("["):
            table = line.strip("[]")
        key = line.partition(" = ")[0]
        same = table in _SECTIONS and key in values[table]
        same = same and values[table][key] == defaults[table][key]
        lines.append(f"{line}  # default" if same else line)
    return "\n".join(lines)
