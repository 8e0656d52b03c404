"""Where one IL facet stands for two explicit layers: both traced on the same interfaces.

    python -m validation.layers.atlas     # goes on where it was stopped

Writes reports/layers: atlas.csv (how far IL facets are from two layers, with standard errors
over the realisations), pairs.csv (what pairs of surfaces realise, and the gap they need so as
not to cross), atlas.md and the figure; and the table of the package that `microsurf advise`
answers from. What is traced lies in reports/latest/layers.
"""

import argparse
from collections.abc import Iterator
from itertools import groupby, product
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from microsurf.analysis import il_assumption
from microsurf.analysis.il_assumption import AXES
from microsurf.cli.save import rounded, save
from microsurf.stats import intervals

from . import figures, text
from .cases import (
    GAPS,
    INDICES,
    KDS,
    PAIRS,
    REALISATIONS,
    SUMS,
    THETAS,
    Pair,
    alone,
    possible,
    statistics_of,
    two_layers,
)
from .measures import lobe_distance, relative

Row = dict[str, Any]

SHOWN_KD = 0.8
TABLE = Path(il_assumption.__file__).with_suffix(".csv")
OUT = Path(__file__).parents[2] / "reports" / "layers"


def rows_of(pair: Pair, n: float, gap: float) -> Iterator[Row]:
    """How far IL is from one pair of surfaces, at each angle and Kd."""
    layers, facets = two_layers(pair, n, gap), alone(pair.gamma, pair.sigma, n)
    for (t, theta), (k, kd) in product(enumerate(THETAS), enumerate(KDS)):
        one, other = layers[:, t, k], facets[:, t, k]
        row = {
            "gamma": pair.gamma, "sigma": pair.sigma, "n": n,
            "substrate_over_interface": pair.ratio, "correlation": pair.correlation,
            "gap_over_length": gap, "theta_i": theta, "kd": kd,
            "il_albedo": other[:, 0].mean(),
        }  # fmt: skip
        for column, name in enumerate(SUMS):
            row[f"{name}_percent"], row[f"{name}_se"] = relative(one[:, column], other[:, column])
        lobe = lobe_distance(one[:, len(SUMS) :], other[:, len(SUMS) :])
        yield row | dict(zip(("lobe_percent", "lobe_low", "lobe_high"), lobe, strict=True))


def worst_rows(rows: list[Row]) -> Iterator[Row]:
    """The worst of all θ_i by the upper end of its interval, in percent: the package's table."""
    t = intervals.student(REALISATIONS - 1)
    for key, of_key in groupby(sorted(rows, key=_place), key=_place):
        of = list(of_key)
        totals = [(abs(r["total_percent"]), t * r["total_se"]) for r in of]
        total, half = max(totals, key=sum)
        lobe = max(of, key=lambda r: float(r["lobe_high"]))
        yield {
            **dict(zip(AXES, key, strict=True)),
            "total": total, "total_low": max(total - half, 0.0), "total_high": total + half,
            "lobe": lobe["lobe_percent"], "lobe_low": lobe["lobe_low"],
            "lobe_high": lobe["lobe_high"],
        }  # fmt: skip


def _place(row: Row) -> tuple[float, ...]:
    return tuple(row[axis] for axis in AXES)


def pair_row(pair: Pair) -> Row:
    """What a pair realises."""
    what = statistics_of(pair)
    return {
        "gamma": pair.gamma, "sigma": pair.sigma, "substrate_over_interface": pair.ratio,
        "correlation": pair.correlation,
        "needed_gap_median": float(np.median(what["needed_gap"])),
        "needed_gap_max": max(what["needed_gap"]),
        "height_correlation": float(np.mean(what["height_correlation"])),
        "slope_correlation": float(np.mean(what["slope_correlation"])),
        "possible_gaps": sum(possible(pair, gap) for gap in GAPS),
    }  # fmt: skip


def cases() -> list[tuple[Pair, float, float]]:
    """All pairs, indices and gaps whose surfaces do not cross."""
    return [
        (pair, n, gap) for pair, gap in product(PAIRS, GAPS) for n in INDICES if possible(pair, gap)
    ]


def main() -> None:
    """Trace what is not traced yet, then write."""
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    rows = [row for case in tqdm(cases(), disable=None) for row in rows_of(*case)]
    OUT.mkdir(parents=True, exist_ok=True)
    worst = list(worst_rows(rows))
    save(TABLE.parent, {TABLE.name: rounded(worst, 3)})
    save(OUT, {
        "atlas.csv": rounded(rows, 3),
        "pairs.csv": rounded((pair_row(pair) for pair in PAIRS), 3),
        "atlas.md": text.atlas(worst, rows, SHOWN_KD),
        "atlas.png": figures.atlas(worst, 1.5, SHOWN_KD, 0.5, (8.0, 2.0)),
    })  # fmt: skip


if __name__ == "__main__":
    main()
