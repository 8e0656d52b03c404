"""A surface as heights on a rectangular grid, and the triangles it stands for.

Heights lie at integer grid points times the spacing; row = y, column = x: seen from
above, x runs to the right and y down. Each cell is split by the diagonal from its
(x, y) corner to its (x+1, y+1) corner into a *lower* triangle (x, y), (x+1, y),
(x+1, y+1) and an *upper* triangle (x, y), (x+1, y+1), (x, y+1).

The plane is filled either *periodically* (rows × columns heights are as many
cells) or by *mirrors* along the grid's edges: one period of that is
2(rows−1) × 2(columns−1) cells, no edge row twice, and the mirrored parts carry
the mirrored diagonal.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, real_array, require_real
from ..physics import student_t
from ..scene import BOUNDARIES, MAX_CELLS
from ..scene.notebook import sections

Array = NDArray[np.float64]

Spacing = float | tuple[float, float]
"""Distance of neighbouring grid points, or those along x and y."""

MAX_ASPECT = 1e3
"""Times the longer side of a cell may be as long as the shorter one where rays are traced."""


@dataclass(frozen=True, eq=False)
class Heightfield:
    """Heights over the plane.

    Parameters
    ----------
    heights : ndarray, shape (rows, columns)
        Real and finite, in the user's unit of length; 2 … 16384 a side. Kept as
        a read-only copy in float64.
    spacing : float or (float, float)
        Distance of neighbouring grid points in the same unit, > 0; two if they differ
        along x and y. `pixel` gives both in any case.
    boundary : str
        How the surface continues beyond its edges, ``"periodic"`` or ``"mirror"``.
    recipe : Mapping
        The arguments of `generate_surface` that give this surface again, and the
        version that made it; empty for any other surface. Only what JSON can hold.
    filled : ndarray of bool, shape (rows, columns), optional
        Points that were not measured but filled; None if there are none.
    provenance : Mapping
        Where a measured surface comes from and what was done to it: file, reader,
        format, channel, unit, orientation, pixel, voids, level. Only what JSON can hold.

    Raises
    ------
    InputError
        If any of these does not hold.

    """

    heights: Array
    spacing: Spacing = 1.0
    boundary: str = "periodic"
    recipe: Mapping[str, Any] = field(default_factory=dict)
    filled: NDArray[np.bool_] | None = None
    provenance: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check the values and keep heights as a read-only copy."""
        raw = real_array("heights", self.heights)
        check_layout(raw.shape, raw.dtype)
        with np.errstate(over="ignore"):  # of wider floats; infinities are refused below
            heights = np.array(raw, dtype=np.float64, order="C")  # files hold rows
        bad = heights.size - int(np.count_nonzero(np.isfinite(heights)))
        if bad:
            raise InputError(
                f"heights: {bad} of {heights.size} are NaN or infinite; must be finite. "
                "Fill the gaps first"
            )
        dx, dy = spacing_pair(self.spacing)
        if self.boundary not in BOUNDARIES:
            raise InputError(
                f"boundary = {self.boundary!r}: must be one of {', '.join(BOUNDARIES)}"
            )
        with np.errstate(over="ignore"):
            if not np.isfinite((heights.max() - heights.min()) / min(dx, dy)):
                raise InputError(
                    f"heights from {heights.min():g} to {heights.max():g} at spacing "
                    f"{min(dx, dy):g}: "
                    "slopes must be finite numbers; check the units"
                )
        heights.setflags(write=False)
        object.__setattr__(self, "heights", heights)
        object.__setattr__(self, "spacing", dx if dx == dy else (dx, dy))
        if self.filled is not None:
            filled = np.array(self.filled, dtype=np.bool_)
            if filled.shape != heights.shape:
                raise InputError(
                    f"filled of shape {filled.shape}: must be that of heights, {heights.shape}"
                )
            filled.setflags(write=False)
            object.__setattr__(self, "filled", filled if filled.any() else None)

    @property
    def pixel(self) -> tuple[float, float]:
        """Distances (dx, dy) of neighbouring grid points along x and y."""
        return spacing_pair(self.spacing)

    def _repr_html_(self) -> str:
        """Shape, pixel and heights; not every height."""
        return sections(
            {
                "cells": " × ".join(map(str, self.heights.shape)),
                "pixel": " × ".join(f"{d:g}" for d in self.pixel),
                "boundary": self.boundary,
                "heights": f"{self.heights.min():.4g} … {self.heights.max():.4g}, "
                f"standard deviation {self.heights.std():.4g}",
                "recipe": dict(self.recipe),
                "provenance": dict(self.provenance),
            },
            "Heightfield",
        )


def check_layout(shape: tuple[int, ...], dtype: np.dtype[Any]) -> None:
    """Refuse an array that can't be heights, by its shape and type alone.

    Raises
    ------
    InputError
        Unless it is real, two-dimensional and 2 … 16384 a side.

    """
    require_real("heights", dtype)
    if len(shape) != 2:
        raise InputError(f"heights of shape {shape}: must have two dimensions (rows, columns)")
    if min(shape) < 2 or max(shape) > MAX_CELLS:
        raise InputError(f"heights of shape {shape}: must have 2 … {MAX_CELLS} rows and columns")


