"""Points that were not measured: refused, cropped away, or filled and remembered.

Filled heights are harmonic: each is the mean of its four neighbours, weighted by
1/distance², so that a hole continues its rim smoothly. What was filled stays marked
(`Heightfield.filled`), and its facets stay out of fits, levelling and statistics.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..errors import InputError
from ..scene import VOIDS

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

CROP_KEEPS = 0.9
"""Share of the points that cropping must keep to be chosen unasked."""
_FAR = 10.0
"""Ranges of all other heights by which the mark of a void lies outside them."""


@dataclass(frozen=True, eq=False)
class Mended:
    """Heights without gaps.

    heights, shape (rows, columns), all finite; filled, the points that were filled, or
    None; report: share of voids, what was done, and the share of points kept.
    """

    heights: Array
    filled: Mask | None
    report: dict[str, Any]


def mend(
    heights: Array,
    pixel: tuple[float, float],
    choice: str | None = None,
    *,
    periodic: bool = False,
) -> Mended:
    """Do away with voids.

    Parameters
    ----------
    heights : ndarray, shape (rows, columns)
        NaN where nothing was measured.
    pixel : (float, float)
        Distances (dx, dy) of neighbouring heights, > 0.
    choice : str, optional
        ``"refuse"``, ``"crop"`` to the largest rectangle without voids, or ``"fill"``.
        Without one: crop if that keeps 90 % of the points, else fill.
    periodic : bool
        Whether the map is one period of a surface, which a part of it is not: filled.

    Raises
    ------
    InputError
        If a height is infinite, or there are voids and they are refused, or nothing else is
        there, or a period is to be cropped.

    """
    if choice is not None and choice not in VOIDS:
        raise InputError(f"voids = {choice!r}: must be one of {', '.join(VOIDS)}")
    infinite = int(np.count_nonzero(np.isinf(heights)))
    if infinite:
        raise InputError(
            f"heights: {infinite} of {heights.size} are infinite; mark what was not measured as NaN"
        )
    void = np.isnan(heights)
    count = int(np.count_nonzero(void))
    if count == 0:
        return Mended(heights, None, {"share": 0.0, "treatment": "none"})
    share = count / void.size
    if count == void.size:
        raise InputError(f"all {count} points are voids; measure again")
    if choice == "refuse":
        raise InputError(
            f"voids = 'refuse': {count} of {void.size} points ({share:.2%}) were not measured; "
            "take 'crop' or 'fill'"
        )
    if choice == "crop" and periodic:
        raise InputError("voids = 'crop': a part of a period is none; take boundary = 'mirror'")
    if choice != "fill" and not periodic:
        rows, columns = largest_rectangle(void)
        cropped = heights[rows, columns]
        kept = cropped.size / heights.size
        if choice == "crop" or kept >= CROP_KEEPS:
            return Mended(cropped, None, {"share": share, "treatment": "crop", "kept": kept})
    return Mended(fill(heights, void, pixel), void, {"share": share, "treatment": "fill"})


def largest_rectangle(void: Mask) -> tuple[slice, slice]:
    """Return rows and columns of the largest rectangle that holds no void.

    For each point the column of free points above it is widened as far as it goes:
    one of these rectangles is the largest. O(rows) operations on rows.
    """
    columns = void.shape[1]
    index = np.arange(columns)
    height, left, right = np.zeros((3, columns), dtype=np.int64)
    right += columns
    best, result = 0, (slice(0, 0), slice(0, 0))
    for row, blocked in enumerate(void):
        height = np.where(blocked, 0, height + 1)
        from_left = np.maximum.accumulate(np.where(blocked, index + 1, 0))
        from_right = np.minimum.accumulate(np.where(blocked, index, columns)[::-1])[::-1]
        left = np.where(blocked, 0, np.maximum(left, from_left))
        right = np.where(blocked, columns, np.minimum(right, from_right))
        area = height * (right - left)
        widest = int(area.argmax())
        if area[widest] > best:
            best = int(area[widest])
            result = (
                slice(row + 1 - int(height[widest]), row + 1),
                slice(int(left[widest]), int(right[widest])),
            )
    return result


def fill(heights: Array, void: Mask, pixel: tuple[float, float]) -> Array:
    """Fill voids with the discrete harmonic function that meets their rims.

    At the edge of the map the function is level across it. At least one point must have
    been measured.
    """
    rows, columns = heights.shape
    number = np.full(void.shape, -1)
    unknown = np.flatnonzero(void)
    number.flat[unknown] = np.arange(unknown.size)
    diagonal, right_side = np.zeros((2, unknown.size))
    entries: list[tuple[Array, Any, Any]] = []
    for dy, dx in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        # In units of the mean pixel, or weights of nanometres in metres overflow.
        weight = pixel[0] / pixel[1] if dx == 0 else pixel[1] / pixel[0]
        y, x = unknown // columns + dy, unknown % columns + dx
        inside = (y >= 0) & (y < rows) & (x >= 0) & (x < columns)
        row, y, x = np.flatnonzero(inside), y[inside], x[inside]
        diagonal[row] += weight
        other = number[y, x]
        known = other < 0
        right_side[row[known]] += weight * heights[y[known], x[known]]
        entries.append((np.full(int((~known).sum()), -weight), row[~known], other[~known]))
    values, i, j = (np.concatenate(part) for part in zip(*entries, strict=True))
    here = np.arange(unknown.size)
    matrix = sparse.csc_matrix(
        (np.append(values, diagonal), (np.append(i, here), np.append(j, here)))
    )
    mended = heights.copy()
    mended.flat[unknown] = sparse.linalg.spsolve(matrix, right_side)
    return mended


def suspicious(heights: Array) -> str | None:
    """Say which value looks like an instrument's mark for voids, or None.

    It is the lowest or the highest one, and lies ten times the range of all other
    heights outside of them.
    """
    measured = heights[np.isfinite(heights)]
    for value in (measured.min(), measured.max()) if measured.size else ():
        others = measured[measured != value]
        if others.size == 0:
            return None
        low, high = float(others.min()), float(others.max())
        with np.errstate(over="ignore"):
            gap, extent = max(low - value, value - high), high - low
        if extent > 0 and gap > _FAR * extent:
            return (
                f"{measured.size - others.size} heights are exactly {value:g}, all others "
                f"{low:g} … {high:g}: a mark for voids?"
            )
    return None
