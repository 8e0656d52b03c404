"""The period of a surface as the loop of Mitsuba's paths needs it."""

from dataclasses import dataclass

MARGIN = 1  # cells beyond each edge


@dataclass(frozen=True)
class Period:
    """Cells of the period, centred on the origin, and its lowest and greatest height in cells."""

    rows: int
    columns: int
    bottom: float
    top: float