def check_spacing(spacing: Any) -> float:
    """Return the spacing as a float; raise InputError unless it is a finite number > 0."""
    step = real_array("spacing", spacing)
    if step.shape != ():
        raise InputError(f"spacing of shape {step.shape}: must be one number > 0")
    value = float(step)
    if not (np.isfinite(value) and value > 0):
        raise InputError(f"spacing = {value}: must be a finite number > 0")
    return value


def spacing_pair(spacing: Any) -> tuple[float, float]:
    """Return (dx, dy) of one distance or two; raise InputError unless they are numbers > 0."""
    both = tuple(spacing) if isinstance(spacing, list | tuple) else (spacing,)
    if len(both) not in (1, 2):
        raise InputError(f"spacing = {spacing!r}: must be one number > 0, or two (dx, dy)")
    dx, dy = check_spacing(both[0]), check_spacing(both[-1])
    return dx, dy


@dataclass(frozen=True, eq=False)
class Mesh:
    """One period of the surface in units of a cell's width, for tracing.

    Parameters
    ----------
    heights : ndarray, shape (rows, columns)
        Heights over dx, of mean zero; periodic, so as many cells.
    flipped : ndarray of bool, shape (rows, columns)
        Cells split by the other diagonal, from (x+1, y) to (x, y+1).
    aspect : float
        Width of a cell over its depth, dx/dy.

    """

    heights: Array
    flipped: NDArray[np.bool_]
    aspect: float = 1.0


def mesh(h: Heightfield) -> Mesh:
    """Return one period of the surface, mirrors unfolded.

    Rays see no unit: the same bits come out if heights and spacing are both
    multiplied by a power of two.

    Raises
    ------
    InputError
        If one side of a cell is more than MAX_ASPECT times the other.

    """
    dx, dy = h.pixel
    if max(dx, dy) > MAX_ASPECT * min(dx, dy):
        raise InputError(
            f"a pixel of {dx:g} × {dy:g}: rays take sides up to {MAX_ASPECT:g} times as long as "
            "the other; check the spacing"
        )
    heights, flipped = unfolded(h)
    heights = heights / dx
    # After the division: subtracting first would round differently in another unit.
    return Mesh(heights - heights.mean(), flipped, dx / dy)


def unfolded(h: Heightfield) -> tuple[Array, NDArray[np.bool_]]:
    """Heights of one period, mirrors unfolded, and which cells have the other diagonal."""
    heights = h.heights
    rows, columns = heights.shape
    flipped = np.zeros((rows, columns), dtype=np.bool_)
    if h.boundary == "mirror":
        heights = np.concatenate([heights, heights[-2:0:-1]], axis=0)
        heights = np.concatenate([heights, heights[:, -2:0:-1]], axis=1)
        y, x = np.ogrid[: heights.shape[0], : heights.shape[1]]
        flipped = (y >= rows - 1) ^ (x >= columns - 1)
    return heights, flipped


def facet_slopes(h: Heightfield) -> tuple[Array, Array]:
    """Slopes of every facet of the surface itself, mirror images left out.

    Returns
    -------
    p, q : ndarray, shape (2, rows, columns)
        ∂h/∂x and ∂h/∂y of the lower (0) and the upper (1) triangle of each cell.
        Mirrored surfaces have one row and one column of cells less than heights.

    """
    heights = h.heights
    if h.boundary == "periodic":
        heights = np.pad(heights, ((0, 1), (0, 1)), mode="wrap")
    along_x, along_y = np.diff(heights, axis=1), np.diff(heights, axis=0)
    p = np.stack([along_x[:-1], along_x[1:]])
    q = np.stack([along_y[:, 1:], along_y[:, :-1]])
    dx, dy = h.pixel
    p /= dx
    q /= dy
    return p, q


def measured_facets(h: Heightfield) -> NDArray[np.bool_] | None:
    """Which facets have no filled corner, ordered as `facet_slopes`; None if all."""
    if h.filled is None:
        return None
    good = ~h.filled
    if h.boundary == "periodic":
        good = np.pad(good, ((0, 1), (0, 1)), mode="wrap")
    diagonal = good[:-1, :-1] & good[1:, 1:]
    return np.stack([diagonal & good[:-1, 1:], diagonal & good[1:, :-1]])


def slopes_of_both_splits(h: Heightfield) -> tuple[Array, Array, NDArray[np.bool_] | None]:
    """Slopes of the facets of every cell split by either diagonal, and which were measured.

    Of heights with noise, facets of one diagonal alone have slopes along x and y that hang
    together, which looks like a lay at 45°; those of both have not.

    Returns
    -------
    p, q : ndarray, shape (4, rows, columns)
        As `facet_slopes`: lower, upper, and those of the other diagonal.
    measured : ndarray of bool, shape (4, rows, columns), or None
        As `measured_facets`.

    """
    p, q = facet_slopes(h)
    measured = measured_facets(h)
    p, q = np.concatenate([p, p]), np.concatenate([q, q[::-1]])
    if measured is None:
        return p, q, None
    good = ~np.asarray(h.filled)
    if h.boundary == "periodic":
        good = np.pad(good, ((0, 1), (0, 1)), mode="wrap")
    other = good[:-1, 1:] & good[1:, :-1]
    others = np.stack([other & good[:-1, :-1], other & good[1:, 1:]])
    return p, q, np.concatenate([measured, others])


def facet_normals(h: Heightfield) -> Array:
    """Return the unit normals of every facet, as `facet_slopes`; shape (2, rows, columns, 3)."""
    return student_t.normals(*facet_slopes(h))
