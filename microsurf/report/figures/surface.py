"""The surface itself: a profile, and its facet slopes against STD, out to what a mesh can hold."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...physics import student_t
from ...scene import Scene
from ...surface import Heightfield, facet_slopes
from .style import (
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    SMALL,
    clean,
    new_figure,
    nothing,
    own_style,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_COLUMNS = 256
_POINTS = 300


def rows(heightfield: Heightfield, scene: Scene) -> list[dict[str, Any]]:
    """Curves "profile" (x, height), "facets" and "STD" (|slope|/σ, share of facets steeper).

    The profile is that of the row of median relief. At the steepest facet "facets" ends.
    """
    heights = heightfield.heights
    relief = np.ptp(heights, axis=1)
    row = heights[np.argsort(relief)[len(relief) // 2]][:_COLUMNS]
    x = np.arange(len(row)) * heightfield.pixel[0]

    p, q = facet_slopes(heightfield)
    rough = scene.roughness
    rho = np.sort(np.hypot(p.ravel() / rough.sigma_x, q.ravel() / rough.sigma_y))
    share = 1 - (np.arange(rho.size) + 0.5) / rho.size
    keep = np.unique(np.geomspace(1, rho.size, _POINTS).astype(int)) - 1
    keep = np.unique(np.concatenate([keep, rho.size - 1 - keep]))
    keep = keep[rho[keep] > 0]
    grid = np.geomspace(1e-2, max(rho[-1] * 3, 10), _POINTS)
    steeper = np.exp(_log_tail(grid, rough.gamma))
    return [
        *_curve("profile", x, row - row.mean()),
        *_curve("facets", rho[keep], share[keep]),
        *_curve("STD", grid, steeper),
    ]


def _curve(name: str, x: np.ndarray, y: np.ndarray) -> list[dict[str, Any]]:
    return [{"curve": name, "x": float(a), "y": float(b)} for a, b in zip(x, y, strict=True)]


def _log_tail(rho: np.ndarray, gamma: float) -> np.ndarray:
    """ln of 1 − slope_cdf, without the rounding of that difference."""
    return student_t.log_kernel(rho**2, gamma) * (1 if np.isinf(gamma) else 1 - 1 / gamma)


@own_style()
def figure(drawn: Sequence[dict[str, Any]], gamma: float, unit: str) -> "Figure":
    """Draw `rows`; ``unit`` is that of lengths."""
    curves = {
        name: np.array([[row["x"], row["y"]] for row in drawn if row["curve"] == name]).T
        for name in ("profile", "facets", "STD")
    }
    if not drawn:
        return nothing("no surface was made")
    canvas = new_figure(2.8)
    left, right = canvas.subplots(1, 2, width_ratios=(1.4, 1))
    left.plot(*curves["profile"], color=BLACK, linewidth=0.9)
    left.set(xlabel=f"x ({unit})", ylabel=f"height ({unit})")
    left.set_title("profile: the row of median relief", fontsize=9)
    clean(left)
    right.plot(*curves["STD"], color=ORANGE, linewidth=3, label=f"STD, γ = {gamma:.3g}")
    if curves["facets"].size:
        steepest, least = curves["facets"][:, -1]
        right.plot(*curves["facets"], color=BLUE, linestyle="--", linewidth=1.3, label="facets")
        right.axvline(steepest, color=GREY, linestyle=":", linewidth=1.2, label="steepest facet")
    else:
        least = curves["STD"][1, -1]
        right.plot([], [], linestyle="none", label="facets: all are flat")
    right.set(
        xscale="log", yscale="log", ylim=(least / 5, 2), xlim=(1e-2, curves["STD"][0, -1]),
        xlabel="|slope| / σ", ylabel="share of facets steeper",
    )  # fmt: skip
    right.set_title("slopes against STD", fontsize=9)
    right.legend(fontsize=SMALL, loc="lower left", framealpha=0.9)
    clean(right)
    return canvas
