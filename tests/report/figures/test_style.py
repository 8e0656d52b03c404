"""Figures look the same whatever the user's matplotlibrc asks for."""

import matplotlib as mpl
import pytest

from microsurf.report.figures.figure import write
from microsurf.report.figures.style import clean, new_figure, own_style

ODD = {
    "text.usetex": True, "axes.facecolor": "red", "font.size": 30, "savefig.facecolor": "green",
    "savefig.bbox": "tight", "lines.linewidth": 9, "xtick.labelsize": 25, "figure.dpi": 300,
    "axes.formatter.use_mathtext": True, "svg.fonttype": "none", "image.cmap": "gray",
}  # fmt: skip


@own_style()
def drawn():
    """A figure with ticks and a legend, whose letters take their style when they are laid out."""
    figure = new_figure(2, 3)
    axes = figure.subplots()
    axes.plot([1e-9, 2e5], [3, 4], label="σ")
    axes.set_title(r"$\theta_i$ = 60°")
    axes.legend()
    clean(axes)
    return figure


@pytest.mark.parametrize("ending", ["svg", "png", "pdf"])
def test_what_a_matplotlibrc_asks_for_changes_no_byte(tmp_path, ending):
    plain, odd = (tmp_path / f"{name}.{ending}" for name in ("plain", "odd"))
    write(drawn(), plain)
    with mpl.rc_context(ODD):
        write(drawn(), odd)
        assert mpl.rcParams["font.size"] == ODD["font.size"]  # the user's own are left alone
    assert odd.read_bytes() == plain.read_bytes()
