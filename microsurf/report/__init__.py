"""Plots and pages."""

from collections.abc import Mapping
from pathlib import Path

import xarray as xr

from ..files import whole_file
from . import plots
from .page import make_folder, write

__all__ = ["make_folder", "plot_results", "plots", "write"]


def plot_results(results: Mapping[str, xr.Dataset], out: Path, kd: float | None = None) -> None:
    """Draw the lobes of results into one picture; the ending of ``out`` chooses the format."""
    figure = plots.results(results, kd)
    with whole_file(out) as temporary:
        figure.savefig(temporary, dpi=200)
