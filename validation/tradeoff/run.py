"""The frontier of each built-in scene, twice: pictures, numbers, and whether the order repeats.

    python -m validation.tradeoff.run                    # the built-in scenes, two seeds
    python -m validation.tradeoff.run a.toml b.toml --out DIR

Runs the quick trade-off of `microsurf tradeoff` at two angles of each scene. Writes to
reports/tradeoff a CSV for each scene (first run), frontiers.png, over_all.png, and repeat.md
and repeat.csv: pairs of methods whose order one run tells beyond its errors and the other tells
the other way round. Of methods that tie, chance turns a few round: exit code 1 if there are more
than it would in 999 of 1000 cases. Finished runs are kept in reports/latest/frontiers: the same
command goes on after a stop; delete it to begin again.
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

from scipy import stats

from microsurf.analysis.tradeoff import pareto
from microsurf.analysis.tradeoff.effort import EFFORTS
from microsurf.analysis.tradeoff.study import Tradeoff, tradeoff
from microsurf.cli.save import Content, rounded, save
from microsurf.report.figures import pareto_all
from microsurf.report.figures.pareto import rows, within
from microsurf.scene import Light, Scene
from microsurf.scene.builtin import built_in_scenes
from microsurf.stats.intervals import CONFIDENCE

from ..checkpoint import LATEST, once

OUT = Path(__file__).parents[2] / "reports" / "tradeoff"
KEPT = LATEST / "frontiers"
SEEDS = 3000, 4000  # apart from the report's own and from repeat.py's
ANGLES = 30.0, 60.0
CHANCE = 2 * ((1 - CONFIDENCE) / 2) ** 2
"""That two runs tell two equal methods apart, and in opposite order."""
Row = dict[str, Any]
Pairs = list[list[str]]


def at_two_angles(scene: Scene) -> Scene:
    """The same scene at 30 and 60 degrees if it has both, else at its first two above 0."""
    own = [theta for theta in scene.light.theta if theta > 0] or list(scene.light.theta)
    angles = ANGLES if set(ANGLES) <= set(own) else tuple(own[:2])
    return replace(scene, light=Light(angles, scene.light.phi), expect={})


def separated_pairs(found: Tradeoff) -> dict[str, dict[str, Pairs]]:
    """Pairs (above, below) by quantity that a run tells apart: of error, and of cost."""
    return {
        quantity: {
            "error": [
                [a.name, b.name]
                for a in points
                for b in points
                if a is not b and pareto.worse(a.squared, b.squared)
            ],
            "cost": [[a.name, b.name] for a in points for b in points
                     if a.seconds_low > b.seconds_high],
        }
        for quantity, points in found.points.items()
    }  # fmt: skip


def kept_run(path: Path, run: int) -> Row:
    """Rows and pairs of one run of a scene, made now or by an earlier call."""

    def make() -> Row:
        asked = at_two_angles(Scene.read(path))
        found = tradeoff(asked, EFFORTS["quick"], seed=SEEDS[run], progress=True)
        return {"rows": rows(found), "separated": separated_pairs(found), "seconds": found.seconds}

    content: Row = once(KEPT / f"{path.stem}-{run + 1}.json", make)
    return content


def repeated(scene: str, one: Row, other: Row) -> list[Row]:
    """By the error of each quantity and by cost: pairs of methods, and what both runs say."""
    table: list[Row] = []
    for quantity, first in one["separated"].items():
        names = [row["rung"] for row in one["rows"] if row["quantity"] == quantity]
        for order, pairs in first.items():
            if order == "cost" and any(row["of"] == "cost" for row in table):
                continue  # it is the same for every quantity
            above = {tuple(pair) for pair in pairs}
            again = {tuple(pair) for pair in other["separated"][quantity][order]}
            back = {(b, a) for a, b in again}
            table.append({
                "scene": scene,
                "quantity": quantity if order == "error" else "every",
                "of": order,
                "pairs": len(list(combinations(names, 2))),
                "separated_in_both": len(above & again),
                "separated_in_one": len(above ^ again) - 2 * len(above & back),
                "reversed": len(above & back),
                "which": "; ".join(f"{a} > {b}" for a, b in sorted(above & back)),
            })  # fmt: skip
    for row in table:
        separated = row["separated_in_both"] + row["separated_in_one"] + row["reversed"]
        row["ties"] = row["pairs"] - separated
    return table


def ties(table: list[Row]) -> int:
    """Pairs whose errors not both runs tell apart, in the same order: they may be equal."""
    return sum(row["pairs"] - row["separated_in_both"] for row in table if row["of"] == "error")


def allowed(table: list[Row]) -> int:
    """Pairs that chance may turn round, were all ties exactly equal; more in 1 case of 1000."""
    return int(stats.binom.isf(1e-3, ties(table), CHANCE))


def page(table: list[Row]) -> str:
    """The counts in Markdown."""
    lines = [
        "# The same trade-offs again",
        "",
        (
            f"Written by `validation/tradeoff/run.py`: the quick trade-off of"
            f" {len({row['scene'] for row in table})} scenes with two seeds. A pair of methods is"
            " separated in a run if its difference is beyond its 95 % interval (of error), or if"
            " the ranges of their costs do not overlap; else it is a tie."
        ),
        "",
        "| pairs of methods | by error | by cost |",
        "|---|---|---|",
    ]
    words = {
        "pairs": "all, of all scenes and quantities",
        "separated_in_both": "separated by both runs, in the same order",
        "separated_in_one": "separated by one run, a tie in the other",
        "ties": "ties in both",
        "reversed": "in opposite order",
    }
    for key, text in words.items():
        counts = [sum(r[key] for r in table if r["of"] == order) for order in ("error", "cost")]
        lines.append(f"| {text} | {counts[0]} | {counts[1]} |")
    lines += [
        "",
        (
            f"Were all {ties(table)} pairs that not both runs tell apart exactly equal in error,"
            f" chance alone would turn about {CHANCE * ties(table):.2g} of them round"
            f" (2 × 0.025² each); {allowed(table)} are allowed, and none by cost. Scenes share"
            " their seeds: walks of two with the same roughness are the same walks."
        ),
        "",
        "| scene | quantity | of | pairs | both | one | ties | reversed | which |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    keys = ("scene", "quantity", "of", "pairs", "separated_in_both", "separated_in_one",
            "ties", "reversed", "which")  # fmt: skip
    lines += ["| " + " | ".join(str(row[key]) for key in keys) + " |" for row in table]
    return "\n".join(lines) + "\n"


def name_of(path: Path) -> str:
    """The scene's name and roughness."""
    rough = Scene.read(path).roughness
    return f"{path.stem}: γ {rough.gamma:g}, σ {rough.sigma_x:g}"


