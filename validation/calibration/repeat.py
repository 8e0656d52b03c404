"""Whether a second run says the same: verdicts with other seeds, and with a third of the rays.

    python -m validation.calibration.repeat    # the built-in scenes, three times each
    python -m validation.calibration.repeat a.toml b.toml --out DIR

Writes repeat.md and repeat.csv, a row for each comparison, to reports/calibration. Two
verdicts may disagree, by their stated rates, only where an interval ends near the margin;
with the scenes' own rays none may flip between holds and departs (exit code 1 if one does).
There it is the spread of surfaces that decides intervals, and a third of the rays leaves
them; so the same is done with FEW rays, where rays decide, and a verdict is wrong as often as
it says. Finished scenes are kept in reports/latest/repeat: the same command goes on after a
stop; delete it to begin again.
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from microsurf.analysis.comparison import Comparison
from microsurf.analysis.validate import validate_scene
from microsurf.cli.save import save
from microsurf.scene import Scene
from microsurf.scene.builtin import built_in_scenes

from ..checkpoint import LATEST, once

OUT = Path(__file__).parents[2] / "reports" / "calibration"
KEPT = LATEST / "repeat"
SEEDS = 1000, 2000  # apart from the report's own
FEW = 3000, 300  # paths of each surface and angle
Row = dict[str, object]


def with_paths(scene: Scene, paths: int) -> Scene:
    """The same scene with so many paths of each surface and angle."""
    return replace(scene, accuracy=replace(scene.accuracy, paths=paths))


def rows_of(name: str, paths: int, runs: Sequence[Sequence[Comparison]]) -> list[Row]:
    """One row for each comparison: what the first, second and third run said."""
    table: list[Row] = []
    for one, other, fewer in zip(*runs, strict=True):
        width = other.high - other.low  # of the same surfaces
        table.append({
            "scene": name,
            "paths": paths,
            **{key: getattr(one, key) for key in ("quantity", "theta_i", "phi_i", "kd", "margin")},
            **{
                f"{key}_{run}": getattr(row, key)
                for run, row in (("first", one), ("second", other), ("third_rays", fewer))
                for key in ("effect", "low", "high", "verdict")
            },
            "disagree": one.verdict != other.verdict,
            "disagree_third": one.verdict != fewer.verdict,
            "flips": any({one.verdict, r.verdict} == {"holds", "departs"} for r in (other, fewer)),
            "width_third": (fewer.high - fewer.low) / width if width > 0 else 1.0,
            # Estimates of one quantity: of their difference in units of its error.
            "shift": _shift(one, other),
        })  # fmt: skip
    return table


def _shift(one: Comparison, other: Comparison) -> float:
    error = np.hypot(one.standard_error, other.standard_error) / one.predicted
    return float((one.effect - other.effect) / error) if error > 0 else 0.0


def run(path: Path, paths: int) -> list[Row]:
    """The rows of a scene, three runs with so many paths, the last with a third."""
    scene = Scene.read(path)
    runs = [
        validate_scene(path.stem, with_paths(scene, asked), seed=seed).comparisons
        for asked, seed in ((paths, SEEDS[0]), (paths, SEEDS[1]), (paths // 3, SEEDS[1]))
    ]
    return rows_of(path.stem, paths, runs)


def figures(table: list[Row]) -> list[str]:
    """The cells of one column of the page."""
    count = len(table)
    other, fewer, flips = (
        sum(bool(row[key]) for row in table) for key in ("disagree", "disagree_third", "flips")
    )
    widths = np.array([row["width_third"] for row in table], float)
    return [
        f"{count} of {len({row['scene'] for row in table})} scenes",
        f"{other}",
        f"{fewer}",
        f"{flips}",
        ", ".join(f"{x:.2f}" for x in np.quantile(widths, [0.25, 0.5, 0.75])),
        f"{np.exp(np.log(widths[widths > 0]).mean()):.2f}",
    ]


def page(table: list[Row]) -> str:
    """The figures over all comparisons in Markdown."""
    columns = [figures([row for row in table if row["paths"] not in FEW])]
    columns += [figures([row for row in table if row["paths"] == paths]) for paths in FEW]
    words = (
        "comparisons",
        "verdicts that differ with the seed",
        "verdicts that differ with the seed and a third of the rays",
        "between holds and departs",
        "width of an interval with a third of the rays: quartiles of the ratio",
        "mean of the ratio (√3 = 1.73 where rays alone decide)",
    )
    lines = [
        "# The same scenes again",
        "",
        (
            "Written by `validation/calibration/repeat.py`: two seeds, and the second seed with"
            " a third of the"
            " rays, on the same surfaces. With the scenes' own rays the spread of surfaces decides"
            " the intervals; with few paths a surface and angle, rays do. A verdict of holds or"
            " departs is wrong in up to 4 % of cases; undecided says nothing. Shown below: all that"
            " differ with the scenes' own rays, and flips."
        ),
        "",
        f"| | the scenes' own rays | {' | '.join(f'{paths} paths' for paths in FEW)} |",
        "|---|---" + "|---" * len(FEW) + "|",
        *(
            f"| {word} | {' | '.join(cells)} |"
            for word, *cells in zip(words, *columns, strict=True)
        ),
        "",
    ]
    differ = [row for row in table if row["flips"] or row["paths"] not in FEW]
    differ = [row for row in differ if row["disagree"] or row["disagree_third"]]
    if differ:
        lines += [
            "| differs | paths | first | second | a third of the rays | margin |",
            "|---|---|---|---|---|---|",
        ]
    for row in differ:
        cells = [
            f"{row[f'verdict_{run}']} ({row[f'low_{run}']:.4f} … {row[f'high_{run}']:.4f})"
            for run in ("first", "second", "third_rays")
        ]
        place = f"{row['scene']}, {row['quantity']}, θ {row['theta_i']:g}°, Kd {row['kd']:g}"
        lines.append(f"| {place} | {row['paths']} | " + " | ".join(cells) + f" | {row['margin']} |")
    return "\n".join(lines) + "\n"


def main(words: Sequence[str] | None = None) -> int:
    """Run, write, and return 1 if a verdict flipped with the scene's own rays."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", type=Path, help="TOML files; default the built-in")
    parser.add_argument("--out", type=Path, default=OUT)
    asked = parser.parse_args(words)
    table: list[Row] = []
    for path in asked.scenes or built_in_scenes():
        own = Scene.read(path).accuracy.paths
        for kept, paths in (("own", own), *((f"{few}", few) for few in FEW)):
            table += once(KEPT / f"{path.stem}-{kept}.json", partial(run, path, paths))
        print(f"{path.stem}: {len(table)} comparisons so far", file=sys.stderr)  # noqa: T201
    asked.out.mkdir(parents=True, exist_ok=True)
    save(asked.out, {"repeat.csv": table, "repeat.md": page(table)})
    return int(any(row["flips"] for row in table if row["paths"] not in FEW))


if __name__ == "__main__":
    sys.exit(main())
