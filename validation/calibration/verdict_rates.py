"""How often a verdict is wrong: intervals over few surfaces, whose spread was measured.

    python -m validation.calibration.verdict_rates    # some minutes

A population of SURFACES measured surfaces (heavy tails, small tiles: the spread is not
normal) has a known mean. Reports of R of them, drawn at random, are compared with that mean,
and with a prediction for which the truth lies at the margin itself: there holds and departs
are each wrong in at most 2.5 %. R = 1 knows its rays only. Writes reports/calibration/
verdicts.csv and .md.
"""

from pathlib import Path

import numpy as np
from tqdm import tqdm

from microsurf.analysis.comparison import decide, half_width
from microsurf.cli.save import rounded, save
from microsurf.results import albedos
from microsurf.scene import Accuracy, Light, Material, Roughness, Scene, Surface
from microsurf.stats.intervals import CONFIDENCE
from microsurf.surface import generate_surface
from microsurf.trace import measure

OUT = Path(__file__).parents[2] / "reports" / "calibration"
SURFACES, REPORTS, MARGIN = 100, 20_000, 0.05
COUNTS = (1, 2, 4, 8, 12)
THETA = 60.0


def population(gamma: float) -> dict[str, tuple[np.ndarray, float]]:
    """Each quantity on every surface, and the standard error of one from its rays."""
    scene = Scene(
        material=Material(1.5, (0.8,)),
        roughness=Roughness(gamma, (0.5,)),
        surface=Surface(cells=128, realisations=SURFACES),
        light=Light((THETA,)),
        accuracy=Accuracy(50_000),
    )
    made = [generate_surface(gamma, 0.5, cells=128, seed=5000 + k) for k in range(SURFACES)]
    measured = measure(scene, made, seed=5)
    found = {}
    for name in ("specular", "body", "total"):
        values = measured.microsurf.albedo(**albedos.SELECTED[name], n=1.5, kd=0.8).values.ravel()
        noise = measured.microsurf.ray_error(**albedos.SELECTED[name], n=1.5, kd=0.8).values.ravel()
        found[name] = values, float(np.sqrt(np.mean(noise**2)))
    return found


def rates(values: np.ndarray, noise: float, count: int, rng: np.random.Generator) -> list[float]:
    """Share of intervals that miss the truth, and wrong verdicts at either side of the margin."""
    truth = values.mean()
    drawn = rng.choice(values, (REPORTS, count))
    means = drawn.mean(axis=1)
    errors = drawn.std(axis=1, ddof=1) / np.sqrt(count) if count > 1 else np.full(REPORTS, noise)
    unit = half_width(1.0, count, 0.0, 1.0, 0.0, CONFIDENCE)
    missed = np.mean(np.abs(means - truth) > unit * errors)
    wrong = []
    for side in (1 + MARGIN, 1 - MARGIN):
        prediction = truth / side
        effect, half = means / prediction - 1, unit * errors / prediction
        said = [decide(e - h, e + h, MARGIN) for e, h in zip(effect, half, strict=True)]
        wrong += [
            float(np.mean([word == verdict for word in said])) for verdict in ("holds", "departs")
        ]
    return [float(missed), *wrong]


def main() -> None:
    """Write the table."""
    rng = np.random.default_rng(1)
    table = []
    for gamma in tqdm((1.75, 2.0, 8.0), disable=None):
        for name, (values, noise) in population(gamma).items():
            z = (values - values.mean()) / values.std()
            for count in COUNTS:
                missed, *wrong = rates(values, noise, count, rng)
                table.append({
                    "gamma": gamma, "quantity": name, "spread": values.std() / values.mean(),
                    "skewness": np.mean(z**3), "kurtosis": np.mean(z**4) - 3, "surfaces": count,
                    "missed": missed, "holds_wrong": max(wrong[0], wrong[2]),
                    "departs_wrong": max(wrong[1], wrong[3]),
                })  # fmt: skip
    OUT.mkdir(parents=True, exist_ok=True)
    lines = [
        "# Wrong verdicts",
        "",
        (
            f"Written by `validation/calibration/verdict_rates.py`: {REPORTS} reports drawn from"
            f" {SURFACES}"
            " measured surfaces of 128² cells, θ 60°. Worst of γ = 1.75, 2, 8 and of specular,"
            " body, total. Stated: 5 % of intervals miss the truth; a verdict is wrong in at most"
            " 2.5 %, and in so many only where the truth lies at the margin, as it does here."
        ),
        "",
        "| surfaces | intervals that miss | wrong holds | wrong departs |",
        "|---|---|---|---|",
    ]
    for count in COUNTS:
        of = [row for row in table if row["surfaces"] == count]
        worst = [max(row[key] for row in of) for key in ("missed", "holds_wrong", "departs_wrong")]
        lines.append(f"| {count} | " + " | ".join(f"{100 * v:.1f} %" for v in worst) + " |")
    save(OUT, {"verdicts.csv": rounded(table, 4), "verdicts.md": "\n".join(lines) + "\n"})


if __name__ == "__main__":
    main()
