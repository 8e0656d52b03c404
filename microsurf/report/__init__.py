"""Plots and pages."""

from collections.abc import Mapping
from pathlib import Path

import xarray as xr

from ..files import whole_file
from .attachments import make_folder, make_folders
from .figures import figure, lobes_of_results
from .html import Drawn, Report, write
from .phrases import movements, unexpected

__all__ = [
    "Drawn",
    "Report",
    "make_folder",
    "make_folders",
    "movements",
    "plot_results",
    "unexpected",
    "write",
]


def plot_results(results: Mapping[str, xr.Dataset], out: Path, kd: float | None = None) -> None:
    """Draw the lobes of results, by their files, into one picture, in the format of its ending.

    The same results give the same bytes.
    """
    drawn = lobes_of_results.figure(results, kd)
    with whole_file(out) as temporary:
        figure.write(drawn, temporary)
