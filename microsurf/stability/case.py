"""What the map knows of a formula: where to ask, what it answers, and what is true."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product
from typing import SupportsFloat

from . import digits
from .reference import Real, real

ENOUGH = 12.0
"""Digits that must be right beyond what the conditioning costs."""


@dataclass(frozen=True)
class CheckedFunction:
    """A formula of `physics`, or the deterministic part of a sampler.

    Attributes
    ----------
    name, group : str
        As figures call it, and the figure it is in.
    axes : tuple of str
        Coordinates of `box`: that along x, that along y, and others over which the map
        shows the worst.
    inputs : tuple of str
        Names of the doubles the formula is given.
    values_at : callable
        Coordinates → these doubles.
    value : callable
        The formula on these doubles.
    exact : callable
        The same of numbers of `reference.EXACT`.
    note : str
        Where fewer digits than ENOUGH are right, and why; empty if nowhere.

    """

    name: str
    group: str
    axes: tuple[str, ...]
    inputs: tuple[str, ...]
    values_at: Callable[..., tuple[float, ...]]
    value: Callable[..., SupportsFloat]
    exact: Callable[..., Real]
    note: str = ""


@dataclass(frozen=True)
class DomainPoint:
    """One place of the map.

    ``right``: digits right; ``attainable``: what the conditioning leaves; ``kept``: digits
    right if that is forgiven. ``exact`` is rounded to a double.
    """

    function: str
    group: str
    coordinates: dict[str, float]
    value: float
    exact: float
    condition: float
    right: float
    attainable: float
    kept: float


def points(
    function: CheckedFunction, values: dict[str, tuple[float, ...]]
) -> Iterator[DomainPoint]:
    """Ask a formula at all places of a grid, see `box`."""
    for index in product(*(values[axis] for axis in function.axes)):
        inputs = function.values_at(*index)
        value = float(function.value(*inputs))
        exact = function.exact(*(real(x) for x in inputs))
        condition = digits.condition(function.exact, inputs, function.inputs)
        error = digits.relative_error(value, exact)
        yield DomainPoint(
            function.name,
            function.group,
            dict(zip(function.axes, index, strict=True)),
            value,
            float(exact),
            condition,
            digits.of_error(error),
            digits.attainable(condition),
            digits.kept(error, condition),
        )
