"""Interpolation of tables in the renderer's arithmetic, whatever its variant."""

from collections.abc import Callable
from itertools import product
from typing import Any


def linear(mi: Any, dr: Any, at: Callable[[Any], Any], places: list[tuple[Any, int]]) -> Any:
    """Interpolate a table of any number of even axes, linearly in each.

    Parameters
    ----------
    mi, dr : module
        Mitsuba and its arithmetic.
    at : callable
        Values of the table, by index into its flat memory, last axis fastest.
    places : list of tuple
        For each axis steps from its first node, clipped to the table, and its nodes.

    """
    total = 0.0
    cells = []
    for x, nodes in places:
        low = mi.UInt32(dr.clip(x, 0.0, max(nodes - 2, 0)))
        cells.append((low, dr.clip(x - mi.Float(low), 0.0, 1.0), nodes))
    for corner in product(*((0, 1) if nodes > 1 else (0,) for _, _, nodes in cells)):
        index, weight = mi.UInt32(0), mi.Float(1.0)
        for high, (low, part, nodes) in zip(corner, cells, strict=True):
            index = index * nodes + low + high
            weight = weight * (part if high else 1 - part)
        total = total + weight * at(index)
    return total
