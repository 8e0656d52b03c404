"""The picture that opens the README: a rendered GGX surface, and its lobes against theory.

`make gallery` writes it to reports/gallery. Wants the extra ``mitsuba``; the relief takes two
minutes on two cores.
"""

from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from microsurf import measure, predict
from microsurf.report.figures.figure import write
from microsurf.report.figures.style import BLACK, BLUE, GREY, VERMILION, clean, own_style
from microsurf.scene import Scene
from microsurf.surface.realisations import surface_of

from . import gallery, relief

SIDE = 96
"""Cells of the part that is drawn."""
CORNER = (240, 336)
"""Row and column of its first cell: peaks and pits lie inside."""
N, THETA = 1.5, 60.0
"""Relative index, and incidence in degrees."""


def draw_lobes(axes: Axes, scene: Scene) -> None:
    """Draw BRDFs in the plane of incidence, traced and by single scattering."""
    traced, theory = measure(scene, progress=True), predict(scene)
    for style, kind in (((VERMILION, "-", "s"), "specular"), ((BLUE, "-", "o"), "body")):
        gallery.points(axes, traced, scene, style, f"traced, order-1 {kind}", kind=kind)
        gallery.line(axes, theory, scene, style, f"Smith, order-1 {kind}", kind=kind)
    gallery.points(axes, traced, scene, (BLACK, "", "D"), "traced, all orders", None)
    axes.axvline(THETA, color=GREY, linewidth=0.7, linestyle=(0, (1, 3)))
    axes.set(
        yscale="log", xlim=(-90, 90), xticks=np.arange(-90, 91, 30), ylim=(1e-3, 1),
        xlabel=r"$\theta_o$ in the plane of incidence (°), mirror side positive",
        ylabel="BRDF (1/sr)",
    )  # fmt: skip
    axes.legend(fontsize=8, loc="center left", bbox_to_anchor=(0.02, 0.5), framealpha=0.95)
    clean(axes)
    axes.set_title(f"lobes for light from {THETA:g}°", fontsize=9)


@own_style()
def main() -> None:
    """Draw and write the picture."""
    scene = gallery.scene(2.0, 0.5, N, THETA)
    scene = replace(scene, surface=replace(scene.surface, realisations=8))
    row, column = CORNER
    heights = surface_of(scene, 0, 0).heights[row : row + SIDE, column : column + SIDE]
    picture = relief.render(heights - heights.mean(), THETA, N, gallery.KD)
    figure = Figure(figsize=(9.5, 3.9), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.25, 1))
    left.imshow(picture)
    left.axis("off")
    left.set_title(f"{SIDE} × {SIDE} cells of a surface, heights to scale", fontsize=9)
    draw_lobes(right, scene)
    write(figure, gallery.OUT / "surface-and-lobes.png", dpi=150)


if __name__ == "__main__":
    main()
