"""What is traced: how many surfaces, of what size and structure, or which file."""

from dataclasses import dataclass
from typing import Any

from .. import memory
from ..errors import InputError
from . import validators

STRUCTURES = ("independent", "tops", "middle", "extremes")
"""Where the steep facets of a generated surface lie in height."""
BOUNDARIES = ("periodic", "mirror")
LEVELS = ("none", "plane", "quadratic")
VOIDS = ("refuse", "crop", "fill")
"""What is done with points of a measured surface that were not measured."""
MAX_CELLS = 16384
CORRELATIONS = (0.5, 1e6)
"""Correlation lengths in cells: below, cells are white noise; above, a period is one parabola."""
SPACINGS = (1e-30, 1e30)
"""Spacings in the unit of length: squares of heights and float32 meshes must hold them."""


def _check_cells(cells: Any) -> None:
    """Refuse a number of cells a side that no mesh has, saying what memory it would take."""
    plain = isinstance(cells, int) and not isinstance(cells, bool)
    if plain and MAX_CELLS < cells < 10**9:
        raise InputError(
            f"surface.cells = {cells}: must be 2 … {MAX_CELLS}; {cells} a side would take about "
            f"{memory.gibibytes(cells**2 * memory.EXACT_BYTES_PER_CELL)} of memory, "
            f"{MAX_CELLS} take {memory.gibibytes(MAX_CELLS**2 * memory.EXACT_BYTES_PER_CELL)}"
        )
    validators.integer("surface.cells", cells, 2, MAX_CELLS)


@dataclass(frozen=True)
class Surface:
    """The explicit surface: generated, or read from ``file``.

    ``spacing`` is one number, or two along x and y. What a file does not say or offers
    several times is said here: spacing, boundary, channel, height_unit, void_value; how
    to go on with it: voids, level. See `surface.read_surface`.
    """

    cells: int = 512
    correlation: float = 8.0
    structure: str = "independent"
    realisations: int = 4
    file: str | None = None
    spacing: float | tuple[float, ...] | None = None
    boundary: str | None = None
    level: str = "none"
    channel: str | None = None
    voids: str | None = None
    height_unit: str | None = None
    void_value: float | None = None

    def __post_init__(self) -> None:
        _check_cells(self.cells)
        object.__setattr__(
            self, "correlation", validators.number("surface.correlation", self.correlation)
        )
        low, high = CORRELATIONS
        validators.require(
            low <= self.correlation <= high,
            "surface.correlation",
            self.correlation,
            f"{low:g} … {high:g} cells",
        )
        validators.choice("surface.structure", self.structure, STRUCTURES)
        validators.integer("surface.realisations", self.realisations, 1, 10_000)
        if self.spacing is not None:
            spacing = validators.numbers("surface.spacing", self.spacing)
            validators.require(
                len(spacing) <= 2, "surface.spacing", spacing, "one number or two (x, y)"
            )
            low, high = SPACINGS
            for distance in spacing:
                validators.require(
                    low <= distance <= high, "surface.spacing", distance, f"{low:g} … {high:g}"
                )
            object.__setattr__(self, "spacing", spacing if len(spacing) == 2 else spacing[0])
        for name in ("channel", "height_unit"):
            text = getattr(self, name)
            validators.require(
                text is None or isinstance(text, str), f"surface.{name}", text, "a text"
            )
        if self.voids is not None:
            validators.choice("surface.voids", self.voids, VOIDS)
        if self.void_value is not None:
            validators.number("surface.void_value", self.void_value)
        if self.boundary is not None:
            validators.choice("surface.boundary", self.boundary, BOUNDARIES)
        validators.choice("surface.level", self.level, LEVELS)
        named = self.file is None or (isinstance(self.file, str) and self.file != "")
        validators.require(named, "surface.file", self.file, "the name of a file")
