"""What a surface from a file leaves open, and what hints at a mistake: units, gaps, seams."""

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..scene import Surface
from .heightfield import Heightfield, facet_slopes, measured_facets

Array = NDArray[np.float64]

SLOPES = (5e-7, 2e3)
"""Median slopes that can be traced: those of the least and the largest σ, for every γ."""
_USUAL = (1e-3, 10.0)
_STEEPER = 1.1
"""Times a seam may be as steep as the steepest of the lines beside it.

The seam of a true period is one of its N lines: it is the steepest once in N surfaces, whatever
the correlation. By a tenth 1 of 600 seams was at 64², and 2 at 128²; of seams of cut maps of 45²
(6 correlation lengths a side) 2 % are missed, of larger ones none of 300.
"""


def assumed(surface: Surface) -> list[str]:
    """What is taken for granted of a file of bare heights, for people; else nothing."""
    if surface.file is None or not surface.file.lower().endswith(".npy"):
        return []
    taken = [
        text
        for text, given in (
            ("spacing 1 in the unit of its heights", surface.spacing),
            ("periodic", surface.boundary),
        )
        if given is None
    ]
    if not taken:
        return []
    how = "--spacing and --boundary, or surface.spacing and surface.boundary in a scene"
    return [f"{surface.file}: bare heights, taken as {' and '.join(taken)}; say it by {how}"]


def origin(h: Heightfield, name: str) -> list[str]:
    """How a measured surface was read, and what was done to it, for people."""
    provenance = h.provenance
    result = []
    if "reader" in provenance:
        dx, dy = h.pixel
        result.append(
            f"{name}: {provenance['format']} read by {provenance['reader']}, "
            f"channel {provenance['channel']!r}, "
            f"pixel {dx:.6g} × {dy:.6g} µm, heights in {provenance['unit_in_file']} taken to µm, "
            f"{provenance['orientation']}"
        )
    voids = provenance.get("voids", {"share": 0.0})
    if voids["share"] > 0:
        done = (
            f"cropped to the {voids['kept']:.1%} that have none"
            if voids["treatment"] == "crop"
            else "filled; their facets are traced, but stay out of fits and statistics"
        )
        result.append(f"{name}: {voids['share']:.2%} of its points were not measured: {done}")
    return result


def require_traceable(h: Heightfield, name: str) -> None:
    """Refuse slopes that can't be traced.

    Raises
    ------
    InputError
        If the median slope of the facets that slope is out of SLOPES. Where most facets are
        flat, a needle or a cliff on a plane may be steeper.

    """
    slope = _slopes(h)
    median = _median_sloping(slope)
    feature = slope.size and np.median(slope) == 0  # on a plane: a needle, a cliff
    if median and (median < SLOPES[0] or (median > SLOPES[1] and not feature)):
        raise InputError(
            f"{name}: its median slope is {median:.3g}: must be {SLOPES[0]:g} … {SLOPES[1]:g}; "
            f"{_units(h)} Give the right spacing"
        )


def hints(h: Heightfield, name: str) -> list[str]:
    """What hints at a mistake in a surface, for people; ``name`` is what they call it."""
    median, notes = _median_sloping(_slopes(h)), []
    if median == 0:
        return []
    if not _USUAL[0] <= median <= _USUAL[1]:
        word = "flat" if median < 1 else "steep"
        notes.append(f"{name}: a median slope of {median:.3g} is very {word}: {_units(h)}")
    return notes + (_seams(h, name) if h.boundary == "periodic" else [])


def _slopes(h: Heightfield) -> Array:
    """Slopes of the measured facets."""
    slope, measured = np.hypot(*facet_slopes(h)), measured_facets(h)
    return np.asarray(slope if measured is None else slope[measured])


def _median_sloping(slope: Array) -> float:
    """Median of the slopes that are not zero; 0 if all are."""
    sloping = slope[slope > 0]
    return float(np.median(sloping)) if sloping.size else 0.0


def _units(h: Heightfield) -> str:
    return f"are heights and spacing ({min(h.pixel):g}) in the same unit?"


def _seams(h: Heightfield, name: str) -> list[str]:
    """Seams of the period that are steeper than what they join."""
    notes = []
    for axis, letter, spacing in ((1, "x", h.pixel[0]), (0, "y", h.pixel[1])):
        inside = np.abs(np.diff(h.heights, axis=axis)) / spacing
        ends = np.take(h.heights, [0, -1], axis=axis)
        seam = float(np.median(np.abs(np.diff(ends, axis=axis)))) / spacing
        steepest = float(np.median(inside, axis=1 - axis).max())
        usual = float(np.median(inside)) or float(np.mean(inside))
        if seam > _STEEPER * steepest and usual > 0:
            notes.append(
                f"{name}: periodic, but the seam in {letter} is {seam / usual:.3g} times as steep "
                f"as the surface (median slope {seam:.3g}, inside {usual:.3g}) and counts as part "
                "of it; take boundary mirror, or level a tilt"
            )
    return notes
