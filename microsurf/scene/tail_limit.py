"""The border beyond which a mesh can't hold the tail of the slopes."""

from ..physics import student_t
from .scene import Scene

LEAST_GAMMA = 1.65
"""From here on meshes of 256² cells and more keep KS ≤ 5e−3 (`microsurf stability`)."""


def share_left_out(gamma: float, sigma: float, cells: int) -> float:
    """Share of STD's microsurface area that is steeper than any facet of a mesh, at least.

    The steepest of its 2 cells² facets stands for the quantile 1 − 1/(4 cells²).
    """
    steepest = float(student_t.slope_quantile(1 - 0.25 / cells**2, gamma, sigma))
    return student_t.area_beyond(steepest, gamma, sigma)


def tail_left_out(scene: Scene) -> str | None:
    """Say what the mesh of a scene can't hold, or None within the border.

    Only a generated mesh has this border: a file is as it is, and σ = 0 is flat.
    """
    gamma, sigma = scene.roughness.gamma, max(scene.roughness.sigma)
    if scene.surface.file is not None or sigma == 0 or gamma >= LEAST_GAMMA:
        return None
    cells = scene.surface.cells
    share = share_left_out(gamma, sigma, cells)
    return (
        f"gamma = {gamma:g}: at least {share:.0%} of the surface's area is steeper than a mesh "
        f"of {cells}² cells can hold"
    )
