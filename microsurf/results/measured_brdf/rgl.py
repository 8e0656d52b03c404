"""RGL's ``.bsdf``: spectra at adaptive directions, read at these and not between them.

Dupuy and Jakob, "An Adaptive Parameterization for Efficient Material Acquisition and
Rendering", ACM TOG 37(6), 2018. For each incidence a grid over the unit square holds the
spectra; a warp by the visible normals (field ``vndf``, as a density on squares of
θ = π u²/2 and φ = (2v − 1) π) takes its points to normals m, and mirroring to o. With the
field ``jacobian`` set, values are f cosθ_o · 4σ(i)/D(m).
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from .rgl_tensor import read_tensors
from .scattered import MeasuredBrdf, check_size, of_rows, unit

Array = NDArray[np.float64]

NAME = "RGL .bsdf"
ENDINGS = (".bsdf",)

_FIELDS = ("theta_i", "phi_i", "ndf", "sigma", "vndf", "jacobian")


def read(path: Path) -> MeasuredBrdf:
    """Read a file.

    Raises
    ------
    InputError
        If it is truncated, or a field is missing or of another shape.

    """
    tensors = read_tensors(path)
    spectral = "spectra" in tensors
    needed = (*_FIELDS, *(("spectra", "wavelengths") if spectral else ("rgb",)))
    if missing := [name for name in needed if name not in tensors]:
        raise InputError(f"no field {', '.join(missing)}: not a BRDF of RGL's database")
    theta, phi = (tensors[name].astype(float) for name in ("theta_i", "phi_i"))
    values = tensors["spectra" if spectral else "rgb"]
    wavelengths = tensors["wavelengths"].astype(float) if spectral else np.empty(0)
    _check(tensors, values, wavelengths if spectral else np.empty(3))
    isotropic = phi.size <= 2
    azimuths = phi[:1] if isotropic else phi
    rows = values.shape[3] * values.shape[4]
    check_size(len(azimuths) * theta.size * rows, values.shape[2])
    parts = []
    for a, azimuth in enumerate(azimuths):
        for t, polar in enumerate(theta):
            parts.append(
                _incidence(tensors, values[a, t], a, t, (polar, azimuth), isotropic=isotropic)
            )
    angles = np.concatenate([part[0] for part in parts])
    samples = np.concatenate([part[1] for part in parts])
    return of_rows(angles, samples, ("R", "G", "B"), tuple(wavelengths))


def _check(tensors: dict[str, NDArray[Any]], values: NDArray[Any], channels: Array) -> None:
    shape = (tensors["phi_i"].size, tensors["theta_i"].size)
    right = (
        tensors["phi_i"].ndim == tensors["theta_i"].ndim == 1
        and min(shape) > 0
        and values.ndim == 5
        and values.shape[:3] == (*shape, channels.size)
        and tensors["vndf"].ndim == 4
        and tensors["vndf"].shape[:2] == shape
        and tensors["ndf"].ndim == tensors["sigma"].ndim == 2
        and min(*values.shape[3:], *tensors["vndf"].shape[2:], *tensors["ndf"].shape) > 1
        and min(tensors["sigma"].shape) > 1
        and tensors["jacobian"].size == 1
    )
    if not right:
        raise InputError("its fields do not have the shapes of RGL's database; damaged")


def _incidence(
    tensors: dict[str, NDArray[Any]],
    values: NDArray[Any],
    a: int,
    t: int,
    light: tuple[float, float],
    *,
    isotropic: bool,
) -> tuple[Array, Array]:
    """Angles, shape (points, 4), and values, shape (points, channels), of one incidence."""
    height, width = values.shape[1:]
    v, u = np.meshgrid(np.linspace(0, 1, height), np.linspace(0, 1, width), indexing="ij")
    # φ_m = ±π is one direction, and u = 0 is m = n whatever φ_m: each is read once.
    once = ((v < 1) & ((u > 0) | (v == 0))).ravel()
    warp = tensors["vndf"][a, t].astype(float)
    at = sample_bilinear(warp, u.ravel()[once], v.ravel()[once])
    polar, azimuth = light
    i = unit(np.array(polar), np.array(azimuth))
    phi_m = (2 * at[1] - 1) * np.pi + (azimuth if isotropic else 0.0)
    m = unit(at[0] ** 2 * np.pi / 2, phi_m)
    o = 2 * (m @ i)[:, None] * m - i
    spectra = values.reshape(values.shape[0], -1).T[once].astype(float)
    if tensors["jacobian"].ravel()[0]:
        of_light = np.sqrt(polar * 2 / np.pi), (azimuth + np.pi) / (2 * np.pi)
        sigma = interpolate(tensors["sigma"].astype(float), *map(np.atleast_1d, of_light))
        spectra = spectra * interpolate(tensors["ndf"].astype(float), *at)[:, None] / (4 * sigma)
    theta_o = np.arctan2(np.hypot(o[:, 0], o[:, 1]), o[:, 2])
    up = o[:, 2] > 0
    f = np.full_like(spectra, np.nan)
    f[up] = spectra[up] / o[up, 2:]
    same = np.full(len(o), polar), np.full(len(o), azimuth)
    return np.stack([*same, theta_o, np.arctan2(o[:, 1], o[:, 0])], axis=1), f


def interpolate(table: Array, u: Array, v: Array) -> Array:
    """Bilinear interpolation at u along columns and v along rows, both in [0, 1]."""
    rows, columns = table.shape
    x, y = np.clip(u, 0, 1) * (columns - 1), np.clip(v, 0, 1) * (rows - 1)
    k, j = np.minimum(x.astype(int), columns - 2), np.minimum(y.astype(int), rows - 2)
    s, t = x - k, y - j
    low = (1 - s) * table[j, k] + s * table[j, k + 1]
    high = (1 - s) * table[j + 1, k] + s * table[j + 1, k + 1]
    return np.asarray((1 - t) * low + t * high)


def sample_bilinear(density: Array, u: Array, v: Array) -> tuple[Array, Array]:
    """Take uniform (u, v) to points (x, y) in [0, 1]² of a density, bilinear between its values.

    First y by the marginal of the rows, by v; then x along the row, by u. Each inverts a
    piecewise parabola.
    """
    rows, columns = density.shape
    along = np.concatenate(
        [np.zeros((rows, 1)), np.cumsum((density[:, 1:] + density[:, :-1]) / 2, axis=1)], axis=1
    )
    of_row = along[:, -1]
    total = np.concatenate([[0.0], np.cumsum((of_row[1:] + of_row[:-1]) / 2)])
    target = v * total[-1]
    j = np.clip(np.searchsorted(total, target, side="right") - 1, 0, rows - 2)
    t = _invert(target - total[j], of_row[j], of_row[j + 1])
    mixed = (1 - t)[:, None] * along[j] + t[:, None] * along[j + 1]
    target = u * mixed[:, -1]
    k = np.clip(np.sum(mixed <= target[:, None], axis=1) - 1, 0, columns - 2)
    each = np.arange(len(u))
    low = (1 - t) * density[j, k] + t * density[j + 1, k]
    high = (1 - t) * density[j, k + 1] + t * density[j + 1, k + 1]
    s = _invert(target - mixed[each, k], low, high)
    return (k + s) / (columns - 1), (j + t) / (rows - 1)


def _invert(area: Array, low: Array, high: Array) -> Array:
    """Return s in [0, 1] with ∫_0^s low + (high − low) x dx = area, without cancellation."""
    root = np.sqrt(np.maximum(low**2 + 2 * area * (high - low), 0))
    return np.clip(2 * area / np.maximum(low + root, 1e-300), 0, 1)
