"""How often the tests of the suite reject nothing, and how often they catch a defect.

    python -m validation.calibration.run    # a few minutes; goes on where it was stopped

Writes reports/calibration: calibration.md and .csv. Each test of `nulls` runs on 200 seeds
with nothing to find, each defect of `defects` on 100 seeds, at the sample size and the level
of the suite. Exits with 1 if a rate lies outside its interval or a defect is missed twice.
"""

import hashlib
import sys
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import cache, partial
from pathlib import Path

import numpy as np
from scipy import stats
from tqdm import tqdm

from microsurf.cli.save import save
from microsurf.files import whole_file

from . import defects, nulls

OUT = Path(__file__).parents[2] / "reports" / "calibration"
KEPT = Path(__file__).parents[2] / "reports" / "latest" / "calibration"
"""p-values of what is through; git ignores them. Remove them to start anew."""
SEEDS, CONTROLS, CAUGHT = 200, 100, 99
FIRST = 10_000  # seeds that no test of the suite uses
LEVELS = (0.05, 0.01)
LEVEL = 2e-6  # of a family in the suite, tests/judge.py
CERTAIN = 0.999  # of the binomial interval: of 16 rates one is outside in 2 % of runs


@cache
def offset(factor: float) -> defects.Offset:
    """Compile the tracer with that distance off a facet, once a process."""
    return defects.Offset(factor)


def elsewhere(seed: int) -> float:
    """Paths 10 000 times too far off their facet."""
    return offset(1e4).paths(seed)


def on_it(seed: int) -> float:
    """Paths no distance at all off their facet."""
    return offset(0.0).lost(seed)


MPMATH, FACET, WALK = (
    "formula against mpmath",
    "facet by evaluation, Kd = 0.8",
    "walk against quadrature",
)
DEFECTS: tuple[tuple[str, str, Callable[[int], float]], ...] = (
    *(
        (
            f"{formula} off by 1 %",
            MPMATH,
            partial(defects.formula_against_mpmath, formula=formula, factor=1.01),
        )
        for formula in ("F", "T", "r_i", "Λ")
    ),
    *(
        (f"{formula} off by 1 %", FACET, partial(defects.facet_by_evaluation, defect=formula))
        for formula in ("F", "T", "r_i")
    ),
    ("1/n² left out", FACET, partial(defects.facet_by_evaluation, defect="1/n²")),
    *(
        (f"{formula} off by 1 %", WALK, partial(defects.walk_against_quadrature, defect=formula))
        for formula in ("F", "T", "r_i", "Λ")
    ),
    ("slopes 2 % too steep", "surface statistics", partial(defects.slope_quantiles, factor=1.02)),
    ("slopes 2 % too flat", "surface statistics", partial(defects.slope_quantiles, factor=0.98)),
    ("8 bounces at most", "white furnace", partial(defects.white_furnace, cap=8)),
    ("10 000 times the distance off a facet", "paths on the float64 engine", elsewhere),
    ("no distance off a facet", "lost and endless paths", on_it),
)


@dataclass(frozen=True)
class Row:
    """One rate: ``low`` … ``high`` is where it must lie."""

    kind: str
    test: str
    by: str
    level: float
    seeds: int
    rejected: int
    low: int
    high: int
    uniform: float | None

    @property
    def right(self) -> bool:
        """Whether the count lies where it must."""
        return self.low <= self.rejected <= self.high


def null_rows(name: str, p_values: np.ndarray) -> list[Row]:
    """Rejections at each level, and the p-value of the p-values' own uniformity."""
    # Holm's p-values are bounds, cut off at 1: only their rates say something.
    of = None if name.startswith("Holm") else float(stats.kstest(p_values, "uniform").pvalue)
    rows = []
    for level in LEVELS:
        ends = stats.binom.ppf([(1 - CERTAIN) / 2, (1 + CERTAIN) / 2], len(p_values), level)
        count = int((p_values <= level).sum())
        low, high = (int(end) for end in ends)
        rows.append(Row("null", name, "", level, len(p_values), count, low, high, of))
    return rows


def p_values(
    pool: ProcessPoolExecutor, name: str, run: Callable[[int], float], seeds: int
) -> np.ndarray:
    """One for each seed, from the last run if that came so far."""
    kept = KEPT / f"{hashlib.sha256(name.encode()).hexdigest()[:16]}.npy"
    if kept.exists():
        return np.asarray(np.load(kept))
    numbers = range(FIRST, FIRST + seeds)
    # What compiles the tracer anew stays here: once, and not in each process.
    at_once = map(run, numbers) if run in (elsewhere, on_it) else None
    values = np.array(list(at_once or pool.map(run, numbers, chunksize=4)))
    with whole_file(kept) as temporary, temporary.open("wb") as file:
        np.save(file, values)
    return values


def rows() -> list[Row]:
    """Run it all."""
    found: list[Row] = []
    KEPT.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(2) as pool:
        for name in tqdm(nulls.NULLS, desc="nulls", disable=None):
            found += null_rows(name, p_values(pool, name, partial(null, name), SEEDS))
        for name, by, run in tqdm(DEFECTS, desc="defects", disable=None):
            values = p_values(pool, f"{name}, {by}", run, CONTROLS)
            count = int((values <= LEVEL).sum())
            found.append(Row("defect", name, by, LEVEL, CONTROLS, count, CAUGHT, CONTROLS, None))
    return found


def null(name: str, seed: int) -> float:
    """One p-value of a test by its name, which processes can be sent."""
    return nulls.NULLS[name](seed)


def _figure(value: float | None) -> str:
    return "a bound" if value is None else f"{value:.2g}"


def page(found: list[Row]) -> str:
    """Both tables in Markdown."""
    lines = [
        "# Calibration",
        "",
        "Written by `validation/calibration/run.py`.",
        "",
        f"## Nothing to find, {SEEDS} seeds",
        "",
        (
            f"Rejections, and in brackets the {100 * CERTAIN:g} % binomial interval; last, the"
            " p-value of a Kolmogorov–Smirnov test that the p-values are uniform."
        ),
        "",
        "| test | " + " | ".join(f"at {100 * level:g} %" for level in LEVELS) + " | uniform |",
        "|---|" + "---|" * (len(LEVELS) + 1),
    ]
    null_tests = [row for row in found if row.kind == "null"]
    for name in dict.fromkeys(row.test for row in null_tests):
        of = [row for row in null_tests if row.test == name]
        cells = [f"{row.rejected} ({row.low} … {row.high})" for row in of]
        lines.append(f"| {name} | " + " | ".join(cells) + f" | {_figure(of[0].uniform)} |")
    lines += [
        "",
        f"## Defects, {CONTROLS} seeds",
        "",
        f"Caught at the suite's level of {LEVEL:g} and at its sample size; {CAUGHT} are demanded.",
        "",
        "| defect | comparison that must catch it | caught |",
        "|---|---|---|",
        *(f"| {r.test} | {r.by} | {r.rejected} |" for r in found if r.kind == "defect"),
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Write both files."""
    found = rows()
    OUT.mkdir(parents=True, exist_ok=True)
    table = [{**asdict(row), "right": row.right} for row in found]
    save(OUT, {"calibration.md": page(found), "calibration.csv": table})
    wrong = [row for row in found if not row.right]
    for row in wrong:
        print(f"{row.test} {row.by}: {row.rejected}, not {row.low} … {row.high}")  # noqa: T201
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
