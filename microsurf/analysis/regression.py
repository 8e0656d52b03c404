"""What moved since an old report: each figure against its old self, beyond both errors.

Figures are matched by scene, quantity, θ_i, φ_i and Kd. Two means with their standard
errors differ by Welch's t (Biometrika 34, 1947), whose degrees of freedom come from the
number of surfaces behind each; Holm's step-down (Scandinavian Journal of Statistics 6,
1979) holds the chance of one false alarm among all figures at LEVEL. Predictions without
an error of their own are quadratures: they moved if by more than QUADRATURE.
"""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

import numpy as np

from ..errors import InputError
from ..files import read_once
from ..stats import intervals
from ..stats.hypothesis_tests import holm

SCHEMA = 3
"""Version of report.json: another one has other keys, or another meaning of one."""
LEVEL = 0.01
QUADRATURE = 1e-4
_ROUNDING = 1e-9
"""Relative difference that is no difference: sums in another order."""

_MOST_BYTES = 1_000_000_000
_LARGEST = 1e60
"""No figure of a report comes near; fourth powers of errors up to here are finite."""

_FIGURES = ("measured", "predicted")
_KEY = ("quantity", "theta_i", "phi_i", "kd")
_NUMBERS = ("theta_i", "phi_i", "kd", "measured", "standard_error", "predicted", "predicted_error")
_ERRORS = ("standard_error", "predicted_error")
_TEXTS = ("quantity", "basis", "verdict")

Key = tuple[Any, ...]


class Pair(NamedTuple):
    """Two means, their standard errors and degrees of freedom: old and new."""

    means: tuple[float, float]
    errors: tuple[float, float]
    dof: tuple[float, float]


def read_report(path: Path) -> dict[str, Any]:
    """Read an old report.json.

    Raises
    ------
    InputError
        If it is none, damaged, or of another schema.

    """

    def refuse(what: str) -> NoReturn:
        raise InputError(f"--baseline {path}: {what}; give a report.json that validate wrote")

    instead = "give a report.json that `microsurf validate` wrote"
    content = read_once(path, instead, _MOST_BYTES)
    try:
        document = json.loads(content.decode(), parse_constant=refuse)
    except (ValueError, RecursionError) as error:
        if isinstance(error, InputError):
            raise
        refuse(f"not JSON, or damaged ({str(error)[:100]})")
    if not isinstance(document, dict) or "schema" not in document:
        refuse("no report of microsurf")
    if document["schema"] != SCHEMA:
        raise InputError(
            f"--baseline {path}: schema = {document['schema']!r}, this microsurf reads {SCHEMA}; "
            f"write it again with microsurf {_version()}"
        )
    try:
        damaged = [scene["name"] for scene in document["scenes"] if not _whole(scene)]
    except (KeyError, TypeError):
        refuse("damaged, a scene lacks its name or comparisons")
    if damaged:
        refuse(f"damaged in scene {damaged[0]!r}")
    return document


def _whole(scene: dict[str, Any]) -> bool:
    """Whether a scene holds all that is compared."""
    return isinstance(scene["name"], str) and all(
        all(_number(row.get(name)) for name in _NUMBERS)
        and all(isinstance(row.get(name), str) for name in _TEXTS)
        and min(row[name] for name in _ERRORS) >= 0
        for row in scene["comparisons"]
    )


def _number(value: Any) -> bool:
    """Whether it is a number that can be reckoned with: 1e999 reads as infinite."""
    plain = isinstance(value, int | float) and not isinstance(value, bool)
    return plain and abs(value) <= _LARGEST


def _version() -> str:
    from .. import __version__  # noqa: PLC0415 - of the package that is still being loaded

    return __version__


