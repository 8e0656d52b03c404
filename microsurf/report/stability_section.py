"""The stability map as a section of a page."""

from ..stability import Stability
from ..stability.case import ENOUGH
from ..stability.domain import BOX
from .figures import stability
from .figures.figure import Picture
from .section import Section, Table
from .stability_text import place

_TEXT = """Digits right against 50-digit arithmetic in the box {box}, beside what the condition
number of the problem leaves of inputs rounded to doubles. Kept are the digits right if that
cost is forgiven: at least {enough:g} are wanted. NaN, infinite or negative were {wrong} of
{asked} values at random places and at the corners of the box.

{when}

Again: microsurf stability --quick --out FOLDER"""
_CAPTION = (
    "Decimal digits right, and attainable by inputs rounded to doubles, the fewest in each cell "
    "over its other coordinates: {what}. Inputs are taken as the doubles they are, so more "
    "may be right than rounded inputs leave."
)


def section(result: Stability, when: str) -> Section:
    """Return its tables and pictures; ``when`` says when it was made."""
    functions = Table(
        "Formulas and samplers, each at the place where fewest digits are kept",
        [
            {
                "function": row.function,
                "places": row.places,
                "kept": row.worst.kept,
                "right": row.worst.right,
                "attainable": row.worst.attainable,
                "at": place(row.worst),
                "fewest right anywhere": row.least,
                "verdict": row.verdict,
                "note": row.note,
            }
            for row in result.summaries
        ],
        digits=3,
    )
    limits = Table(
        "Borders of meshes and traces, with what was found and the limit",
        [
            {
                "border": row.border,
                "checked": row.checked,
                "value": row.value,
                "limit": row.limit,
                "verdict": row.verdict,
                "reason": row.reason,
            }
            for row in result.limits
        ],
        digits=2,
    )
    rows = stability.rows(result)
    groups = dict.fromkeys(point.group for point in result.points)
    return Section(
        "stability",
        "How many digits are right, and where meshes and traces end",
        _TEXT.format(
            box=BOX,
            when=when,
            enough=ENOUGH,
            wrong=sum(row.nan + row.infinite + row.negative for row in result.counts),
            asked=sum(row.values for row in result.counts),
        ),
        (functions, limits),
        tuple(
            Picture(
                f"stability-{group}",
                stability.figure(result, group),
                _CAPTION.format(what=stability.GROUPS[group]),
                [row for row in rows if row["group"] == group],
            )
            for group in groups
        ),
    )