def main(words: Sequence[str] | None = None) -> int:
    """Run, write, and return 1 if more pairs turned round than chance explains."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", type=Path, help="TOML files; default the built-in")
    parser.add_argument("--out", type=Path, default=OUT)
    asked = parser.parse_args(words)
    asked.out.mkdir(parents=True, exist_ok=True)
    tables, table = {}, []
    contents: dict[str, Content] = {}
    for path in asked.scenes or built_in_scenes():
        one, other = (kept_run(path, run) for run in range(len(SEEDS)))
        tables[name_of(path)] = one["rows"]
        table += repeated(path.stem, one, other)
        contents[f"{path.stem}.csv"] = rounded(one["rows"], 4)
        print(f"{path.stem}: {one['seconds'] + other['seconds']:.0f} s", file=sys.stderr)  # noqa: T201
        for row in within(one["rows"]):
            what = f"  {row['quantity']} within {100 * row['level']:g} %: "
            cost = f"{row['rung']}, {row['seconds']:.3g} s" if row["rung"] else "nothing shown"
            print(what + cost)  # noqa: T201
    contents |= {
        "frontiers.png": pareto_all.scenes(tables),
        "over_all.png": pareto_all.over_all(pareto_all.medians(tables)),
        "repeat.csv": rounded(table, 4),
        "repeat.md": page(table),
    }
    save(asked.out, contents)
    turned = {
        of: sum(row["reversed"] for row in table if row["of"] == of) for of in ("error", "cost")
    }
    return int(turned["error"] > allowed(table) or turned["cost"] > 0)


if __name__ == "__main__":
    sys.exit(main())
