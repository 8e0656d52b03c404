"""pbrt-v2's ``.brdf``: scattered pairs as text, angles in radians.

Numbers between ``#`` comments: how many wavelengths, those in nm, and a row for each pair,
θ_i φ_i θ_o φ_o and a value for each wavelength (pbrt-v2, materials/measured.cpp).
"""

from pathlib import Path

import numpy as np

from ...errors import InputError
from .scattered import MeasuredBrdf, check_size, of_rows
from .text import as_numbers, read_text

NAME = "pbrt-v2 .brdf"
ENDINGS = (".brdf",)


def read(path: Path) -> MeasuredBrdf:
    """Read a file.

    Raises
    ------
    InputError
        If it is truncated or something else.

    """
    words = [w for line in read_text(path).splitlines() for w in line.partition("#")[0].split()]
    if not words:
        raise InputError("no numbers in it: not a .brdf of pbrt-v2")
    if not words[0].isdigit() or not 1 <= int(words[0]) <= 10_000:
        raise InputError(
            f"starts with {words[0][:40]!r}: must start with the number of wavelengths, 1 … 10000"
        )
    count = int(words[0])
    wavelengths = as_numbers(words[1 : 1 + count], "wavelengths")
    if len(wavelengths) < count:
        raise InputError(f"{len(wavelengths)} of {count} wavelengths; the file is truncated")
    body = words[1 + count :]
    columns = 4 + count
    if len(body) % columns:
        raise InputError(
            f"{len(body)} numbers follow the wavelengths: must be a multiple of {columns}, four "
            f"angles and {count} values a pair; the file is truncated or damaged"
        )
    check_size(len(body) // columns, count)
    rows = as_numbers(body, "pairs").reshape(-1, columns)
    steep = float(np.abs(rows[:, [0, 2]]).max())
    if steep > np.pi:
        raise InputError(f"a polar angle of {steep:g}: angles must be in radians")
    return of_rows(rows[:, :4], rows[:, 4:], (), tuple(wavelengths))
