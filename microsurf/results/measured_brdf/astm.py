"""ASTM E1392 and E2387 text: lines of keywords, the names of the columns, and rows.

The line ``VARS theta_i,phi_i,theta_s,phi_s,400nm,…`` names the columns of all that follows;
values are in sr⁻¹. ``NUM_POINTS`` says how many rows there are. Angles are in degrees or
radians, and few files say which: see `_unit`. Commas or blanks separate.
"""

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from .scattered import MeasuredBrdf, check_size, of_rows
from .text import read_text, table

NAME = "ASTM E1392/E2387"
SHARED = (".asc", ".txt")
"""Endings that other files have as well."""
ENDINGS = (".astm", *SHARED)

_ANGLES = ("theta_i", "phi_i", "theta_s", "phi_s")


def read(path: Path) -> MeasuredBrdf:
    """Read a file.

    Raises
    ------
    InputError
        If it has no line VARS, is truncated, or the unit of its angles can't be known.

    """
    lines = read_text(path).splitlines()
    start = next((k for k, line in enumerate(lines) if line.strip().startswith("VARS")), None)
    if start is None:
        raise InputError("no line VARS, which names its columns: not a text of ASTM E1392")
    words = lines[start].strip().removeprefix("VARS").replace("=", " ")
    delimiter = "," if "," in words else " "
    split = words.split(delimiter) if delimiter == "," else words.split()
    names = [word.strip() for word in split if word.strip()]
    lower = [name.lower() for name in names]
    if tuple(lower[:4]) != _ANGLES or len(names) < 5:
        raise InputError(
            f"VARS {', '.join(names)[:80]}: must be theta_i, phi_i, theta_s, phi_s and a value"
        )
    rows = table(lines[start + 1 :], start + 2, len(names), delimiter)
    _check_count(lines[:start], len(rows))
    check_size(len(rows), len(names) - 4)
    scale, remark = _unit(lines[:start], rows)
    matches = [re.fullmatch(r"([0-9]+\.?[0-9]*) ?nm", name) for name in names[4:]]
    wavelengths = tuple(float(match[1]) for match in matches if match)
    named = len(wavelengths) == len(names) - 4
    return of_rows(
        rows[:, :4] * scale, rows[:, 4:], names[4:], wavelengths if named else (), [remark]
    )


def _check_count(header: list[str], rows: int) -> None:
    for line in header:
        words = line.replace("=", " ").split()
        if words[:1] == ["NUM_POINTS"]:
            if len(words) < 2 or not words[1].isdigit():
                raise InputError(f"{line.strip()[:60]}: must be NUM_POINTS and a whole number")
            if int(words[1]) != rows:
                raise InputError(
                    f"NUM_POINTS {words[1]}, and {rows} rows follow; the file is truncated"
                )


def _unit(header: list[str], rows: NDArray[np.float64]) -> tuple[float, str]:
    """Radians a unit of the file's angles, and how that is known.

    A header that speaks of one unit decides; else polar angles do: above π/2 they can't be
    radians, and no goniometer stays within π/2 degrees of the normal.
    """
    said = " ".join(header).lower()
    degrees, radians = "degree" in said, "radian" in said
    steep = float(np.nanmax(np.abs(rows[:, [0, 2]])))
    if degrees == radians:
        degrees = steep > np.pi / 2 + 1e-3
        why = f"polar angles reach {steep:.4g}"
    else:
        why = "its header says so"
    return (np.pi / 180 if degrees else 1.0), (
        f"angles are read as {'degrees' if degrees else 'radians'}: {why}"
    )
