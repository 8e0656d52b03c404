"""Pages of reports/layers: the atlas of the IL assumption, and the limits of two layers."""

from collections.abc import Iterator
from itertools import product
from typing import Any

from .cases import (
    FAR_GAPS,
    GAMMAS,
    GAPS,
    INDICES,
    KDS,
    PAIRS,
    RATIOS,
    REALISATIONS,
    SIGMAS,
    WALK_RUNS,
    WALKS,
    possible,
    statistics_of,
)
from .figures import KINDS, NAMES, THEORIES

Row = dict[str, Any]

_HEAD = """# Where one interfaced-Lambertian facet stands for two explicit layers

Both are traced on the same interfaces: `[layers]`, an interface over a Lambertian substrate,
against interfaced-Lambertian (IL) facets. {surfaces} realisations of 128² cells, L = 8 cells (so
a period of 16 L), θ_i = 0, 60, 80°; substrates have the interface's γ. Numbers are the worst of
all θ_i at Kd = {kd}, in percent, ± half of the 95 % interval over the realisations, whose
differences are paired; – : surfaces of some realisation would cross. Random numbers are the same
at each gap, so that neighbours share a part of their errors. All rows, with every θ_i, Kd {kds},
order-1 body and light sent back: [atlas.csv](atlas.csv); where a theory of independent layers
holds instead: [layering.md](layering.md); the pairs of surfaces, and the gap they
need: [pairs.csv](pairs.csv).
`python -m validation.layers.atlas` goes on where it was stopped.

![Where IL holds within 1, 3 and 10 %](atlas.png)

*n = 1.5, Kd = {kd}, σ = 0.5. A colour says what the upper end of the interval is within.*
"""


def atlas(worst: list[Row], rows: list[Row], kd: float) -> str:
    """The page of the atlas."""
    parts = [
        _HEAD.format(surfaces=REALISATIONS, kd=kd, kds=", ".join(f"{x:g}" for x in KDS)),
        *_resolved(rows),
    ]
    for quantity, name in (("total", "Total albedo"), ("lobe", "Body lobe")):
        for sigma in SIGMAS:
            for gamma in GAMMAS:
                for n in sorted(INDICES):
                    shown = {"gamma": gamma, "sigma": sigma, "n": n, "kd": kd}
                    of = [row for row in worst if row.items() >= shown.items()]
                    parts += ["", f"## {name}, γ = {gamma:g}, σ = {sigma:g}, n = {n:g}", ""]
                    parts += _table(of, quantity)
    return "\n".join([*parts, ""])


def _resolved(rows: list[Row]) -> Iterator[str]:
    """What was traced, what would cross, and how well it is known."""
    errors = sorted(row["total_se"] for row in rows)
    crossing = sum(not possible(pair, gap) for pair in PAIRS for gap in GAPS)
    needed = max(max(statistics_of(pair)["needed_gap"]) for pair in PAIRS)
    yield (
        f"Of {len(PAIRS) * len(GAPS)} pairs of surfaces and gaps {crossing} would cross; "
        f"the pair that needs most room would take a gap of {needed:.0f} L. Standard errors of the "
        f"total are {errors[len(errors) // 2]:.2f} % (median) and at most {errors[-1]:.2f} %, "
        f"{sum(e > 0.5 for e in errors)} of {len(errors)} above 0.5 %."
    )


def _table(rows: list[Row], quantity: str) -> Iterator[str]:
    values = {
        (r["substrate_over_interface"], r["correlation"], r["gap_over_length"]): r for r in rows
    }
    yield "| substrate | " + " | ".join(f"{gap:g} L" for gap in GAPS) + " |"
    yield "|---" * (1 + len(GAPS)) + "|"
    for ratio, correlation in KINDS:
        name = NAMES[ratio] if ratio == 0 else f"{NAMES[ratio]}, ρ = {correlation:g}"
        cells = [_cell(values.get((ratio, correlation, gap)), quantity) for gap in GAPS]
        if any(cell != "–" for cell in cells):
            yield f"| {name} | " + " | ".join(cells) + " |"


def _cell(row: Row | None, quantity: str) -> str:
    if row is None:
        return "–"
    half = row[f"{quantity}_high"] - row[quantity]
    return f"{row[quantity]:.1f} ± {half:.1f}"


