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
    rough, cells = scene.roughness, scene.surface.cells
    if scene.surface.file is None:
        said = _said("gamma", rough.gamma, max(rough.sigma), cells)
        if said is not None:
            return said
    under = None if scene.layers is None else scene.layers.substrate
    if under is None or under.gamma is None or under.sigma is None:
        return None
    return _said("layers.substrate.gamma", under.gamma, max(under.sigma), cells)


def _said(name: str, gamma: float, sigma: float, cells: int) -> str | None:
    if sigma == 0 or gamma >= LEAST_GAMMA:
        return None
    share = share_left_out(gamma, sigma, cells)
    return (
        f"{name} = {gamma:g}: at least {share:.0%} of the surface's area is steeper than a mesh "
        f"of {cells}² cells can hold"
    )
