"""A surface as heights on a square grid, and the triangles it stands for.

Heights lie at integer grid points times the spacing; row = y, column = x. Each
cell is split by the diagonal from its (x, y) corner to its (x+1, y+1) corner
into a *lower* triangle (x, y), (x+1, y), (x+1, y+1) and an *upper* triangle
(x, y), (x+1, y+1), (x, y+1).

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

from ..arrays import real_array, require_real
from ..errors import InputError
from ..physics import student_t
from ..scene import BOUNDARIES, MAX_CELLS

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Heightfield:
    """Heights over the plane.

    Parameters
    ----------
    heights : ndarray, shape (rows, columns)
        Real and finite, in the user's unit of length; 2 … 16384 a side. Kept as
        a read-only copy in float64.
    spacing : float
        Distance of neighbouring grid points in the same unit, > 0.
    boundary : str
        How the surface continues beyond its edges, ``"periodic"`` or ``"mirror"``.
    recipe : Mapping
        The arguments of `generate_surface` that give this surface again, and the
        version that made it; empty for any other surface. Only what JSON can hold.

    Raises
    ------
    InputError
        If any of these does not hold.

    """

    heights: Array
    spacing: float = 1.0
    boundary: str = "periodic"
    recipe: Mapping[str, Any] = field(default_factory=dict)

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
        spacing = check_spacing(self.spacing)
        if self.boundary not in BOUNDARIES:
            raise InputError(
                f"boundary = {self.boundary!r}: must be one of {', '.join(BOUNDARIES)}"
            )
        with np.errstate(over="ignore"):
            if not np.isfinite((heights.max() - heights.min()) / spacing):
                raise InputError(
                    f"heights from {heights.min():g} to {heights.max():g} at spacing {spacing:g}: "
                    "slopes must be finite numbers; check the units"
                )
        heights.setflags(write=False)
        object.__setattr__(self, "heights", heights)
        object.__setattr__(self, "spacing", spacing)


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
    found = real_array("spacing", spacing)
    if found.shape != ():
        raise InputError(f"spacing of shape {found.shape}: must be one number > 0")
    value = float(found)
    if not (np.isfinite(value) and value > 0):
        raise InputError(f"spacing = {value}: must be a finite number > 0")
    return value


@dataclass(frozen=True, eq=False)
class Mesh:
    """One period of the surface in units of a cell, for tracing.

    Parameters
    ----------
    heights : ndarray, shape (rows, columns)
        Heights over spacing, of mean zero; periodic, so as many cells.
    flipped : ndarray of bool, shape (rows, columns)
        Cells split by the other diagonal, from (x+1, y) to (x, y+1).

    """

    heights: Array
    flipped: NDArray[np.bool_]


def mesh(h: Heightfield) -> Mesh:
    """Return one period of the surface, mirrors unfolded.

    Rays see no unit: the same bits come out if heights and spacing are both
    multiplied by a power of two.
    """
    heights = h.heights / h.spacing
    rows, columns = heights.shape
    flipped = np.zeros((rows, columns), dtype=np.bool_)
    if h.boundary == "mirror":
        heights = np.concatenate([heights, heights[-2:0:-1]], axis=0)
        heights = np.concatenate([heights, heights[:, -2:0:-1]], axis=1)
        y, x = np.ogrid[: heights.shape[0], : heights.shape[1]]
        flipped = (y >= rows - 1) ^ (x >= columns - 1)
    # After the division: subtracting first would round differently in another unit.
    return Mesh(heights - heights.mean(), flipped)


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
    p /= h.spacing
    q /= h.spacing
    return p, q


def facet_normals(h: Heightfield) -> Array:
    """Return the unit normals of every facet, as `facet_slopes`; shape (2, rows, columns, 3)."""
    return student_t.normals(*facet_slopes(h))
