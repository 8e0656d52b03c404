"""From a map of heights to a surface: units in µm, a plausible pixel, no voids, and its origin."""

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from . import voids as void_points
from .declared import Declared
from .heightfield import Heightfield, Spacing, check_layout, spacing_pair
from .readers.height_map import MICROMETRES, ORIENTATION, PIXELS, HeightMap, unit_named

Array = NDArray[np.float64]

_SAME_SPACING = 1e-6  # relative
_NUMBER_AND_UNIT = re.compile(r"([0-9]*\.?[0-9]+(?:[eE][+-]?[0-9]+)?)?\s*([^0-9\s.]+)")


def from_array(
    heights: ArrayLike,
    spacing: Spacing = 1.0,
    boundary: str = "mirror",
    voids: str | None = None,
    provenance: Mapping[str, Any] = MappingProxyType({}),
) -> Heightfield:
    """Make a surface from measured heights with gaps.

    Parameters
    ----------
    heights : array_like, shape (rows, columns)
        Any unit of length; NaN, infinite or masked where nothing was measured.
    spacing : float or (float, float)
        Distance of neighbouring heights in the same unit, > 0, or those along x and y.
    boundary : str
        ``"mirror"`` or ``"periodic"``.
    voids : str, optional
        See `voids.mend`.
    provenance : Mapping
        What is known of its origin, see `Heightfield`.

    Raises
    ------
    InputError
        If the heights are none, or voids are refused.

    """
    raw: np.ma.MaskedArray[Any, Any] = np.ma.asarray(heights)
    check_layout(raw.shape, raw.dtype)
    values = np.ma.filled(raw.astype(np.float64), np.nan)
    pixel = spacing_pair(spacing)
    mended = void_points.mend(values, pixel, voids, periodic=boundary == "periodic")
    known = dict(provenance)
    if known or mended.report["share"] > 0:
        known |= {"pixel": list(pixel), "voids": mended.report}
    return Heightfield(mended.heights, pixel, boundary, filled=mended.filled, provenance=known)


def completed(stored: HeightMap, name: str, declared: Declared) -> Heightfield:
    """Make a surface of what an instrument's file of some name says, and what the user says of it.

    Heights and pixel come out in µm.

    Raises
    ------
    InputError
        If neither says the unit or the pixel, or they contradict each other.

    """
    check_layout(stored.heights.shape, stored.heights.dtype)
    factor, unit = _height_unit(stored, declared.height_unit)
    return from_array(
        marked(stored.heights, declared.void_value) * factor,
        _pixel(stored, declared.spacing),
        declared.boundary or ("periodic" if stored.periodic else "mirror"),
        declared.voids,
        {
            "file": name,
            "reader": stored.reader,
            "format": stored.format,
            "channel": stored.channel,
            "channels": list(stored.channels),
            "unit": "µm",
            "unit_in_file": unit,
            "orientation": ORIENTATION,
        },
    )


def marked(heights: NDArray[Any], void_value: float | None) -> Array:
    """Return heights in float64 with NaN where they equal the mark for voids.

    Raises
    ------
    InputError
        If another height looks like such a mark.

    """
    values = np.array(heights, dtype=np.float64)
    if void_value is not None:
        result = heights == heights.dtype.type(void_value)
        if not result.any():
            raise InputError(f"void_value = {void_value}: no height is that; leave it out")
        values[result] = np.nan
    suspicion = void_points.suspicious(values)
    if suspicion is not None:
        raise InputError(f"{suspicion} Say so with --void-value, or take them out")
    return values


def _height_unit(stored: HeightMap, scene: str | None) -> tuple[float, str]:
    """Return micrometres in one of the file's heights, and the unit's name."""
    if stored.unit is not None:
        if scene is not None and unit_named(scene) != stored.unit:
            raise InputError(f"height_unit = {scene!r}: the file says {stored.unit}; leave it out")
        return MICROMETRES[stored.unit], stored.unit
    if scene is None:
        raise InputError(
            "the file does not say the unit of its heights; give --height-unit, such as nm, or "
            "0.5nm for half a nanometre a grey level"
        )
    return height_factor(scene), scene


def height_factor(scene: str) -> float:
    """Return micrometres in a unit such as "nm" or "0.5nm".

    Raises
    ------
    InputError
        If it is none.

    """
    parts = _NUMBER_AND_UNIT.fullmatch(scene.strip())
    if parts is None:
        raise InputError(f"height_unit = {scene!r}: must be like nm, or 0.5nm")
    number, name = parts.groups()
    factor = float(number or 1) * MICROMETRES[unit_named(name)]
    if not 0 < factor < np.inf:
        raise InputError(f"height_unit = {scene!r}: its number must be finite and > 0")
    return factor


def _pixel(stored: HeightMap, scene: Spacing | None) -> tuple[float, float]:
    """Return the pixel in µm: the file's if it is plausible, else the one asked for."""
    given = None if scene is None else spacing_pair(scene)
    result = None
    if stored.pixel is not None and stored.unit is not None:
        factor = MICROMETRES[stored.unit]
        result = (stored.pixel[0] * factor, stored.pixel[1] * factor)
    if result is not None and all(PIXELS[0] <= d <= PIXELS[1] for d in result):
        if given is not None and not np.allclose(given, result, rtol=_SAME_SPACING, atol=0):
            raise InputError(
                f"spacing = {given}: the file says {result[0]:g} × {result[1]:g} µm; leave it out"
            )
        return result
    if given is None and result is None:
        raise InputError("the file does not say its pixel; give --spacing in µm")
    if given is None and result is not None:
        raise InputError(
            f"its pixel would be {result[0]:g} × {result[1]:g} µm; must be "
            f"{PIXELS[0]:g} … {PIXELS[1]:g} µm. If the file's unit is wrong, give --spacing in µm"
        )
    assert given is not None  # noqa: S101 - one of both is there
    if not all(PIXELS[0] <= d <= PIXELS[1] for d in given):
        raise InputError(f"spacing = {given}: must be {PIXELS[0]:g} … {PIXELS[1]:g} µm")
    return given
