"""Scenes as TOML: read with errors that teach, written so that they read back the same."""

import difflib
import io
import tomllib
from collections.abc import Mapping
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any

import tomli_w

from ..errors import InputError
from ..files import read_once
from .expectation import QUANTITIES, Expectation
from .scene import Accuracy, Effects, Light, Material, Roughness, Scene, Surface

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


def from_dict(document: Mapping[str, Any]) -> Scene:
    """Build a scene from the tables of a scene file."""
    values: dict[str, Any] = {}
    for key, table in document.items():
        _known(key, [*_SECTIONS, "title", "rationale", "expect"], "the scene")
        if key in _SECTIONS:
            values[key] = _section(_SECTIONS[key], table, key)
        elif key == "expect":
            if not isinstance(table, dict):
                raise InputError(f"expect = {table!r}: must hold tables such as [expect.specular]")
            for quantity in table:
                _known(quantity, list(QUANTITIES), "[expect]")
            values[key] = {q: _section(Expectation, t, f"expect.{q}") for q, t in table.items()}
        else:
            values[key] = table
    return Scene(**values)


def read(path: Path) -> Scene:
    """Read a scene file; a relative ``surface.file`` is looked for beside it.

    If the scene comes from a pipe, it is looked for in the working directory.
    """
    return read_with_tables(path)[0]


def read_with_tables(path: Path) -> tuple[Scene, Mapping[str, Any]]:
    """Read a scene file, and its tables as they stand there, without what is left open."""
    content = read_once(path, "give a scene file (.toml)", _MAX_BYTES)
    try:
        text = io.StringIO(content.decode("utf-8-sig"), newline=None).read()
        scene = from_toml(text)
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not a text in UTF-8; give a scene file (.toml)") from error
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    if scene.surface.file is not None:
        folder = path.parent if path.is_file() else Path()
        file = str(folder / scene.surface.file)
        scene = replace(scene, surface=replace(scene.surface, file=file))
    return scene, tomllib.loads(text)


def from_toml(text: str) -> Scene:
    """Build a scene from the text of a scene file, as results hold it."""
    try:
        return from_dict(tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"not a scene: {error}") from error
    except RecursionError as error:
        raise InputError("not a scene: nested too deeply; a scene is tables of values") from error


def to_toml(scene: Scene) -> str:
    """Write a scene as a scene file; `from_dict` of it gives the same scene."""

    def plain(value: Any) -> Any:
        if isinstance(value, Mapping):
            return {k: plain(v) for k, v in value.items() if v is not None}
        if isinstance(value, tuple):
            return [plain(v) for v in value]
        return value

    return tomli_w.dumps(plain(asdict(scene)), multiline_strings=False)
