"""Measured against predicted, with the interval that decides."""

from .compare import Comparison, compare

__all__ = ["Comparison", "compare"]