_LAYERING = """# Where layering holds, and where one IL facet does

Independent pairs of surfaces (ρ = 0), traced, against interfaced-Lambertian (IL) facets on the same
interfaces and against the `layered-walk`, which takes nothing but slopes: {runs} runs of {walks}
walks. Otherwise as in the [atlas](atlas.md): the worst of θ_i = 0, 60, 80° at Kd = {kd}, in
percent, ± half of the 95 % interval; – : surfaces of some realisation would cross. IL is paired
with the traces, surface by surface; the walk is not, and has the scatter of surfaces in its
interval.
All rows, with every θ_i and Kd: [layering.csv](layering.csv).
`python -m validation.layers.layering` goes on where it was stopped.

![Where layering holds within 1, 3 and 10 %](layering.png)

*Kd = {kd}, σ = 0.5. A colour says what the upper end of the interval is within.*
"""


def layering(worst: list[Row], kd: float) -> str:
    """The page of the theory of independent layers."""
    parts = [_LAYERING.format(runs=WALK_RUNS, walks=WALKS, kd=kd)]
    gaps = " | ".join(f"{gap:g} L" for gap in FAR_GAPS)
    for (quantity, name), sigma, gamma in product(
        (("total", "Total albedo"), ("lobe", "Body lobe")), SIGMAS, GAMMAS
    ):
        parts += [f"## {name}, γ = {gamma:g}, σ = {sigma:g}", ""]
        parts += [f"| substrate | n | theory | {gaps} |", "|---" * (3 + len(FAR_GAPS)) + "|"]
        for ratio, n, theory in product(RATIOS, sorted(INDICES), THEORIES):
            shown = {
                "theory": theory, "sigma": sigma, "gamma": gamma, "n": n, "kd": kd,
                "substrate_over_interface": ratio,
            }  # fmt: skip
            of = {r["gap_over_length"]: r for r in worst if r.items() >= shown.items()}
            cells = " | ".join(_cell(of.get(gap), quantity) for gap in FAR_GAPS)
            if of:
                parts.append(f"| {NAMES[ratio]} | {n:g} | {THEORIES[theory]} | {cells} |")
        parts.append("")
    return "\n".join(parts)


_LIMITS = """# Both limits of two layers

![Both limits](limits.png)

*Bands: 95 % over {surfaces} realisations. Left, dotted: the power fitted up to a gap of L/8.*

## Thin: the same relief over itself

Body light of two layers over that of IL facets − 1, n = 1.5, as a (gap/L)ᵖ fitted to gaps of L/64
to L/8, with 95 % intervals by the jackknife of realisations. L is the correlation length of the
generating field, autocorrelation exp(−r²/L²).
All gaps: [thin.csv](thin.csv).

| γ | σ | L (cells) | θ_i | Kd | at L/16 (%) | coefficient a | exponent p |
|---|---|---|---|---|---|---|---|
"""
_THICK = """
## Thick: the closed limit

Total of two layers over R + (1 − R) K (1 − r′)/(1 − K r′) − 1, in percent ± standard error over
realisations; σ 0.5, n = 1.5, Kd = 0.8. R, r_e′ and K are traced for each realisation, from
either of its surfaces alone.
[thick.csv](thick.csv)

| γ | substrate | θ_i | """


def limits(thin: list[Row], thick: list[Row]) -> str:
    """The page of both limits."""
    lines = [_LIMITS.format(surfaces=REALISATIONS).rstrip("\n")]
    for row in thin:
        if not row["fitted"]:
            power = "– | –"
        else:
            power = (
                f"{row['coefficient']:.2f} ± {row['coefficient_half']:.2f} | "
                f"{row['exponent']:.2f} ± {row['exponent_half']:.2f}"
            )
        near = f"{row['gap_0.0625_percent']:+.2f} ± {row['gap_0.0625_se']:.2f}"
        lines.append(
            f"| {row['gamma']:g} | {row['sigma']:g} | {row['length']:g} | {row['theta_i']:g}° "
            f"| {row['kd']:g} | {near} | {power} |"
        )
    gaps = sorted({row["gap_over_length"] for row in thick})
    lines.append(_THICK + " | ".join(f"{gap:g} L" for gap in gaps) + " |")
    lines.append("|---" * (3 + len(gaps)) + "|")
    axes = ("gamma", "substrate_over_interface", "correlation", "theta_i")
    for kind in dict.fromkeys(tuple(r[axis] for axis in axes) for r in thick):
        shown = dict(zip(axes, kind, strict=True))
        of = {
            r["gap_over_length"]: f"{r['percent']:+.2f} ± {r['se']:.2f}"
            for r in thick
            if r.items() >= shown.items()
        }
        cells = " | ".join(of.get(gap, "–") for gap in gaps)
        gamma, ratio, correlation, theta = kind
        name = f"{NAMES[ratio]}, ρ = {correlation:g}"
        lines.append(f"| {gamma:g} | {name} | {theta:g}° | {cells} |")
    return "\n".join([*lines, ""])
