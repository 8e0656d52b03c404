"""Planted defects, and which term of the error budget the difference they make lands in.

    python -m validation.calibration.known_defects    # some minutes; goes on after a stop

Slopes 2 % too steep on the same surfaces, traced by the same rays: slopes. Another structure of
the same slopes: masking, and of later orders masking and multiple together, for it also changes
how light that is met again gets out; masking alone is shown besides. A tracer, and a walk of the
model, that end at the third event: multiple. r_i 5 % too high in the model: model. Writes
known_defects.md and .csv to reports/calibration: for each part of the light the share of its
difference in the right term, and the jackknife's 95 % interval over surfaces. A difference that
surfaces and rays leave open (its own interval holds 0, or it is below 2e-4) is shown and not
counted.
"""

import sys
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import xarray as xr
from tqdm import tqdm

from microsurf import measure, model
from microsurf.analysis.error_budget import assemble
from microsurf.analysis.error_budget.regions import FIRST, HIGHER, TOTAL
from microsurf.analysis.error_budget.terms import Case, split
from microsurf.cli.save import rounded, save
from microsurf.physics.facet import body_weight
from microsurf.physics.fresnel import internal_diffuse_reflectance
from microsurf.results import detector
from microsurf.scene import Accuracy, Light, Material, Roughness, Scene, Surface
from microsurf.stats import intervals
from microsurf.surface import Heightfield, surfaces_of

from ..checkpoint import LATEST, once

OUT = Path(__file__).parents[2] / "reports" / "calibration"
KEPT = LATEST / "known_defects"
GAMMAS = (1.75, 2.0, 8.0)
N, KD = 1.5, 0.8
SURFACES, PATHS, WALKS, SLOPE_WALKS = 12, 131_072, 1_000_000, 100_000
STRUCTURES = ("tops", "middle", "extremes")
STRUCTURE_TERMS = "masking + multiple", "masking"
LEAST = 2e-4  # of the light: less is no difference worth telling apart
PARTS = (*FIRST, *HIGHER, TOTAL)
Predicted = tuple[xr.Dataset, xr.Dataset | None]


def scene_of(gamma: float, structure: str = "independent") -> Scene:
    """σ = 0.5 at 30, 60 and 80°, on the default mesh."""
    return Scene(
        material=Material(N, (KD,)),
        roughness=Roughness(gamma, (0.5,)),
        surface=Surface(realisations=SURFACES, structure=structure),
        light=Light((30.0, 60.0, 80.0)),
        accuracy=Accuracy(PATHS),
    )


def r_i_too_high(predicted: Predicted) -> Predicted:
    """The substrate's weight with an internal reflectance 5 % too high, at every body event."""
    r = 1.05 * float(internal_diffuse_reflectance(N))
    factor = KD * (1 - r) / (1 - KD * r) / float(body_weight(N, KD))

    def wrong(data: xr.Dataset) -> xr.Dataset:
        b = detector.BODY_EVENTS[: data.sizes["body_events"]]
        return data.assign(flux=data.flux * xr.DataArray(factor**b, dims="body_events"))

    first, walk = predicted
    return wrong(first), None if walk is None else wrong(walk)


def capped(data: xr.Dataset) -> xr.Dataset:
    """Without what leaves after the second event."""
    return data.assign(flux=data.flux.where(data.order < 3, 0.0))


def defects(gamma: float) -> Iterator[tuple[str, str, list[Case], list[Case]]]:
    """Each defect, its term, and the budgets' cases before and after, by angle."""
    scene = scene_of(gamma)
    surfaces = list(surfaces_of(scene, 1))
    measured = measure(scene, surfaces, seed=2)
    predicted = model.predict(scene), model.walk(scene, walks=WALKS, seed=9)

    def cases(
        seen: xr.Dataset, of: list[Heightfield], asked: Scene = scene, own: Predicted = predicted
    ) -> list[Case]:
        theory = None if own is predicted else predicted
        found = assemble.cases_of(asked, seen, own, of, theory=theory, walks=SLOPE_WALKS)
        return list(found.values())

    before = cases(measured, surfaces)
    steep = [replace(h, heights=1.02 * h.heights) for h in surfaces]
    yield "slopes 2 % too steep", "slopes", before, cases(measure(scene, steep, seed=2), steep)
    for structure in STRUCTURES:
        asked = scene_of(gamma, structure)
        others = list(surfaces_of(asked, 1))
        after = cases(measure(asked, others, seed=2), others, asked)
        yield f"structure: {structure}", STRUCTURE_TERMS[0], before, after
    yield "tracer ends at the third event", "multiple", before, cases(capped(measured), surfaces)
    wrong = predicted[0], capped(predicted[1])
    after = cases(measured, surfaces, own=wrong)
    yield "model's walk ends at the third event", "multiple", before, after
    yield "model's r_i 5 % too high", "model", before, cases(
        measured, surfaces, own=r_i_too_high(predicted)
    )  # fmt: skip