def against(new: dict[str, Any], old: dict[str, Any], name: str) -> dict[str, Any]:
    """Compare two documents of report.json; ``name`` is what the old one is called.

    Returns
    -------
    dict
        level and figures of the family; ``moved``, the figures that moved, greatest
        first, each with old and new value, difference, its standard error, z (the
        difference over it; null of a prediction without error), p and Holm's p;
        ``verdicts``, those that changed; what ``appeared`` and ``vanished``.

    """
    before, now = dict(_rows(old)), dict(_rows(new))
    shared = [key for key in now if key in before]
    moved_rows = [
        {**_place(key), "figure": figure, **_difference(_pair(before[key], now[key], figure))}
        for key in shared
        for figure in _FIGURES
    ]
    family = [row for row in moved_rows if row["z"] is not None]
    for row, p in zip(family, holm(np.array([row["p"] for row in family])), strict=True):
        row["p_holm"] = float(p)
    moved = [row for row in moved_rows if row["p_holm"] < LEVEL]
    return {
        "file": name,
        "microsurf": str(old.get("microsurf", "")),
        "level": LEVEL,
        "figures": len(moved_rows),
        "moved": sorted(moved, key=_relative, reverse=True),
        "verdicts": [
            {**_place(key), "old": before[key]["verdict"], "new": now[key]["verdict"]}
            for key in shared
            if before[key]["verdict"] != now[key]["verdict"]
        ],
        "appeared": _gone(new, old, now, before),
        "vanished": _gone(old, new, before, now),
    }


def _rows(document: dict[str, Any]) -> Iterator[tuple[Key, dict[str, Any]]]:
    for scene in document["scenes"]:
        for row in scene["comparisons"]:
            yield (scene["name"], *(row[name] for name in _KEY)), row


def _place(key: Key) -> dict[str, Any]:
    return dict(zip(("scene", *_KEY), key, strict=True))


def _relative(row: dict[str, Any]) -> float:
    return float(abs(row["difference"]) / max(abs(row["old"]), abs(row["new"])))


def _gone(
    here: dict[str, Any], there: dict[str, Any], rows: dict[Key, Any], others: dict[Key, Any]
) -> list[str]:
    """Scenes, and comparisons of scenes that are in both, which only one document has."""
    names, known = ([s["name"] for s in d["scenes"]] for d in (here, there))
    scenes = [f"scene {name}" for name in names if name not in known]
    return scenes + [
        f"{key[0]}: {key[1]} at θ_i = {key[2]:g}, φ_i = {key[3]:g}, Kd = {key[4]:g}"
        for key in rows
        if key not in others and key[0] in known
    ]


def _pair(old: dict[str, Any], new: dict[str, Any], figure: str) -> Pair:
    rows = (old, new)
    error = "standard_error" if figure == "measured" else "predicted_error"
    means, errors = (tuple(float(row[name]) for row in rows) for name in (figure, error))
    dof = tuple(_dof(row["basis"]) if figure == "measured" else np.inf for row in rows)
    return Pair(*(pair[:2] for pair in (means, errors, dof)))  # type: ignore[arg-type]


def _dof(basis: str) -> float:
    """Degrees of freedom of a standard error: surfaces − 1; many of rays on one surface."""
    surfaces = re.match(r"(\d+) surfaces", basis)
    return max(float(surfaces[1]) - 1, 1.0) if surfaces else np.inf


def _difference(pair: Pair) -> dict[str, Any]:
    """Difference, its standard error, z and p."""
    (old, new), variances = pair.means, np.square(pair.errors)
    difference, error = new - old, float(np.sqrt(variances.sum()))
    size = max(abs(old), abs(new))
    z: float | None = None
    if abs(difference) <= _ROUNDING * size:
        z, p = 0.0, 1.0
    elif error == 0:
        p = 0.0 if abs(difference) > QUADRATURE * size else 1.0
    else:
        z = difference / error
        p = intervals.two_sided_p(z, float(intervals.dof_of_sum(variances, pair.dof)))
    return {
        "old": old,
        "new": new,
        "difference": difference,
        "error": error,
        "z": z,
        "p": p,
        "p_holm": p,
    }
