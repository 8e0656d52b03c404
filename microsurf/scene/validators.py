"""Checks of single values that come from outside, each with an error that teaches."""

import math
from typing import Any

from ..errors import require

__all__ = ["choice", "integer", "number", "numbers", "require"]


def number(name: str, value: Any) -> float:
    """A finite number, not a text nor true or false."""
    plain = isinstance(value, int | float) and not isinstance(value, bool)
    require(plain, name, value, "a number")
    try:
        result = float(value)
    except OverflowError:  # a whole number beyond every float
        result = math.inf
    require(math.isfinite(result), name, value, "a finite number")
    return result


def integer(name: str, value: Any, low: int, high: int) -> int:
    """A whole number from low to high."""
    plain = isinstance(value, int) and not isinstance(value, bool)
    require(plain, name, value, "a whole number")
    require(low <= value <= high, name, value, f"{low} … {high}")
    return int(value)


def numbers(name: str, value: Any) -> tuple[float, ...]:
    """One number or several."""
    values = value if isinstance(value, list | tuple) else [value]
    require(len(values) > 0, name, value, "a number or a list of at least one")
    return tuple(number(name, v) for v in values)


def choice(name: str, value: Any, allowed: tuple[str, ...]) -> str:
    """One of several words."""
    require(value in allowed, name, value, f"one of {', '.join(allowed)}")
    return str(value)
