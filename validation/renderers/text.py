"""The page of the judged BSDFs."""

from collections.abc import Iterable

from . import study
from .study import Row

HEAD = """# Mitsuba's BSDFs against explicit surfaces

Value of each over the traced one − 1, in %, seed {seed}, with its 95 % interval over {count}
surfaces; **bold**: departs from ±{margin:.0f} %, *italic*: undecided. n = 1.5, Kd = 0.8 under
`roughplastic`, `plastic` and `principled`; gold under `roughconductor`; n = 1, Kd = 0.8 under
`diffuse`; slopes of GGX but where Beckmann is named, α = σ. A renderer adds nothing to its BSDF,
so *total* is held against all orders; kinds against order 1 and against all orders of the kind.
The mirror of `plastic` is part of its specular albedo. `smith-walk` is microsurf's own theory of
all orders: what it is off by is the surfaces' own, which are not Smith's.

![Errors of the total, and where the light of roughplastic is.](mitsuba.png)

Where the light of `roughplastic` (nonlinear) goes: its specular lobe is order 1 with separable
masking. Its body falls short of order 1 already; light that meets a second facet is nowhere.

Verdicts of a second seed are equal in {same} of {all} rows; {turned} turned from holds to
departs or back, the others to or from undecided. Every row: [mitsuba.csv](mitsuba.csv).
`make renderers` writes all of it.
"""


def page(table: list[Row]) -> str:
    """Markdown of all rows of two seeds."""
    first, second = (
        {_key(row): row for row in table if row["seed"] == seed}
        for seed in dict.fromkeys(row["seed"] for row in table)
    )
    pairs = [(row["verdict"], second[key]["verdict"]) for key, row in first.items()]
    moved = [pair for pair in pairs if pair[0] != pair[1]]
    head = HEAD.format(
        seed=table[0]["seed"],
        count=study.SURFACE.realisations,
        margin=100 * study.MARGIN,
        same=len(first) - len(moved),
        all=len(first),
        turned=sum("undecided" not in pair for pair in moved) or "none",
    )
    return head + "".join(_section(name, first.values()) for name in study.MODELS)


def _section(name: str, rows: Iterable[Row]) -> str:
    mine = [row for row in rows if row["bsdf"] == name]
    angles = " | ".join(f"{theta:g}°" for theta in study.THETAS)
    lines = [f"| part | α | {angles} |", "|---" * (2 + len(study.THETAS)) + "|"]
    for part in dict.fromkeys(row["part"] for row in mine):
        for alpha in study.ALPHAS:
            cells = [_cell(r) for r in mine if r["part"] == part and r["alpha"] == alpha]
            lines.append(f"| {part} | {alpha:g} | {' | '.join(cells)} |")
    return f"\n## {name}\n\n`--model {study.MODELS[name].given}`\n\n" + "\n".join(lines) + "\n"


def _cell(row: Row) -> str:
    mark = {"departs": "**", "undecided": "*"}.get(row["verdict"], "")
    half = 50 * (row["high"] - row["low"])
    return f"{mark}{100 * row['effect']:+.1f} ± {half:.1f}{mark}"


def _key(row: Row) -> tuple[str, str, float, float]:
    return row["bsdf"], row["part"], row["alpha"], row["theta_i"]
