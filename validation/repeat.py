"""Whether a second run says the same: verdicts with other seeds, and with a third of the rays.

    python validation/repeat.py                       # the built-in scenes, three times
    python validation/repeat.py a.toml b.toml --out DIR

Writes repeat.md and repeat.csv, a row for each comparison, to reports/calibration. Two
verdicts may disagree, by their stated rates, only where an interval ends near the margin;
none may flip between holds and departs (exit code 1 if one does). Fewer rays make intervals
wider where rays decide them, and leave them where surfaces do. Finished scenes are kept in
reports/latest/repeat: the same command goes on after a stop; delete it to begin again.
"""

import argparse
import csv
import json
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from microsurf.files import whole_file
from microsurf.scene import Scene
from microsurf.scene_file import read
from microsurf.validate import validate_scene
from microsurf.verdict import Comparison

HERE = Path(__file__).parent
OUT = HERE.parent / "reports" / "calibration"
KEPT = HERE.parent / "reports" / "latest" / "repeat"
SEEDS = 1000, 2000  # apart from the report's own
Row = dict[str, object]


def third(scene: Scene) -> Scene:
    """The same scene with a third of its rays."""
    return replace(scene, accuracy=replace(scene.accuracy, paths=scene.accuracy.paths // 3))


def rows_of(name: str, runs: Sequence[Sequence[Comparison]]) -> list[Row]:
    """One row for each comparison: what the first, second and third run said."""
    table: list[Row] = []
    for one, other, fewer in zip(*runs, strict=True):
        width = other.high - other.low  # of the same surfaces
        table.append({
            "scene": name,
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


def kept_rows(path: Path) -> list[Row]:
    """The rows of a scene, run now or by an earlier call."""
    kept = KEPT / f"{path.stem}.json"
    if not kept.exists():
        KEPT.mkdir(parents=True, exist_ok=True)
        scene = read(path)
        runs = [
            validate_scene(path.stem, s, seed=seed).comparisons
            for s, seed in ((scene, SEEDS[0]), (scene, SEEDS[1]), (third(scene), SEEDS[1]))
        ]
        with whole_file(kept) as temporary:
            temporary.write_text(json.dumps(rows_of(path.stem, runs)), encoding="utf-8")
    rows: list[Row] = json.loads(kept.read_text(encoding="utf-8"))
    return rows


def page(table: list[Row]) -> str:
    """The figures over all comparisons in Markdown."""
    count = len(table)
    other, fewer, flips = (
        sum(bool(row[key]) for row in table) for key in ("disagree", "disagree_third", "flips")
    )
    widths = np.array([row["width_third"] for row in table], float)
    middle = [f"{x:.2f}" for x in np.quantile(widths, [0.25, 0.5, 0.75])]
    lines = [
        "# The same scenes again",
        "",
        (
            f"Written by `validation/repeat.py`: {count} comparisons of"
            f" {len({row['scene'] for row in table})} scenes, two seeds, and the second seed with"
            " a third of the rays."
        ),
        "",
        "| | |",
        "|---|---|",
        f"| verdicts that differ with the seed | {other} of {count} |",
        f"| verdicts that differ with the seed and a third of the rays | {fewer} of {count} |",
        f"| between holds and departs (must be 0) | {flips} |",
        f"| width of an interval with a third of the rays: quartiles | {', '.join(middle)} |",
        f"| mean of the widths' ratio | {np.exp(np.log(widths[widths > 0]).mean()):.2f} |",
        "",
    ]
    differ = [row for row in table if row["disagree"] or row["disagree_third"]]
    if differ:
        lines += [
            "| differs | first | second | a third of the rays | margin |",
            "|---|---|---|---|---|",
        ]
    for row in differ:
        cells = [
            f"{row[f'verdict_{run}']} ({row[f'low_{run}']:.4f} … {row[f'high_{run}']:.4f})"
            for run in ("first", "second", "third_rays")
        ]
        place = f"{row['scene']}, {row['quantity']}, θ {row['theta_i']:g}°, Kd {row['kd']:g}"
        lines.append(f"| {place} | " + " | ".join(cells) + f" | {row['margin']} |")
    return "\n".join(lines) + "\n"


def main(words: Sequence[str] | None = None) -> int:
    """Run, write, and return 1 if a verdict flipped."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", type=Path, help="TOML files; default the built-in")
    parser.add_argument("--out", type=Path, default=OUT)
    asked = parser.parse_args(words)
    table: list[Row] = []
    for path in asked.scenes or sorted((HERE / "scenes").glob("*.toml")):
        table += kept_rows(path)
        print(f"{path.stem}: {len(table)} comparisons so far", file=sys.stderr)  # noqa: T201
    asked.out.mkdir(parents=True, exist_ok=True)
    with (asked.out / "repeat.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(table[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(table)
    (asked.out / "repeat.md").write_text(page(table), encoding="utf-8")
    return int(any(row["flips"] for row in table))


if __name__ == "__main__":
    sys.exit(main())
