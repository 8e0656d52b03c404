"""Plots and pages."""

from collections.abc import Mapping
from pathlib import Path

import xarray as xr

from ..files import whole_file
from .attachments import make_folder, make_folders
from .figures import lobes
from .figures.figure import DPI, svg
from .html import write
from .phrases import movements, unexpected

__all__ = ["make_folder", "make_folders", "movements", "plot_results", "unexpected", "write"]


def plot_results(results: Mapping[str, xr.Dataset], out: Path, kd: float | None = None) -> None:
    """Draw the lobes of results into one picture; the ending of ``out`` chooses the format.

    The same results give the same bytes.
    """
    figure = lobes.of_results(results, kd)
    ending = out.suffix.lower()
    with whole_file(out) as temporary:
        if ending == ".svg":
            temporary.write_text(svg(figure), encoding="utf-8", newline="\n")
        else:
            undated = {"CreationDate": None} if ending == ".pdf" else {"Software": None}
            figure.savefig(temporary, dpi=DPI, metadata=undated)
