"""Measured against predicted, with the interval that decides."""

from .candidate import Lobe, Lobes, Trial, against, expected_of, lobes, widened
from .compare import Comparison, compare

__all__ = [
    "Comparison",
    "Lobe",
    "Lobes",
    "Trial",
    "against",
    "compare",
    "expected_of",
    "lobes",
    "widened",
]
