"""The picture that opens the README: a part of a GGX surface, and its lobes against theory.

`make gallery` writes it to reports/gallery.
"""

from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.axes3d import Axes3D
from numpy.typing import NDArray

from microsurf import measure, predict
from microsurf.report.figures.style import BLACK, BLUE, GREY, VERMILION, clean, own_style
from microsurf.scene import Scene
from microsurf.surface.realisations import surface_of

from . import gallery

SIDE = 96
"""Cells of the part that is drawn."""
CORNER = (240, 336)
"""Row and column of its first cell: peaks and pits lie inside."""
THETA = 60.0
"""Incidence in degrees."""


def draw_relief(axes: Axes3D, heights: NDArray[np.float64]) -> None:
    """Draw heights (cells) to scale, illuminated from the direction of incidence."""
    q, p = np.gradient(heights)
    cosine = (p * np.sin(np.radians(THETA)) + np.cos(np.radians(THETA))) / np.sqrt(1 + p**2 + q**2)
    shade = 0.22 + 0.78 * np.clip(cosine, 0, 1)
    y, x = np.mgrid[: heights.shape[0], : heights.shape[1]]
    axes.plot_surface(
        x, y, heights, facecolors=shade[..., None] * np.array([0.82, 0.88, 0.95]),
        rcount=SIDE, ccount=SIDE, linewidth=0, antialiased=False, shade=False,
    )  # fmt: skip
    # Matplotlib's third axis takes the unit of the others only by its share of the box.
    axes.set_box_aspect((SIDE, SIDE, float(np.ptp(heights))), zoom=1.32)
    axes.set_axis_off()
    axes.view_init(elev=38, azim=-62)
    axes.set_title(f"{SIDE} × {SIDE} cells of a surface, heights to scale", fontsize=9)


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
    scene = gallery.scene(2.0, 0.5, 1.5, THETA)
    scene = replace(scene, surface=replace(scene.surface, realisations=8))
    row, column = CORNER
    heights = surface_of(scene, 0, 0).heights[row : row + SIDE, column : column + SIDE]
    figure = Figure(figsize=(9.5, 3.9), layout="constrained")
    left, right = np.asarray(figure.subfigures(1, 2, width_ratios=(1, 1.35)))
    relief = left.add_subplot(projection="3d", computed_zorder=False)
    draw_relief(relief, heights - heights.mean())
    draw_lobes(right.add_subplot(), scene)
    gallery.save(figure, "surface-and-lobes")


if __name__ == "__main__":
    main()
