"""The report's table of albedos: a column is one entry of COLUMNS, here and nowhere else."""

from collections.abc import Callable
from dataclasses import dataclass

from ..analysis.comparison import Comparison
from ..analysis.validation import Validation
from ..results import albedos, uncertainty

MARKS = {"holds": "✓", "departs": "✗", "undecided": "?"}
"""What stands before each verdict."""


@dataclass(frozen=True)
class Column:
    """One column of the table, whose texts are escaped.

    ``text`` says whether it reads from the left; ``coloured`` whether it has the colour of the
    verdict; ``of_azimuths`` whether only scenes of several azimuths of incidence have it.
    """

    heading: str
    cell: Callable[[Comparison], str]
    text: bool = False
    coloured: bool = False
    of_azimuths: bool = False


def signed(value: float, digits: int) -> str:
    """With its sign, a true minus; what rounds to zero has none."""
    text = f"{value:+.{digits}f}"
    return text[1:] if float(text) == 0 else text.replace("-", "−")


def _predicted(row: Comparison) -> str:
    error = f" ± {row.predicted_error:.5f}" if row.predicted_error else ""
    return f"{row.predicted:.5f}{error}"


_NAMES = albedos.QUANTITIES | uncertainty.LOBES

COLUMNS = (
    Column("quantity", lambda row: _NAMES[row.quantity]),  # heads the row
    Column("θ_i (°)", lambda row: f"{row.theta_i:g}"),
    Column("φ_i (°)", lambda row: f"{row.phi_i:g}", of_azimuths=True),
    Column("Kd", lambda row: f"{row.kd:g}"),
    Column("measured", lambda row: f"{row.measured:.5f}"),
    Column("± s.e.", lambda row: f"{row.standard_error:.5f}"),
    Column("predicted", _predicted),
    Column("difference (%)", lambda row: signed(100 * row.effect, 2)),
    Column(
        "95 % interval (%)",
        lambda row: f"{signed(100 * row.low, 2)} … {signed(100 * row.high, 2)}",
    ),
    Column("margin (%)", lambda row: f"±{100 * row.margin:g}"),
    Column("verdict", lambda row: f"{MARKS[row.verdict]} {row.verdict}", text=True, coloured=True),
    Column(
        "expected", lambda row: row.expected if row.expected.count("|") < 2 else "any", text=True
    ),
)


def columns(scene: Validation) -> list[Column]:
    """Those that are shown of a scene."""
    several = len(scene.scene.light.phi) > 1
    return [column for column in COLUMNS if several or not column.of_azimuths]
