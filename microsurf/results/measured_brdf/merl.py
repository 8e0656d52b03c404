"""MERL's ``.binary``: an isotropic table over half and difference angles, RGB.

Matusik, Pfister, Brand and McMillan, "A Data-Driven Reflectance Model", ACM TOG 22(3), 2003.
Three 32-bit integers, 90 × 90 × 180 for θ_h, θ_d and φ_d, and as many doubles for each of
red, green and blue, scaled. Cells are even in √θ_h, θ_d and φ_d in [0, π), and are read
at their centres. Negative values stand for what is below the horizon or was not measured.
"""

from pathlib import Path

import numpy as np

from ...errors import InputError
from .scattered import MeasuredBrdf

NAME = "MERL .binary"
ENDINGS = (".binary",)

SHAPE = (90, 90, 180)
SCALES = (1.0 / 1500, 1.15 / 1500, 1.66 / 1500)
"""sr⁻¹ a unit of the file, red, green and blue."""


def read(path: Path) -> MeasuredBrdf:
    """Read a file.

    Raises
    ------
    InputError
        If its shape or its size is another.

    """
    size, cells = path.stat().st_size, int(np.prod(SHAPE))
    with path.open("rb") as stream:
        header = stream.read(12)
        if len(header) < 12 or tuple(np.frombuffer(header, "<i4")) != SHAPE:
            raise InputError("must start with 90, 90 and 180 as 32-bit integers: not MERL's table")
        if size != 12 + 24 * cells:
            raise InputError(f"{size} bytes, a table takes {12 + 24 * cells}; truncated or damaged")
        table = np.frombuffer(stream.read(24 * cells), "<f8").reshape(3, cells)
    theta_i, phi_i, theta_o, phi_o = angles()
    with np.errstate(invalid="ignore"):
        values = np.where(table < 0, np.nan, table).T * SCALES
    return MeasuredBrdf(theta_i, phi_i, theta_o, phi_o, values, ("R", "G", "B"))


def write(values: np.ndarray, path: Path) -> None:
    """Write values in sr⁻¹, shape (cells, 3), as `angles`; NaN is below the horizon."""
    table = np.where(np.isnan(values), -1.0, values / SCALES).T
    with path.open("wb") as stream:
        stream.write(np.array(SHAPE, "<i4").tobytes() + table.astype("<f8").tobytes())


def angles() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """θ_i, φ_i, θ_o and φ_o of all cells in the order of the file, shape (cells,) each."""
    h, d, p = ((np.arange(n) + 0.5) / n for n in SHAPE)
    theta_h, theta_d, phi_d = np.meshgrid(h**2 * np.pi / 2, d * np.pi / 2, p * np.pi, indexing="ij")
    x, y = np.sin(theta_d) * np.cos(phi_d), np.sin(theta_d) * np.sin(phi_d)
    z, c, s = np.cos(theta_d), np.cos(theta_h), np.sin(theta_h)
    parts = []
    # The light is (x, y, z) about the half vector, the detector (−x, −y, z); both tilted by θ_h.
    for sign in (1, -1):
        up = c * z - s * sign * x
        parts += [
            np.arccos(np.clip(up, -1, 1)).ravel(),
            np.arctan2(sign * y, c * sign * x + s * z).ravel(),
        ]
    return parts[0], parts[1], parts[2], parts[3]