def moved(before: Case, after: Case, leave_out: int | None) -> dict[str, dict[str, float]]:
    """What each term of each part changes, without one of the surfaces."""
    budgets = []
    for case in (before, after):
        measured = case.measured
        if leave_out is not None:
            measured = {q: np.delete(values, leave_out) for q, values in measured.items()}
        budgets.append(split(replace(case, measured=measured)))
    one, other = budgets
    return {
        q: {term: other[q][term].value - one[q][term].value for term in one[q]}
        for q in PARTS
        if q in one
    }


def shares(name: str, right: str, before: Case, after: Case) -> list[dict[str, object]]:
    """One row for each part of the light and each term it is looked for in."""
    whole = moved(before, after, None)
    less = [moved(before, after, k) for k in range(SURFACES)]
    factor = intervals.student(SURFACES - 1) * np.sqrt((SURFACES - 1) ** 2 / SURFACES)
    rows: list[dict[str, object]] = []
    for q, terms in whole.items():
        difference = sum(terms.values())
        own = factor * np.std([sum(one[q].values()) for one in less], ddof=1)
        if abs(difference) < 1e-9:
            continue  # the defect does not touch this part
        looked_for: tuple[str, ...] = (right,)
        if right == STRUCTURE_TERMS[0]:  # order 1 has no multiple
            looked_for = STRUCTURE_TERMS[1:] if q in FIRST else STRUCTURE_TERMS
        for term in looked_for:
            parts = [_in(one[q], term) / sum(one[q].values()) for one in less]
            half = factor * float(np.std(parts, ddof=1))
            share = _in(terms, term) / difference
            rows.append({
                "defect": name, "term": term, "quantity": q, "difference": float(difference),
                "difference_half_width": float(own), "share": float(share),
                "low": float(share - half), "high": float(share + half),
                "resolved": bool(abs(difference) > max(own, LEAST)),
            })  # fmt: skip
    return rows


def _in(terms: Mapping[str, float], names: str) -> float:
    return sum(terms.get(name, 0.0) for name in names.split(" + "))


def rows_of(gamma: float) -> list[dict[str, object]]:
    """Rows of one γ, made now."""
    return [
        {"gamma": gamma, "theta_i": theta, **row}
        for name, term, before, after in defects(gamma)
        for theta, b, a in zip(scene_of(gamma).light.theta, before, after, strict=True)
        for row in shares(name, term, b, a)
    ]


def page(rows: list[dict[str, object]]) -> str:
    """A line for each defect and part: shares over γ and angles, and how many are resolved."""
    lines = [
        "# Known defects in the error budget",
        "",
        (
            f"Written by `validation/calibration/known_defects.py`: γ"
            f" {', '.join(f'{g:g}' for g in GAMMAS)},"
            f" σ 0.5, θ 30, 60, 80°, n {N}, Kd {KD}, {SURFACES} surfaces. The share of the"
            " difference that lands in the right term, over the cases in which the difference"
            " is resolved; *four fifths*: in how many it is at least 0.8, and in how many it"
            " may be, by the 95 % interval."
        ),
        "",
        "| defect | term | part | resolved | least, median, greatest | four fifths | may be |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, q, term in dict.fromkeys((r["defect"], r["quantity"], r["term"]) for r in rows):
        mine = [r for r in rows if (r["defect"], r["quantity"], r["term"]) == (name, q, term)]
        counted = [r for r in mine if r["resolved"]]
        cells_of_case = "no case", "", ""
        if counted:
            values = np.array([r["share"] for r in counted], float)
            highs = np.array([r["high"] for r in counted], float)
            cells_of_case = (
                f"{values.min():.2f}, {np.median(values):.2f}, {values.max():.2f}",
                f"{(values >= 0.8).sum()}",
                f"{(highs >= 0.8).sum()}",
            )
        cells = map(str, (name, term, q, f"{len(counted)} of {len(mine)}", *cells_of_case))
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def main() -> int:
    """Run what is not there yet, and write."""
    rows = [
        row
        for gamma in tqdm(GAMMAS, desc="γ", disable=None)
        for row in once(KEPT / f"{gamma:g}.json", partial(rows_of, gamma))
    ]
    save(OUT, {"known_defects.csv": rounded(rows, 5), "known_defects.md": page(rows)})
    return 0


if __name__ == "__main__":
    sys.exit(main())
