"""What the verdicts of a whole report are worth together: `family`.

A verdict is wrong if it says *holds* of a difference beyond the margin or *departs* of
one within. All of a 95 % interval lies on the wrong side of the margin in at most 2.5 %
of cases, and in so many only if the truth lies at the margin itself. Single verdicts
are left at that: which of them are wanted is the reader's choice, and a report of a hundred
that must all be right at once would decide nothing. The family has its own figures beside:
how many wrong ones to expect at most, and which verdicts also stand under simultaneous
intervals, all of which hold their truth in 95 % of reports (Šidák 1967).
"""

from collections.abc import Sequence
from dataclasses import dataclass

from ..stats.hypothesis_tests import sidak_level
from ..stats.intervals import CONFIDENCE
from .comparison import Comparison, decide, half_width

ERROR_RATE = (1 - CONFIDENCE) / 2
"""Probability that one verdict is wrong, at most, if surfaces differ normally; of heavy tails on
small tiles 4 % were measured (validation/calibration/verdict_rates.py)."""


@dataclass(frozen=True)
class Multiplicity:
    """The verdicts of a report together.

    Attributes
    ----------
    comparisons : int
        How many there are.
    decided : int
        Those that hold or depart.
    error_rate : float
        Of one verdict, at most.
    expected_wrong : float
        Mean number of wrong verdicts, at most: the rate times all comparisons.
    simultaneous : tuple of (float, float)
        Intervals that hold together with 95 %, in the order of the comparisons.
    standing : int
        Decided verdicts that these intervals decide alike.
    of_one_surface : int
        Comparisons whose interval knows rays only: they are about that surface, and
        hold for others with no stated rate.

    """

    comparisons: int
    decided: int
    error_rate: float
    expected_wrong: float
    simultaneous: tuple[tuple[float, float], ...]
    standing: int
    of_one_surface: int


def multiplicity_of(rows: Sequence[Comparison]) -> Multiplicity:
    """Judge all comparisons of a report together; none is an empty family."""
    confidence = 1 - sidak_level(1 - CONFIDENCE, len(rows)) if rows else CONFIDENCE
    intervals = []
    for row in rows:
        half = half_width(
            row.standard_error, row.surfaces, row.effect, row.predicted,
            row.predicted_error, confidence,
        )  # fmt: skip
        intervals.append((row.effect - half, row.effect + half))
    decided = [
        (row, interval)
        for row, interval in zip(rows, intervals, strict=True)
        if row.verdict != "undecided"
    ]
    return Multiplicity(
        comparisons=len(rows),
        decided=len(decided),
        error_rate=ERROR_RATE,
        expected_wrong=ERROR_RATE * len(rows),
        simultaneous=tuple(intervals),
        standing=sum(decide(*ends, row.margin) == row.verdict for row, ends in decided),
        of_one_surface=sum(row.surfaces == 1 for row in rows),
    )
