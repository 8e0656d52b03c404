"""Two layers that know nothing of each other: traced surfaces against three theories.

    python -m validation.layers.independent.run     # goes on where it was stopped

Writes reports/layers/independent.csv (light of each source, and how far it is from the two
traced surfaces, with standard errors over realisations), parts.csv (which part of the limit the
walk is off by, and the structure's effect) and the figure. What is traced lies in
reports/latest/layers/independent.
"""

from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from microsurf.cli.save import rounded, save

from ..measures import relative
from . import figures, parts
from .cases import GAPS, QUANTITIES, SOURCES, THETAS, WALKS, light_of

Row = dict[str, Any]

OUT = Path(__file__).parents[3] / "reports" / "layers"
STRUCTURE = "smith-walk over il"
"""What Smith's walk is off by on one layer of the same interfaces: the structure's effect."""


def rows() -> Iterator[Row]:
    """One row a source, quantity, incidence and γ."""
    for gamma in GAPS:
        light = {source: light_of(gamma, source) for source in SOURCES}
        for (t, theta), (q, quantity) in product(enumerate(THETAS), enumerate(QUANTITIES)):
            values = {source: light[source][:, t, q] for source in SOURCES}
            pairs = {source: (values[source], values["layers"]) for source in SOURCES[1:]}
            pairs[STRUCTURE] = values["smith-walk"], values["il"]
            for source, (ones, others) in pairs.items():
                if np.isnan(ones).any():
                    continue
                paired = len(ones) == len(others)
                percent, error = relative(ones, others, paired=paired, walks=WALKS)
                yield {
                    "gamma": gamma, "gap_over_length": GAPS[gamma], "theta_i": theta,
                    "quantity": quantity, "source": source, "value": float(ones.mean()),
                    "reference": float(others.mean()), "percent": percent, "percent_error": error,
                }  # fmt: skip


def main() -> None:
    """Trace what is missing, write table and figure."""
    table = list(rows())
    OUT.mkdir(parents=True, exist_ok=True)
    figure = figures.figure(table)
    save(
        OUT,
        {
            "independent.csv": rounded(table, 5),
            "parts.csv": rounded(parts.rows(), 5),
            "independent.png": figure,
            "independent.pdf": figure,
        },
    )


if __name__ == "__main__":
    main()
