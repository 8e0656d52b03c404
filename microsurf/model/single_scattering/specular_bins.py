"""The specular lobe integrated over the detector's bins.

The lobe is known in closed form but may be far narrower than a bin. Each bin is
cut into rectangles in (θ_o, Δ), Δ = φ_o − φ_i, until each is short against the
scale of the lobe: in slopes of the half vector scaled by the roughness, a part of
max(core, distance to the mirror direction); and in the angle atan(√2 cotθ_o/σ) on
which masking depends. Two Gauss–Legendre rules then tell which to cut further.

G of V-cavities has kinks where its minimum switches: at θ_o = θ_i, where
rectangles end, and where 2 h_z z = i·h with z the smaller of i_z and o_z. By
4 (i_z + o_z) z = |i + o|² = 2 (1 + i·o) that is at known Δ for each θ_o, where
the rule in Δ is broken.
"""

from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from ...results import detector
from ..directions import direction
from . import brdf
from .body_quadrature import gauss
from .facets import Facets

Array = NDArray[np.float64]

_LENGTH = 1.0  # of a rectangle in units of the lobe's scale
_ANGLE = 0.4  # of a rectangle in the angle of masking, radians
_NODES = 8
_CHECK = 5  # nodes of the second rule
_TOLERANCE = 1e-7  # accepted difference of the rules in a rectangle, over the bin's energy
_FLOOR = 1e-13  # the same over the whole energy: bins far from the lobe hold nothing
_DEPTH = 40  # halvings: 2^−40 of a bin is at the limit of its coordinates
_CHUNK = 2000  # rectangles evaluated at a time


class _Rectangles(NamedTuple):
    """θ_o and Δ in radians and the bin, shape (rectangles,)."""

    theta: Array
    theta_end: Array
    delta: Array
    delta_end: Array
    bin: NDArray[np.intp]

    def take(self, chosen: NDArray[np.bool_] | slice) -> Self:
        """Return the chosen rectangles."""
        return type(self)(
            self.theta[chosen],
            self.theta_end[chosen],
            self.delta[chosen],
            self.delta_end[chosen],
            self.bin[chosen],
        )

    def halves(self, across: str) -> Self:
        """Return both halves of each, cut across "theta" or "delta"."""
        middle = (getattr(self, across) + getattr(self, across + "_end")) / 2
        first, second = (
            self._replace(**{across + "_end": middle}),
            self._replace(**{across: middle}),
        )
        return type(self)(*(np.concatenate(pair) for pair in zip(first, second, strict=True)))


def specular_bins(facets: Facets, theta_i: float, phi_i: float) -> tuple[Array, float]:
    """Energy ∫ f_s cosθ_o dω in each bin, and the relative error of their sum.

    Parameters
    ----------
    facets : Facets
        The rough interface.
    theta_i, phi_i : float
        Incidence in radians, θ_i in [0, π/2).

    Returns
    -------
    energy : array, shape (rings, sectors)
    error : float
        Sum of the differences between the two rules over the sum of the bins.

    """
    waiting = _graded(facets, theta_i, phi_i, _bins(facets, theta_i))
    energy = np.zeros(detector.RINGS * detector.SECTORS)
    error = 0.0
    for depth in range(_DEPTH):
        fine = _integrals(facets, theta_i, phi_i, waiting, _NODES)
        off = np.abs(fine - _integrals(facets, theta_i, phi_i, waiting, _CHECK))
        sums = energy + np.bincount(waiting.bin, fine, minlength=len(energy))
        allowed = _TOLERANCE * sums[waiting.bin] + _FLOOR * sums.sum()
        done = (off <= allowed) | (depth == _DEPTH - 1)
        energy += np.bincount(waiting.bin[done], fine[done], minlength=len(energy))
        error += float(off[done].sum())
        if done.all():
            break
        waiting = waiting.take(~done).halves("theta").halves("delta")
    bins = energy.reshape(detector.RINGS, detector.SECTORS)
    if facets.isotropic:
        bins = bins + bins[:, -np.arange(detector.SECTORS) % detector.SECTORS]
    total = float(energy.sum())
    return bins, error / total if total > 0 else 0.0


