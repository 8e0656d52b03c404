"""atlas.md: the atlas in three tables."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from microsurf.cli.save import save

from .figures import AGAINST, SURFACES, THEORIES, ratios

Row = dict[str, Any]

_SHOWN = 80.0
_HEAD = """# Same slopes, different light

Four kinds of surfaces whose facets have the same distribution of slopes (STD) and differ in
where the steep ones lie; n = 1.5, Kd = 0.8. Figures are ratios to Smith (order 1:
height-correlated; total: its walk) with 95 % intervals over surfaces of 512² cells; theories
have none, or that of their walks. Every angle is in [atlas.csv](atlas.csv); what the surfaces
realise (KS, quantiles, rank correlation of slope and height) and the largest error of each
quantity in [surfaces.csv](surfaces.csv). `python -m validation.structures.run` goes on where it was
stopped.

![Albedos of four structures over Smith's](atlas.png)

![Cuts through the four structures](structures.png)
"""


def _cell(rows: list[Row], shown: Row, source: str, quantity: str) -> str:
    theta, ratio, half = ratios(rows, shown, source, quantity)
    at = theta == _SHOWN
    if not at.any():
        return "–"
    return f"{ratio[at][0]:.3f} ± {half[at][0]:.3f}"


def _table(rows: list[Row], cases: list[Row], quantity: str) -> Iterator[str]:
    sources = [*SURFACES, *(t for t in THEORIES if quantity not in AGAINST or "walk" in t)]
    yield "| γ | σ | L (cells) | " + " | ".join(sources) + " |"
    yield "|---" * (3 + len(sources)) + "|"
    for case in cases:
        cells = [_cell(rows, case, source, quantity) for source in sources]
        names = [f"{case[key]:g}" for key in ("gamma", "sigma", "correlation")]
        yield "| " + " | ".join([*names, *cells]) + " |"


def text(rows: list[Row]) -> str:
    """Tables at 80°, in the order in which the cases were asked for."""
    keys = ("gamma", "sigma", "correlation")
    found = dict.fromkeys(
        tuple(row[key] for key in keys) for row in rows if row["source"] in SURFACES
    )
    cases = [dict(zip(keys, case, strict=True)) for case in found]
    parts = [_HEAD]
    for quantity, name in (
        ("total", "Total albedo"),
        ("body", "Order-1 body albedo"),
        ("specular", "Order-1 specular albedo"),
        ("mirror", "Order-1 specular light near the mirror direction (level facets: G2)"),
    ):
        parts += [f"## {name} at θ_i = {_SHOWN:g}°", "", *_table(rows, cases, quantity), ""]
    return "\n".join(parts)


def write(rows: list[Row], out: Path) -> None:
    """Write atlas.md."""
    save(out, {"atlas.md": text(rows)})
