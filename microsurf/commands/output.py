"""How commands print: one JSON object, or a table for people."""

import json
from pathlib import Path
from typing import Any

import click

from ..errors import InputError


def _print_json(values: dict[str, Any]) -> None:
    click.echo(json.dumps(values, allow_nan=False))


def _print_table(values: dict[str, Any]) -> None:
    width = max(len(key) for key in values)
    for key, value in values.items():
        click.echo(f"{key:<{width}}  {_shown(value)}")


def _shown(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list):
        return "  ".join(_shown(v) for v in value)
    if isinstance(value, dict):
        return ", ".join(f"{k}: {_shown(v)}" for k, v in value.items())
    return str(value)


def show(values: dict[str, Any], as_json: bool) -> None:
    """Print what a command found."""
    (_print_json if as_json else _print_table)(values)


def check_ending(path: Path, *endings: str) -> None:
    """Refuse a file whose ending none of the formats has."""
    if path.suffix.lower() not in endings:
        raise InputError(f"{path}: the ending must be {' or '.join(endings)}")
