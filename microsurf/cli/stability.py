"""microsurf stability: digits of the formulas that are right, and where meshes and traces end."""

from pathlib import Path
from typing import Any

import click

from ..report import make_folder, stability_text
from ..report.figures import stability
from ..stability import Stability, survey
from .options import PATH, as_json
from .output import show, write
from .save import Content, save


@click.command("stability")
@click.option("--quick", is_flag=True, help="A coarse map: half a minute on one core, not several.")
@click.option(
    "--out", type=PATH, default=Path("reports/stability"), show_default=True, help="Folder."
)
@as_json
def stability_command(quick: bool, out: Path, as_json: bool) -> None:
    """Check every formula against 50-digit arithmetic at extreme parameters, and meshes and traces.

    Writes stability.md, .csv and .json and a picture for each group of formulas. Exit code 1 if
    a formula has fewer than 12 digits right beyond what its conditioning costs and does not say
    why, or if anything is NaN, infinite or negative.

    Example: microsurf stability --quick --out my_map
    """
    make_folder(out)
    result = survey(quick=quick, progress=True)
    values = stability_text.as_json(result) | {"quick": quick, "out": str(out)}
    _save(result, values, out)
    if as_json:
        show(values, as_json=True)
    else:
        write(stability_text.markdown(result))
        write(f"\nwritten to {out}   ({result.seconds:.0f} s)")
    if not result.sound:
        raise click.exceptions.Exit(1)


def _save(result: Stability, values: dict[str, Any], out: Path) -> None:
    contents: dict[str, Content] = {
        "stability.md": stability_text.markdown(result),
        "stability.csv": stability.rows(result),
        "stability.json": values,
    }
    for group in dict.fromkeys(point.group for point in result.points):
        contents[f"stability-{group}.png"] = stability.figure(result, group)
    save(out, contents, dpi=85)
