"""How commands print: one JSON object, or a table for people."""

import json
import os
import sys
from pathlib import Path
from typing import Any

import click

from ..errors import InputError, MicrosurfError
from ..scene import BECKMANN


def _json(values: dict[str, Any]) -> str:
    try:
        return json.dumps(values, allow_nan=False)
    except ValueError as error:
        raise MicrosurfError(
            f"a figure is not finite, and JSON has no such number: {values}"
        ) from (error)


def _table(values: dict[str, Any]) -> str:
    width = max(len(key) for key in values)
    return "\n".join(f"{key:<{width}}  {_shown(value)}" for key, value in values.items())


def _shown(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list):
        nested = any(isinstance(v, list) for v in value)
        return (
            ", ".join(f"[{_shown(v)}]" for v in value) if nested else "  ".join(map(_shown, value))
        )
    if isinstance(value, dict):
        return ", ".join(f"{k}: {_shown(v)}" for k, v in value.items())
    return str(value)


def show(values: dict[str, Any], as_json: bool) -> None:
    """Print what a command found."""
    write((_json if as_json else _table)(values))


def write(text: str) -> None:
    """Print to stdout; if its reader has gone (``| head``) the work was done all the same."""
    if sys.stdout is None:  # closed by the caller: nobody wants it
        return
    try:
        click.echo(text)
        sys.stdout.flush()
    except BrokenPipeError:
        # Or Python complains when it flushes at the end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def number(value: Any) -> str:
    """Four digits; ∞ for a γ of Beckmann, which may be the text "inf"; lists with commas."""
    if isinstance(value, list):
        return ", ".join(map(number, value))
    return "∞" if float(value) >= BECKMANN else f"{float(value):.4g}"


def check_ending(path: Path, *endings: str) -> None:
    """Refuse a file whose ending none of the formats has."""
    if path.suffix.lower() not in endings:
        raise InputError(f"{path}: the ending must be {' or '.join(endings)}")