def _bins(facets: Facets, theta_i: float) -> _Rectangles:
    """The bins, cut at θ_o = θ_i and at Δ = 0 and π; half of them if the lobe is symmetric."""
    theta = np.unique(np.append(np.radians(detector.RING_EDGES), theta_i))
    ring = np.searchsorted(np.radians(detector.RING_EDGES), theta[:-1], side="right") - 1
    half = np.radians(np.clip(detector.SECTOR_EDGES[: detector.SECTORS // 2 + 2], 0, 180))
    delta, end, sector = half[:-1], half[1:], np.arange(detector.SECTORS // 2 + 1)
    if not facets.isotropic:
        mirrored = -sector % detector.SECTORS
        delta, end = np.append(delta, -end), np.append(end, -delta)
        sector = np.append(sector, mirrored)
    r, s = (grid.ravel() for grid in np.meshgrid(np.arange(len(ring)), np.arange(len(sector))))
    return _Rectangles(
        theta[r], theta[r + 1], delta[s], end[s], ring[r] * detector.SECTORS + sector[s]
    )


def _graded(facets: Facets, theta_i: float, phi_i: float, cells: _Rectangles) -> _Rectangles:
    """Cut rectangles until each is short against the scale of the lobe."""
    i = direction(theta_i, phi_i)
    core = min(1.0, np.sqrt(facets.gamma - 1))
    finished = []
    for _ in range(_DEPTH):
        theta = np.stack([cells.theta, cells.theta_end])[:, None]
        delta = np.stack([cells.delta, cells.delta_end])
        o = direction(theta, phi_i + delta)
        slope = (i + o)[..., :2] / (i + o)[..., 2:] / [facets.sigma_x, facets.sigma_y]
        scale = _LENGTH * np.maximum(core, np.hypot(*np.moveaxis(slope, -1, 0)).min(axis=(0, 1)))
        rough = np.hypot(facets.sigma_x * o[..., 0], facets.sigma_y * o[..., 1])
        masked = np.arctan2(np.sqrt(2) * o[..., 2], rough)
        too_long = []
        for axis in (0, 1):
            step = np.hypot(*np.moveaxis(np.diff(slope, axis=axis), -1, 0)).max(axis=(0, 1))
            turn = np.abs(np.diff(masked, axis=axis)).max(axis=(0, 1))
            too_long.append(np.maximum(step / scale, turn / _ANGLE))
        across_theta, across_delta = too_long
        cut = np.maximum(across_theta, across_delta) > 1
        finished.append(cells.take(~cut))
        cut_theta = cut & (across_theta >= across_delta)
        parts = cells.take(cut_theta).halves("theta"), cells.take(cut & ~cut_theta).halves("delta")
        cells = _joined(parts)
        if not len(cells.bin):
            break
    return _joined([*finished, cells])


def _joined(parts: "list[_Rectangles] | tuple[_Rectangles, ...]") -> _Rectangles:
    return _Rectangles(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def _integrals(
    facets: Facets, theta_i: float, phi_i: float, cells: _Rectangles, nodes: int
) -> Array:
    """∫ f_s cosθ_o dω of each rectangle by a product rule."""
    parts = [
        _product_rule(facets, theta_i, phi_i, cells.take(slice(k, k + _CHUNK)), nodes)
        for k in range(0, len(cells.bin), _CHUNK)
    ]
    return np.concatenate(parts) if parts else np.zeros(0)


def _product_rule(
    facets: Facets, theta_i: float, phi_i: float, cells: _Rectangles, nodes: int
) -> Array:
    x, w = gauss(nodes)
    half = (cells.theta_end - cells.theta)[:, None] / 2
    theta = cells.theta[:, None] + half * (1 + x)
    start, end = (np.broadcast_to(d[:, None], theta.shape) for d in (cells.delta, cells.delta_end))
    if facets.masking.vcavity:
        kink = np.clip(np.copysign(_kink(theta_i, theta), start + end), start, end)
        ends = np.stack([start, kink, end], axis=-1)
    else:
        ends = np.stack([start, end], axis=-1)
    width = np.diff(ends, axis=-1)[..., None] / 2
    delta = ends[..., :-1, None] + width * (1 + x)
    o = direction(theta[..., None, None], phi_i + delta)
    f = brdf.specular(facets, direction(theta_i, phi_i), o)
    rows = np.sum(f * width * w, axis=(-2, -1)) * np.cos(theta) * np.sin(theta)
    return np.asarray((rows * half) @ w)


def _kink(theta_i: float, theta: Array) -> Array:
    """|Δ| at which 2 h_z min(i_z, o_z) = i·h; 0 or π where it never is."""
    i_z, o_z = np.cos(theta_i), np.cos(theta)
    across = 2 * np.minimum(i_z, o_z) ** 2 + i_z * o_z - 1
    sines = np.maximum(np.sin(theta_i) * np.sin(theta), np.finfo(float).tiny)
    with np.errstate(over="ignore"):
        cosine = across / sines
    return np.asarray(np.arccos(np.clip(cosine, -1, 1)))
