"""Frontiers of some built-in scenes in one picture, with the numbers behind it.

python validation/tradeoff_figure.py [--theta 60] [--effort quick] [--out reports/tradeoff] [NAME …]

A scene whose CSV is there is not run again.
"""

import argparse
import csv
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

from microsurf import scene_file
from microsurf.files import whole_file
from microsurf.ladder_effort import EFFORTS
from microsurf.report.frontier_plot import panels, rows, within
from microsurf.scene import Light
from microsurf.tradeoff import tradeoff

_WORDS = ("quantity", "rung", "model", "bytes_basis", "dominated_by")
SCENES = ("02-r18-lambertian", "07-ggx", "03-r18-interfaced")


def read(path: Path) -> list[dict[str, Any]]:
    """Rows of a scene that was run before."""
    with path.open(encoding="utf-8") as lines:
        return [
            {k: (v or None) if k in _WORDS else float(v or "nan") for k, v in row.items()}
            for row in csv.DictReader(lines)
        ]


def run(name: str, theta: list[float] | None, effort: str) -> list[dict[str, Any]]:
    """Rows of a built-in scene, at other angles if any are given."""
    scene = replace(scene_file.read(Path(f"validation/scenes/{name}.toml")), expect={})
    if theta:
        scene = replace(scene, light=Light(tuple(theta)))
    return rows(tradeoff(scene, EFFORTS[effort], progress=True))


def write(table: list[dict[str, Any]], target: Path) -> None:
    """Write rows as CSV."""
    with whole_file(target) as path, path.open("w", encoding="utf-8", newline="") as lines:
        writer = csv.DictWriter(lines, list(table[0]), lineterminator="\n")
        writer.writeheader()
        for row in table:
            writer.writerow({k: f"{v:.4g}" if isinstance(v, float) else v for k, v in row.items()})


def main() -> None:
    """Run the ladder on each scene that has no CSV yet, and draw them below each other."""
    parser = argparse.ArgumentParser(description="Draw frontiers of built-in scenes.")
    parser.add_argument("names", nargs="*", default=list(SCENES), metavar="NAME")
    parser.add_argument("--theta", type=float, nargs="*", help="default: the scene's angles")
    parser.add_argument("--effort", choices=list(EFFORTS), default="quick")
    parser.add_argument("--out", type=Path, default=Path("reports/tradeoff"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    for name in options.names:
        target = options.out / f"{name}.csv"
        if not target.is_file():
            write(run(name, options.theta, options.effort), target)
    tables = {name: read(options.out / f"{name}.csv") for name in options.names}
    with whole_file(options.out / "frontiers.png") as path:
        panels(tables).savefig(path, dpi=90)
    for name, table in tables.items():
        for row in within(table):
            what = f"{name}, {row['quantity']} within {100 * row['level']:g} %: "
            cost = f"{row['rung']}, {row['seconds']:.3g} s\n" if row["rung"] else "nothing shown\n"
            sys.stdout.write(what + cost)


if __name__ == "__main__":
    main()
