"""Frontiers of some built-in scenes in one picture, with the numbers behind it.

python validation/tradeoff_figure.py [--theta 60] [--effort quick] [--out reports/tradeoff] [NAME …]
"""

import argparse
import csv
from dataclasses import replace
from pathlib import Path

from microsurf import scene_file
from microsurf.files import whole_file
from microsurf.ladder_effort import EFFORTS
from microsurf.report.frontier_plot import panels, rows
from microsurf.scene import Light
from microsurf.tradeoff import tradeoff

SCENES = ("02-r18-lambertian", "07-ggx", "03-r18-interfaced")


def main() -> None:
    """Run the ladder on each scene and draw them below each other."""
    parser = argparse.ArgumentParser(description="Draw frontiers of built-in scenes.")
    parser.add_argument("names", nargs="*", default=list(SCENES), metavar="NAME")
    parser.add_argument("--theta", type=float, nargs="*", help="default: the scene's angles")
    parser.add_argument("--effort", choices=list(EFFORTS), default="quick")
    parser.add_argument("--out", type=Path, default=Path("reports/tradeoff"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    tables = {}
    for name in options.names:
        scene = replace(scene_file.read(Path(f"validation/scenes/{name}.toml")), expect={})
        if options.theta:
            scene = replace(scene, light=Light(tuple(options.theta)))
        tables[name] = rows(tradeoff(scene, EFFORTS[options.effort], progress=True))
        with (
            whole_file(options.out / f"{name}.csv") as path,
            path.open("w", encoding="utf-8", newline="") as lines,
        ):
            writer = csv.DictWriter(lines, list(tables[name][0]), lineterminator="\n")
            writer.writeheader()
            for row in tables[name]:
                writer.writerow(
                    {k: f"{v:.4g}" if isinstance(v, float) else v for k, v in row.items()}
                )
    with whole_file(options.out / "frontiers.png") as path:
        panels(tables).savefig(path, dpi=90)


if __name__ == "__main__":
    main()
