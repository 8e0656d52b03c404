"""microsurf stability: how many digits of the laws are right, and where meshes and traces end."""

import csv
import json
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import click

from ..files import whole_file
from ..report import make_folder, stability_plot, stability_text
from ..stability import Stability, survey
from .options import PATH, as_json
from .output import show, write


@click.command("stability")
@click.option("--quick", is_flag=True, help="A coarse map: half a minute on one core, not several.")
@click.option(
    "--out", type=PATH, default=Path("reports/stability"), show_default=True, help="Folder."
)
@as_json
def stability_command(quick: bool, out: Path, as_json: bool) -> None:
    """Ask every law at the extremes against 50 digits, and meshes and traces at their borders.

    Writes stability.md, .csv and .json and a picture for each group of laws. Exit code 1 if
    a law has fewer than 12 digits right beyond what its conditioning costs and does not say
    why, or if anything is NaN, infinite or negative.

    Example: microsurf stability --quick --out my_map
    """
    make_folder(out)
    found = survey(quick=quick, progress=True)
    values = stability_text.as_json(found) | {"quick": quick, "out": str(out)}
    _save(found, values, out)
    if as_json:
        show(values, as_json=True)
    else:
        write(stability_text.markdown(found))
        write(f"\nwritten to {out}   ({found.seconds:.0f} s)")
    if not found.sound:
        raise click.exceptions.Exit(1)


def _save(found: Stability, values: dict[str, Any], out: Path) -> None:
    """Write all files; none takes its name before all are written."""
    with ExitStack() as files:

        def place(name: str) -> Path:
            return files.enter_context(whole_file(out / name))

        text, table, data = (place(f"stability.{ending}") for ending in ("md", "csv", "json"))
        text.write_text(stability_text.markdown(found), encoding="utf-8")
        data.write_text(json.dumps(values, indent=1, allow_nan=False), encoding="utf-8")
        rows = stability_plot.rows(found)
        with table.open("w", encoding="utf-8", newline="") as lines:
            writer = csv.DictWriter(lines, list(rows[0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
        for group in dict.fromkeys(point.group for point in found.points):
            figure = stability_plot.figure(found, group)
            figure.savefig(place(f"stability-{group}.png"), dpi=85)
