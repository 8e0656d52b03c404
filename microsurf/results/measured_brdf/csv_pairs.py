"""Scattered pairs as CSV with a header, read and written.

The header names the columns, in any order: ``theta_i, phi_i, theta_o, phi_o`` in degrees
(``phi_i`` may be left out: 0), and the BRDF in sr⁻¹ as one column a channel, ``f_550nm`` or
``f_R``, or as one column ``f`` beside a column ``wavelength`` in nm, one row for each pair and
wavelength. The columns of the NIST goniometers are known too: ``lambda`` (µm), ``thetai``,
``phi``, ``thetar``, ``phir`` and ``f_r11`` (Germer, Applied Optics 2017). Other columns are
left out. Lines that start with ``#`` are comments.
"""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...files import whole_file
from .scattered import MeasuredBrdf, check_size, of_rows
from .text import read_text, table

Array = NDArray[np.float64]

NAME = "CSV"
ENDINGS = (".csv",)

_ANGLES = ("theta_i", "phi_i", "theta_o", "phi_o")
_ALIASES = {
    "thetai": "theta_i",
    "phii": "phi_i",
    "phi": "phi_i",
    "thetar": "theta_o",
    "phir": "phi_o",
    "theta_r": "theta_o",
    "phi_r": "phi_o",
    "theta_s": "theta_o",
    "phi_s": "phi_o",
    "wavelength_nm": "wavelength",
    "f_r11": "f",
}
_MICROMETRES = "lambda"
_HEADER = "a header such as theta_i,phi_i,theta_o,phi_o,f_550nm (degrees, sr⁻¹)"


def read(path: Path) -> MeasuredBrdf:
    """Read a file.

    Raises
    ------
    InputError
        If it is truncated, or its header does not name what is needed.

    """
    lines = read_text(path).splitlines()
    start = next(
        (k for k, line in enumerate(lines) if line.strip() and not line.startswith("#")), len(lines)
    )
    names = [word.strip().strip('"').lower() for word in lines[start].split(",")]
    original = [word.strip().strip('"') for word in lines[start].split(",")]
    names = [_ALIASES.get(name.removesuffix("_deg"), name.removesuffix("_deg")) for name in names]
    indices = [_place(names, name) for name in ("theta_i", "theta_o", "phi_o")]
    phi_i = _place(names, "phi_i") if "phi_i" in names else None
    rows = table(lines[start + 1 :], start + 2, len(names), ",")
    theta_i, theta_o, phi_o = np.radians(rows[:, indices].T)
    azimuth = np.zeros(len(rows)) if phi_i is None else np.radians(rows[:, phi_i])
    angles = np.stack([theta_i, azimuth, theta_o, phi_o], axis=1)
    if "wavelength" in names or _MICROMETRES in names:
        return _long(angles, rows, names)
    if "f_r11" in original:
        raise InputError(
            f"f_r11 without a column {_MICROMETRES} in µm; add it, or name the column f_633nm"
        )
    columns = [k for k, name in enumerate(names) if name == "f" or name.startswith("f_")]
    for name in ("f_", "f_nm"):
        if name in original:
            raise InputError(f"a column {name} has no wavelength; name it, such as f_550nm")
    if not columns:
        raise InputError(f"no column f or f_… in its header; must have {_HEADER}")
    check_size(len(rows), len(columns))
    labels = [original[k][2:] or "f" for k in columns]
    if len(set(labels)) < len(labels):
        raise InputError(f"two columns of one name among f_{', f_'.join(labels)[:80]}; leave one")
    wavelengths = tuple(_nanometres(labels))
    named = len(wavelengths) == len(labels)
    least = int(np.unique(np.round(angles, 9), axis=0, return_counts=True)[1].min())
    if least > 1 and labels == ["f"]:
        raise InputError(
            f"each pair of directions stands there {least} times or more, and no column says of "
            "which wavelength; add a column wavelength in nm"
        )
    return of_rows(angles, rows[:, columns], labels, wavelengths if named else ())


def _place(names: list[str], name: str) -> int:
    if names.count(name) != 1:
        how = "no column" if name not in names else "more than one column"
        semicolons = ", separated by commas" if any(";" in word for word in names) else ""
        raise InputError(f"{how} {name} in its first line; must be {_HEADER}{semicolons}")
    return names.index(name)


def _nanometres(labels: list[str]) -> Iterator[float]:
    for label in labels:
        if match := re.fullmatch(r"([0-9]+\.?[0-9]*) ?nm", label):
            yield float(match[1])


def _long(angles: Array, rows: Array, names: list[str]) -> MeasuredBrdf:
    """One row for each pair and wavelength: a matrix with NaN where there is none."""
    micro = _MICROMETRES in names
    nanometres = rows[:, names.index(_MICROMETRES if micro else "wavelength")]
    nanometres = np.round(nanometres * (1000 if micro else 1), 6)
    value = rows[:, _place(names, "f")]
    wavelengths, channel = np.unique(nanometres, return_inverse=True)
    if not np.isfinite(wavelengths).all():
        raise InputError("a row has no wavelength; the file is damaged")
    _, first, pair = np.unique(
        np.round(angles, 9), axis=0, return_index=True, return_inverse=True
    )  # in the order of the angles, whatever that of the rows
    check_size(len(first), len(wavelengths))
    row = pair.reshape(-1) * len(wavelengths) + channel.reshape(-1)
    size = len(first) * len(wavelengths)
    often = np.bincount(row, minlength=size)
    with np.errstate(invalid="ignore"):
        mean = np.bincount(row, weights=value, minlength=size) / often
    remarks = []
    if (repeated := int(np.count_nonzero(often > 1))) > 0:
        remarks.append(f"{repeated} values were measured more than once: their mean is taken")
    values = mean.reshape(len(first), len(wavelengths))
    return of_rows(angles[first], values, (), tuple(wavelengths), remarks)


def write(brdf: MeasuredBrdf, path: Path) -> None:
    """Write the pairs with all their digits, so that `read` gives them back.

    Raises
    ------
    InputError
        If the file can't be written.

    """
    angles = np.degrees([brdf.theta_i, brdf.phi_i, brdf.theta_o, brdf.phi_o]).T
    header = ",".join([*_ANGLES, *(f"f_{name.replace(' ', '')}" for name in brdf.channels)])
    with whole_file(path) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as out:
        out.write(header + "\n")
        for pair, values in zip(angles, brdf.values, strict=True):
            numbers = ["" if np.isnan(v) else repr(float(v)) for v in values]
            out.write(",".join([*(repr(float(a)) for a in pair), *numbers]) + "\n")
