"""What a user says of a surface's file where the file does not say it itself."""

from dataclasses import dataclass

from .heightfield import Spacing, spacing_pair

OF_BARE_HEIGHTS = ("voids", "height_unit", "void_value")
"""Names of what may be said of heights alone."""
OF_INSTRUMENTS = ("channel", *OF_BARE_HEIGHTS)
"""Names of what may be said of an instrument's file."""


@dataclass(frozen=True)
class Declared:
    """What is said of one file, each as in `read_surface`; None where nothing is."""

    spacing: Spacing | None = None
    boundary: str | None = None
    channel: str | None = None
    voids: str | None = None
    height_unit: str | None = None
    void_value: float | None = None

    @property
    def pixel(self) -> tuple[float, float] | None:
        """Distances (dx, dy) of neighbouring heights."""
        return None if self.spacing is None else spacing_pair(self.spacing)
