"""One thing that must hold whatever is measured: `Invariant`."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Invariant:
    """What must hold, and how far from it we are.

    Attributes
    ----------
    name : str
        A few words.
    statement : str
        What must hold, in one sentence.
    value : float
        Distance from it, ≥ 0.
    tolerance : float
        The largest ``value`` that is no fault.
    basis : str
        What ``value`` is a measure of, and where the tolerance comes from.
    figures : Mapping of str to float
        What was seen on the way.
    detail : str
        What else a reader should know, such as why it could not be shown.

    """

    name: str
    statement: str
    value: float
    tolerance: float
    basis: str
    figures: Mapping[str, float] = field(default_factory=dict)
    detail: str = ""

    @property
    def holds(self) -> bool:
        """Whether the value is within the tolerance; no number is not."""
        return self.value <= self.tolerance

    def __str__(self) -> str:
        """One line for who reads that it is broken."""
        line = f"{self.name}: {self.value:.3g}, must be ≤ {self.tolerance:.3g} ({self.statement})"
        return f"{line}; {self.detail}" if self.detail else line


def broken(invariants: Iterable[Invariant]) -> list[str]:
    """A line for each invariant that does not hold."""
    return [str(invariant) for invariant in invariants if not invariant.holds]


def as_rows(invariants: Iterable[Invariant]) -> list[dict[str, Any]]:
    """Rows for tables and strict JSON: a value that is no finite number becomes null."""
    return [
        {
            "name": invariant.name,
            "statement": invariant.statement,
            "value": _finite(invariant.value),
            "tolerance": invariant.tolerance,
            "holds": bool(invariant.holds),
            "basis": invariant.basis,
            "figures": {key: _finite(value) for key, value in invariant.figures.items()},
            "detail": invariant.detail,
        }
        for invariant in invariants
    ]


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
