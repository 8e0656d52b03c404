"""What a reader of instruments' files gives: heights as they were stored, and what the file says.

Orientation is the same for all: seen from above, x to the right (columns), y down (rows).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError

Array = NDArray[np.float64]

ORIENTATION = "seen from above, x to the right, y down"

MICROMETRES = {
    "m": 1e6, "cm": 1e4, "mm": 1e3, "µm": 1.0, "nm": 1e-3, "Å": 1e-4, "pm": 1e-6,
    "in": 25400.0, "mil": 25.4,
}  # fmt: skip
"""Micrometres in a unit of length."""

PIXELS = (1e-4, 1e3)
"""Plausible pixels in µm: 0.1 nm … 1 mm. Outside, a unit was most likely mistaken."""

_SPELLINGS = {
    "um": "µm", "μm": "µm", "micron": "µm", "microns": "µm", "A": "Å", "Å": "Å",
    "angstrom": "Å", "inch": "in",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class HeightMap:
    """A map of heights as a file stores it.

    Attributes
    ----------
    heights : ndarray, shape (rows, columns)
        In ``unit``; the first row is the top one, see `ORIENTATION`. NaN where nothing
        was measured.
    pixel : (float, float) or None
        Distances (dx, dy) of neighbouring heights in ``unit``; None if the file does not say.
    unit : str or None
        A key of `MICROMETRES`; None if the file does not say.
    reader : str
        Library and its version.
    format : str
        Format of the file.
    channel : str
        The channel that was taken.
    channels : tuple of str
        All channels that hold heights.
    periodic : bool
        Whether the file calls it one period of a periodic surface.

    """

    heights: Array
    pixel: tuple[float, float] | None
    unit: str | None
    reader: str
    format: str
    channel: str
    channels: tuple[str, ...]
    periodic: bool = False


def unit_named(name: str) -> str:
    """Return the key of `MICROMETRES` for a unit as files and users spell it.

    Raises
    ------
    InputError
        If it is no unit of length.

    """
    plain = name.strip()
    plain = _SPELLINGS.get(plain, _SPELLINGS.get(plain.lower(), plain))
    if plain not in MICROMETRES:
        raise InputError(f"unit {name!r}: must be a unit of length: {', '.join(MICROMETRES)}")
    return plain


def choose(channel: str | None, names: list[str], default: int) -> int:
    """Return the index of a channel given by its name or its number from 0.

    Raises
    ------
    InputError
        If there is none of that name, or several: all are listed.

    """
    if channel is None:
        return default
    matches = [i for i, name in enumerate(names) if name == channel]
    if not matches and channel.isdecimal() and int(channel) < len(names):
        matches = [int(channel)]
    if len(matches) != 1:
        listed = ", ".join(f"{i} = {name!r}" for i, name in enumerate(names))
        raise InputError(f"channel {channel!r}: must be one of {listed}")
    return matches[0]


def first_line(error: Exception) -> str:
    """Give the first line of another library's error, cut to fit into one of ours."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return (lines[0] if lines else type(error).__name__)[:120]
