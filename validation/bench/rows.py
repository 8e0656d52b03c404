"""What the benchmark says: rows with a ratio, its target, and whether it was met."""

from dataclasses import dataclass

from .efficiency import Ratio


@dataclass(frozen=True)
class Row:
    """One figure of one case.

    ``ratio`` is ours over theirs (or the figure that the target is about), ``low`` and
    ``high`` its 95 % interval where there is one. ``target`` is what it must reach, or
    with ``at_most`` may not exceed; None where the row only informs.
    """

    case: str
    theta: float | None
    quantity: str
    ratio: float
    target: float | None = None
    at_most: bool = False
    low: float | None = None
    high: float | None = None
    ours: float | None = None
    theirs: float | None = None
    unit: str = ""
    bins: int = 1

    @property
    def verdict(self) -> str:
        """Whether the whole interval meets the target (met), none of it (missed), or part."""
        if self.target is None:
            return ""
        ends = [self.ratio if end is None else end for end in (self.low, self.high)]
        good = [end <= self.target if self.at_most else end >= self.target for end in ends]
        return "met" if all(good) else "undecided" if any(good) else "missed"


def of_ratio(
    case: str, theta: float, quantity: str, found: Ratio | None, target: float | None
) -> list[Row]:
    """Return the row of an efficiency, none if it was too dim to judge."""
    if found is None:
        return []
    return [
        Row(
            case,
            theta,
            quantity,
            found.value,
            target,
            low=found.low,
            high=found.high,
            bins=found.bins,
        )
    ]
