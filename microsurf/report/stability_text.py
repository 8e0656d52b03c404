"""The stability map as tables and as JSON."""

from collections.abc import Iterable
from dataclasses import asdict
from typing import Any

from ..stability import Stability
from ..stability.case import ENOUGH, DomainPoint
from ..stability.domain import BOX, SYMBOLS, ticked


def as_json(stability: Stability) -> dict[str, Any]:
    """Return what was found as JSON can hold it, places as text."""
    return {
        "functions": [
            {
                "function": row.function,
                "group": row.group,
                "places": row.places,
                "kept": row.worst.kept,
                "right": row.worst.right,
                "attainable": row.worst.attainable,
                "condition": row.worst.condition,
                "at": place(row.worst),
                "least_right": row.least,
                "short": row.short,
                "verdict": row.verdict,
                "note": row.note,
            }
            for row in stability.summaries
        ],
        "counts": [asdict(row) for row in stability.counts],
        "limits": [asdict(row) | {"verdict": row.verdict} for row in stability.limits],
        "sound": stability.sound,
        "seconds": stability.seconds,
    }


def place(point: DomainPoint) -> str:
    """Coordinates as text."""
    return ", ".join(
        f"{SYMBOLS[name].split(' ')[0]} = {ticked(name, value)}"
        for name, value in point.coordinates.items()
    )


def markdown(stability: Stability) -> str:
    """Three tables: formulas, counts, borders."""
    wrong = sum(row.nan + row.infinite + row.negative for row in stability.counts)
    checked = sum(row.values for row in stability.counts)
    parts = [
        "# Stability map",
        (f"Box: {BOX}. Digits: −log10 of the relative error against 50-digit arithmetic; of a "
        "sampler, of what it makes of given random numbers, or of the worst deviation from an "
        "identity. *Kept*: digits right if what the condition number of the problem costs is "
        f"forgiven; at least {ENOUGH:g} are wanted."),
        "## Formulas and samplers, each at the place where fewest are kept",
        _table(
            ("function", "places", "kept", "right", "attainable", "condition", "at", "fewest right",
             "verdict"),
            (
                (
                    row.function, row.places, f"{row.worst.kept:.1f}", f"{row.worst.right:.1f}",
                    f"{row.worst.attainable:.1f}", f"{row.worst.condition:.1e}",
                    place(row.worst), f"{row.least:.1f}",
                    row.verdict + (f": {row.note}" if row.note else ""),
                )
                for row in stability.summaries
            ),
        ),
        "## NaN, infinities, negative values",
        f"{wrong} in {checked} values at random places and at the corners of the box.",
        _table(
            ("function", "values", "NaN", "infinite", "negative"),
            ((c.function, c.values, c.nan, c.infinite, c.negative) for c in stability.counts),
        ),
        "## Borders of meshes and traces",
        _table(
            ("border", "checked", "value", "limit", "verdict", "reason"),
            (
                (row.border, row.checked, f"{row.value:.2g}", f"{row.limit:.0g}", row.verdict,
                 row.reason)
                for row in stability.limits
            ),
        ),
    ]  # fmt: skip
    return "\n\n".join(parts) + "\n"


def _table(head: tuple[str, ...], rows: Iterable[tuple[Any, ...]]) -> str:
    lines = [head, ("---",) * len(head), *rows]
    return "\n".join(
        "| " + " | ".join(str(cell).replace("|", "\\|") for cell in line) + " |" for line in lines
    )
