"""Where layering holds for two explicit layers that are independent, beside where IL holds.

    python -m validation.layers.layering     # goes on where it was stopped

Writes reports/layers: layering.csv (how far two traced layers are from IL facets and from the walk
in layers that know nothing of each other), layering.md and the figure. Traces are those of
the atlas, and those of one gap more.
"""

import argparse
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any

from tqdm import tqdm

from microsurf.cli.save import rounded, save

from . import figures, text
from .atlas import SHOWN_KD, worst_rows
from .cases import (
    FAR_GAPS,
    INDICES,
    KDS,
    PAIRS,
    SUMS,
    THETAS,
    Pair,
    alone,
    possible,
    two_layers,
    walked,
)
from .measures import lobe_distance, relative

Row = dict[str, Any]

OUT = Path(__file__).parents[2] / "reports" / "layers"


def rows_of(pair: Pair, n: float, gap: float) -> Iterator[Row]:
    """How far two layers are from either theory, at each angle and Kd."""
    layers = two_layers(pair, n, gap)
    theories = dict(
        zip(figures.THEORIES, (alone(pair.gamma, pair.sigma, n), walked(pair, n)), strict=True)
    )
    for theory, (t, theta), (k, kd) in product(theories, enumerate(THETAS), enumerate(KDS)):
        one, other = layers[:, t, k], theories[theory][:, t, k]
        paired = theory == "il"
        total = relative(one[:, 0], other[:, 0], paired=paired)
        lobe = lobe_distance(one[:, len(SUMS) :], other[:, len(SUMS) :], paired=paired)
        yield {
            "theory": theory, "gamma": pair.gamma, "sigma": pair.sigma, "n": n,
            "substrate_over_interface": pair.ratio, "correlation": pair.correlation,
            "gap_over_length": gap, "theta_i": theta, "kd": kd,
            "total_percent": total[0], "total_se": total[1],
            "lobe_percent": lobe[0], "lobe_low": lobe[1], "lobe_high": lobe[2],
        }  # fmt: skip


def cases() -> list[tuple[Pair, float, float]]:
    """Independent pairs, indices and gaps whose surfaces do not cross."""
    independent = [pair for pair in PAIRS if pair.correlation == 0]
    return [
        (pair, n, gap)
        for pair, gap, n in product(independent, FAR_GAPS, INDICES)
        if possible(pair, gap)
    ]


def main() -> None:
    """Trace what is not traced yet, then write."""
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    rows = [row for case in tqdm(cases(), disable=None) for row in rows_of(*case)]
    worst = [
        {"theory": theory} | row
        for theory in figures.THEORIES
        for row in worst_rows([row for row in rows if row["theory"] == theory])
    ]
    OUT.mkdir(parents=True, exist_ok=True)
    save(OUT, {
        "layering.csv": rounded(rows, 3),
        "layering.md": text.layering(worst, SHOWN_KD),
        "layering.png": figures.layering(worst, SHOWN_KD, 0.5),
    })  # fmt: skip


if __name__ == "__main__":
    main()
