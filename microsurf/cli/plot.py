"""microsurf plot: pictures of results."""

from pathlib import Path

import click

from .. import report
from ..files import check_writable
from ..results import datasets
from ..scene import Material
from .options import INPUT, PATH, as_json
from .output import check_ending, show


@click.command("plot")
@click.argument("files", type=INPUT, nargs=-1, required=True, metavar="FILE.nc …")
@click.option("--kd", type=float, help="Substrate albedo; default the first of each result.")
@click.option("--out", type=PATH, required=True, help="FILE.png, .pdf or .svg.")
@as_json
def plot_command(files: tuple[Path, ...], kd: float | None, out: Path, as_json: bool) -> None:
    """Draw the lobes of results in the plane of incidence.

    One measurement, and predictions: each with its own material.

    Example: microsurf plot measured.nc predicted.nc --out lobes.pdf
    """
    if kd is not None:
        Material(kd=(kd,))  # checks it
    check_ending(out, ".png", ".pdf", ".svg")
    check_writable(out)
    report.plot_results({str(file): datasets.load(file) for file in files}, out, kd)
    show({"file": str(out)}, as_json)
