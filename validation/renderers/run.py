"""Judge the BSDFs of Mitsuba: a table, a figure, and a page of both.

    python -m validation.renderers.run

Writes mitsuba.csv (every row, both seeds), mitsuba.png and mitsuba.md to reports/renderers.
Six minutes on one core; wants the extra ``mitsuba``.
"""

import sys
from pathlib import Path

from microsurf.cli.save import rounded
from microsurf.files import whole_file
from microsurf.report.figures.figure import as_csv, write

from . import study
from .figure import errors_and_light
from .text import page

OUT = Path(__file__).parents[2] / "reports" / "renderers"
SEEDS = (1, 2)


def main() -> None:
    """Compute and write all three."""
    predicted = study.predictions()
    table = [row for seed in SEEDS for row in study.rows(predicted, seed)]
    OUT.mkdir(parents=True, exist_ok=True)
    with whole_file(OUT / "mitsuba.csv") as temporary:
        temporary.write_text(as_csv(rounded(table, 4)), encoding="utf-8", newline="\n")
    with whole_file(OUT / "mitsuba.md") as temporary:
        temporary.write_text(page(table), encoding="utf-8", newline="\n")
    with whole_file(OUT / "mitsuba.png") as temporary:
        write(errors_and_light([row for row in table if row["seed"] == SEEDS[0]]), temporary)
    sys.stdout.write(page(table))


if __name__ == "__main__":
    main()
