"""Any function integrated over the detector's bins, by adaptive product rules.

Nothing is known of the function but that spikes lie about the mirror direction: there
the bins are cut into rectangles in (θ_o, Δ), Δ = φ_o − φ_i, ever smaller towards it, so
that a spike wider than some 1e−4 radians is seen. Bins are also cut where lobes have
kinks: at θ_o = θ_i and in the plane of incidence. Two Gauss–Legendre rules then tell
which rectangles to cut further. A spike elsewhere, narrower than a node's distance
(a fifth of a bin), may be missed, as by any sum over values.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...results import detector
from ..directions import direction
from ..single_scattering.body_quadrature import gauss

Array = NDArray[np.float64]

_NODES = 6
_CHECK = 4  # nodes of the second rule
_TOLERANCE = 1e-4  # accepted difference of the rules in a rectangle, over the bin's energy
_FLOOR = 1e-7  # the same over the whole energy
_DEPTH = 12
_MOST = 4_000_000  # evaluations, after which the error is stated as it is
_CHUNK = 1000  # rectangles evaluated at a time
_FINEST = 2e-5  # radians: rectangles at the mirror direction
_GRADED = 0.5  # size of a rectangle over its distance to the mirror direction


def integrate(
    function: Callable[[Array], Array], theta_i: float, phi_i: float
) -> tuple[Array, Array]:
    """Energy ∫ f cosθ_o dω in each bin, of each part of a function, and its relative error.

    Parameters
    ----------
    function : callable
        Values of shape (parts, n) in sr⁻¹ at unit directions o of shape (n, 3).
    theta_i, phi_i : float
        Incidence in radians, θ_i in [0, π/2).

    Returns
    -------
    energy : array, shape (parts, rings, sectors)
    error : array, shape (parts,)
        Sum of the differences between the two rules over the sum of the bins: above the
        error of the finer, which is the one returned.

    """
    cells = _graded(theta_i, _bins(theta_i))
    evaluations = 0
    energy = error = np.zeros(0)
    for depth in range(_DEPTH):
        bins = _bin_of(cells)
        fine = _integrals(function, phi_i, cells, _NODES)
        off = np.abs(fine - _integrals(function, phi_i, cells, _CHECK))
        evaluations += len(cells) * (_NODES**2 + _CHECK**2)
        if depth == 0:
            energy = np.zeros((len(fine), detector.RINGS * detector.SECTORS))
            error = np.zeros(len(fine))
        sums = energy + _summed(fine, bins)
        allowed = _TOLERANCE * sums[:, bins] + _FLOOR * sums.sum(axis=1, keepdims=True)
        done = np.all(off <= allowed, axis=0)
        if depth == _DEPTH - 1 or evaluations > _MOST:
            done[:] = True
        energy += _summed(fine[:, done], bins[done])
        error += off[:, done].sum(axis=1)
        if done.all():
            break
        cells = _halves(_halves(cells[~done], 0), 2)
    total = energy.sum(axis=1)
    relative = np.divide(error, total, out=np.zeros_like(error), where=total > 0)
    return energy.reshape(-1, detector.RINGS, detector.SECTORS), relative


def _bins(theta_i: float) -> Array:
    """Rectangles [θ, θ end, Δ, Δ end] in radians, shape (n, 4)."""
    theta = np.unique(np.append(np.radians(detector.RING_EDGES), theta_i))
    delta = np.radians(np.unique([*detector.SECTOR_EDGES, 0.0, 180.0]))
    r, s = (g.ravel() for g in np.meshgrid(np.arange(len(theta) - 1), np.arange(len(delta) - 1)))
    return np.stack([theta[r], theta[r + 1], delta[s], delta[s + 1]], axis=1)


def _bin_of(cells: Array) -> NDArray[np.intp]:
    middle = np.degrees(cells[:, ::2] + cells[:, 1::2]) / 2
    ring = np.searchsorted(detector.RING_EDGES, middle[:, 0], side="right") - 1
    sector = np.searchsorted(detector.SECTOR_EDGES, middle[:, 1], side="right") - 1
    return np.asarray(ring * detector.SECTORS + sector)


def _halves(cells: Array, axis: int) -> Array:
    """Both halves of each, cut across θ (axis 0) or Δ (axis 2)."""
    middle = cells[:, axis : axis + 2].mean(axis=1)
    first, second = cells.copy(), cells.copy()
    first[:, axis + 1], second[:, axis] = middle, middle
    return np.concatenate([first, second])


def _graded(theta_i: float, cells: Array) -> Array:
    """Cut rectangles until each is small against its distance to the mirror direction."""
    mirror = direction(theta_i, np.pi)
    finished = []
    while len(cells):
        height = cells[:, 1] - cells[:, 0]
        width = (cells[:, 3] - cells[:, 2]) * np.sin(cells[:, 1])
        middle = direction(cells[:, :2].mean(axis=1), cells[:, 2:].mean(axis=1))
        # The chord, for arccos has no digits here; no point is nearer than half a diagonal less.
        away = np.linalg.norm(middle - mirror, axis=1) - np.hypot(height, width) / 2
        cut = np.maximum(height, width) > np.maximum(_FINEST, _GRADED * away)
        # Far from the spike a bin is small enough as it is.
        cut &= away < np.radians(20)
        finished.append(cells[~cut])
        tall = height >= width
        cells = np.concatenate([_halves(cells[cut & tall], 0), _halves(cells[cut & ~tall], 2)])
    return np.concatenate(finished)


def _summed(values: Array, bins: NDArray[np.intp]) -> Array:
    count = detector.RINGS * detector.SECTORS
    return np.stack([np.bincount(bins, row, minlength=count) for row in values])


def _integrals(function: Callable[[Array], Array], phi_i: float, cells: Array, nodes: int) -> Array:
    """∫ f cosθ_o dω of each rectangle by a product rule, shape (parts, rectangles)."""
    x, w = gauss(nodes)
    parts = []
    for start in range(0, len(cells), _CHUNK):
        theta, theta_end, delta, delta_end = cells[start : start + _CHUNK].T[..., None]
        half, width = (theta_end - theta) / 2, (delta_end - delta) / 2
        polar = (theta + half * (1 + x))[:, :, None]
        azimuth = phi_i + (delta + width * (1 + x))[:, None, :]
        o = direction(polar, azimuth)
        values = function(o.reshape(-1, 3)).reshape(-1, *o.shape[:-1])
        weight = (half * w)[:, :, None] * (width * w)[:, None, :] * np.cos(polar) * np.sin(polar)
        parts.append((values * weight).sum(axis=(-2, -1)))
    return np.concatenate(parts, axis=1)
