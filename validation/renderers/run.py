"""Judge the BSDFs of Mitsuba: a table, a figure, and a page of both.

    python -m validation.renderers.run

Writes mitsuba.csv (every row, both seeds), mitsuba.png and mitsuba.md to reports/renderers.
Ten minutes of processor time; wants the extra ``mitsuba``.
"""

import sys
from pathlib import Path

from microsurf.cli.save import Content, rounded, save
from microsurf.report.figures.figure import DPI

from . import study
from .figure import errors_and_light
from .text import page

OUT = Path(__file__).parents[2] / "reports" / "renderers"
SEEDS = (1, 2)
DIGITS = 4


def main() -> None:
    """Compute and write all three."""
    predicted = study.predictions()
    written = rounded((row for seed in SEEDS for row in study.rows(predicted, seed)), DIGITS)
    # The page says what the table says, to the last digit.
    table = [study.as_read(row) for row in written]
    OUT.mkdir(parents=True, exist_ok=True)
    text = page(table)
    contents: dict[str, Content] = {
        "mitsuba.csv": written,
        "mitsuba.md": text,
        "mitsuba.png": errors_and_light([row for row in table if row["seed"] == SEEDS[0]]),
    }
    save(OUT, contents, DPI)
    sys.stdout.write(text)


if __name__ == "__main__":
    main()
