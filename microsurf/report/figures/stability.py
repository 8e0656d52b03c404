"""The stability map as heat maps: digits right beside the digits that the conditioning leaves."""

from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from ...stability import Stability
from ...stability.case import ENOUGH, DomainPoint
from ...stability.domain import SYMBOLS, ticked
from ..stability_text import place
from .style import (
    new_figure,
    nothing,
    own_style,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import BoundaryNorm
    from matplotlib.figure import Figure

GROUPS = {
    "slopes": "distribution of slopes",
    "masking": "masking and visibility",
    "facet": "one facet",
    "samplers": "samplers",
}
"""The figures, and what they are about."""

_LEVELS = np.arange(8, 17)
_PAIRS = 2  # of panels, side by side
_THICK = 9  # most ticks along an axis


def rows(stability: Stability) -> list[dict[str, Any]]:
    """Return the numbers behind the figures: of each cell the place least right."""
    return [
        {
            "function": point.function,
            "group": point.group,
            "place": place(point),
            "value": f"{point.value:.6g}",
            "condition": f"{point.condition:.2g}",
            "right": round(point.right, 2),
            "attainable": round(point.attainable, 2),
            "kept": round(point.kept, 2),
        }
        for points in _by_function(stability, tuple(GROUPS)).values()
        for point in (min(cell, key=lambda point: point.right) for cell in _cells(points).values())
    ]


@own_style()
def figure(stability: Stability, group: str) -> "Figure":
    """Draw all formulas of a group of GROUPS, two panels each: measured, and attainable.

    A cell is the worst over the function's other coordinates; a cross marks fewer than ENOUGH
    digits beyond what the conditioning costs. Formulas of one coordinate share a panel.
    """
    from matplotlib.cm import ScalarMappable  # noqa: PLC0415 - late: only to draw
    from matplotlib.colors import BoundaryNorm  # noqa: PLC0415 - late: only to draw

    panels = _panels(_by_function(stability, (group,)))
    if not panels:
        return nothing(f"no function of the group {GROUPS[group]} was evaluated")
    lines = -(-len(panels) // _PAIRS)
    drawn = new_figure(2.35 * lines + 0.7, 10.2)
    axes = drawn.subplots(lines, 2 * _PAIRS, squeeze=False)
    norm = BoundaryNorm(_LEVELS, 256, extend="min")
    for k, (title, cells, x, y) in enumerate(panels):
        line, pair = divmod(k, _PAIRS)
        left, right = axes[line, 2 * pair : 2 * pair + 2]
        for panel, what, names in ((left, "right", y), (right, "attainable", None)):
            _heat_map(panel, cells, what, x, names, norm)
        left.set_title(fill(f"{title}: right", 28), fontsize=9)
        right.set_title("attainable", fontsize=9)
    for panel in axes.ravel()[2 * len(panels) :]:
        panel.set_visible(False)
    drawn.colorbar(
        ScalarMappable(norm, "cividis"), ax=axes, shrink=0.6 if lines > 1 else 1.0,
        label="decimal digits, the fewest in each cell",
    )  # fmt: skip
    drawn.suptitle(
        f"Digits right and digits the conditioning leaves: {GROUPS[group]}"
        "\n(inputs are taken as the doubles they are: more may be right than rounded inputs leave)"
        + (f"; × fewer than {ENOUGH:g} beyond conditioning" if _short(panels) else ""),
        fontsize=10,
    )
    return drawn


_Cells = dict[tuple[str, str], list[DomainPoint]]
_Axis = tuple[str, list[str]]
_Panel = tuple[str, _Cells, _Axis, _Axis]


def _by_function(stability: Stability, groups: tuple[str, ...]) -> dict[str, list[DomainPoint]]:
    functions: dict[str, list[DomainPoint]] = {}
    for point in stability.points:
        if point.group in groups:
            functions.setdefault(point.function, []).append(point)
    return functions


def _cells(points: list[DomainPoint]) -> _Cells:
    """Gather points of a function that share the first two coordinates."""
    cells: _Cells = {}
    for point in points:
        ticks = [ticked(name, value) for name, value in point.coordinates.items()]
        key = ticks[0], ticks[1] if len(ticks) > 1 else point.function
        cells.setdefault(key, []).append(point)
    return cells


def _panels(functions: dict[str, list[DomainPoint]]) -> list[_Panel]:
    """Cells of each function and its two axes; functions of one coordinate come last, together."""
    panels: list[_Panel] = []
    lone: list[DomainPoint] = []
    for name, points in functions.items():
        if len(points[0].coordinates) == 1:
            lone += points
        else:
            panels.append(_panel(name, _cells(points), points[0]))
    if lone:
        panels.append(_panel("diffuse averages", _cells(lone), lone[0]))
    return panels


def _panel(title: str, cells: _Cells, first: DomainPoint) -> _Panel:
    x, *rest = first.coordinates
    y = SYMBOLS[rest[0]] if rest else ""
    columns, lines = (list(dict.fromkeys(key[k] for key in cells)) for k in (0, 1))
    return title, cells, (SYMBOLS[x], columns), (y, lines)


def _heat_map(
    panel: "Axes", cells: _Cells, what: str, x: _Axis, y: _Axis | None, norm: "BoundaryNorm"
) -> None:
    columns = x[1]
    lines = list(dict.fromkeys(key[1] for key in cells))
    values = np.array(
        [[min(getattr(point, what) for point in cells[c, r]) for c in columns] for r in lines]
    )
    panel.imshow(values, origin="lower", aspect="auto", cmap="cividis", norm=norm)
    if what == "right":
        for (c, r), points in cells.items():
            if min(point.kept for point in points) < ENOUGH:
                panel.plot(columns.index(c), lines.index(r), "x", color="#D55E00", markersize=7)
    _ticks(panel.xaxis, columns, rotation=60)
    panel.set_xlabel(x[0], fontsize=9)
    _ticks(panel.yaxis, lines if y else [""] * len(lines), rotation=0)
    if y:
        panel.set_ylabel(y[0], fontsize=9)


def _ticks(axis: Any, labels: list[str], rotation: float) -> None:
    """Label the values, of many every second or third, the last always."""
    step = -(-len(labels) // _THICK)
    shown = sorted({*range(0, len(labels) - step, step), len(labels) - 1})
    axis.set_ticks(shown, [labels[k] for k in shown], fontsize=8, rotation=rotation)


def _short(panels: list[_Panel]) -> bool:
    return any(
        point.kept < ENOUGH
        for _, cells, _, _ in panels
        for points in cells.values()
        for point in points
    )
