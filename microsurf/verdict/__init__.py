"""Measured against predicted, with the interval that decides."""

from .candidate import Lobe, Lobes, Trial, against, expected_of, lobes, widened
from .compare import Comparison, compare
from .family import Family, family

__all__ = [
    "Comparison",
    "Family",
    "Lobe",
    "Lobes",
    "Trial",
    "against",
    "compare",
    "expected_of",
    "family",
    "lobes",
    "widened",
]
