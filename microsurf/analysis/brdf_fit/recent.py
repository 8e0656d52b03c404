"""What was computed last, by what it was computed for.

A search moves its parameters one at a time, and the costly part of the light depends on the
slopes alone: where only an index moves, or a few pairs are left out, it is known already.
"""

from collections.abc import Callable, Hashable
from typing import Generic, Protocol, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

_MOST = 6
"""Entries: a point, and one step along each parameter of the slopes."""

_Value = TypeVar("_Value", bound="OfPairs")


class OfPairs(Protocol):
    """Values for each pair."""

    def select(self, rows: NDArray[np.bool_]) -> Self:
        """Return those of some of the pairs."""
        ...


class Recent(Generic[_Value]):
    """The last values by their key; the oldest goes."""

    def __init__(self, values: dict[Hashable, _Value] | None = None) -> None:
        self._values = {} if values is None else values

    def get(self, key: Hashable, compute: Callable[[], _Value]) -> _Value:
        """Return the value of a key, computed if it is not there."""
        value = self._values.pop(key, None)
        self._values[key] = compute() if value is None else value
        if len(self._values) > _MOST:
            del self._values[next(iter(self._values))]
        return self._values[key]

    def select(self, rows: NDArray[np.bool_]) -> "Recent[_Value]":
        """Return the values of some of the pairs."""
        return Recent({key: value.select(rows) for key, value in self._values.items()})
