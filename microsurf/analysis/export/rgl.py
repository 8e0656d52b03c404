"""RGL's ``.bsdf`` of any BRDF: Mitsuba loads it as ``measured``, pbrt-v4 too if it is spectral.

The format is described in `results.measured_brdf.rgl`. Values are kept at points that follow
the normals seen from the light, and between them a renderer interpolates f cosθ_o · 4σ/D. D
is a parametrisation only, and need not be that of the material: to it FLOOR is added, or
where D is nearly 0 the body light over it is as steep as D is.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...model import direction
from ...physics import student_t
from ...results.measured_brdf.rgl import interpolate, sample_bilinear
from ...results.measured_brdf.rgl_tensor import write_tensors
from .source import Source

Array = NDArray[np.float64]

FLOOR = 0.3
"""sr⁻¹ added to D at all normals."""
_DARKEST = 1e-3
"""Part of the mean that the density which a renderer samples has at least."""
_MOST_THETA = np.radians(89.5)


@dataclass(frozen=True)
class _Sizes:
    """Nodes in φ_i, θ_i, along θ_m and φ_m of the warp, and of the values in both."""

    azimuths: int
    polar: int
    warp: tuple[int, int]
    values: int


_ISOTROPIC = _Sizes(1, 36, (64, 128), 80)
_NARROW = _Sizes(1, 72, (64, 128), 128)
_NARROWEST = 0.15
"""σ below which a lobe takes the finer grid: with the other γ = 40, σ = 0.1 is 1.2 % off."""
_ANISOTROPIC = _Sizes(17, 28, (96, 96), 64)
_FINE = 512  # nodes of D and σ along θ
_FINE_AZIMUTHS = 256


def write(source: Source, path: Path) -> None:
    """Write the file; it takes 5 MB if isotropic, 21 MB if its σ is below 0.15, 50 MB if not.

    Raises
    ------
    InputError
        If σ is 0 or its channels are none that the format has.

    """
    write_tensors(path, tensors(source))


def tensors(source: Source) -> dict[str, NDArray[np.float32] | NDArray[np.uint8]]:
    """Fields of the file by name."""
    rough = source.scene.roughness
    if rough.sigma_x == 0:
        raise InputError(f"{source.name}: roughness.sigma = 0: .bsdf needs σ > 0; write .csv")
    sizes = _ISOTROPIC if rough.isotropic else _ANISOTROPIC
    if rough.isotropic and rough.sigma_x < _NARROWEST:
        sizes = _NARROW
    # A quarter of the azimuths stands for all, as a renderer knows by their range.
    phi = np.zeros(1) if rough.isotropic else np.linspace(-np.pi, -np.pi / 2, sizes.azimuths)
    theta = _MOST_THETA * (1 - (1 - np.linspace(0, 1, sizes.polar)) ** 1.5)
    if source.traced is not None:
        theta = _moved(theta, np.radians(source.traced.theta_i))
        if not rough.isotropic:
            phi = _moved(phi, np.radians(source.traced.phi_i) - np.pi)
    slopes = (rough.gamma, rough.sigma_x, rough.sigma_y)
    v, u = np.meshgrid(
        np.linspace(0, 1, 2 if rough.isotropic else _FINE_AZIMUTHS + 1),
        np.linspace(0, 1, _FINE),
        indexing="ij",
    )
    ndf = _distribution(_normals(u, v), slopes)
    area = np.empty((len(phi), len(theta)))
    vndf = np.empty((len(phi), len(theta), *sizes.warp))
    function = source.evaluate if source.wavelengths else source.in_colour
    channels = len(source.wavelengths) or 3
    side = sizes.values
    values = np.zeros((len(phi), len(theta), channels, side, side))
    for a, azimuth in enumerate(phi):
        for t, polar in enumerate(theta):
            i = direction(polar, azimuth)
            vndf[a, t], area[a, t] = _visible(i, slopes, sizes.warp, isotropic=rough.isotropic)
    sigma = _area_table(theta, phi, area)
    for a, azimuth in enumerate(phi):
        for t, polar in enumerate(theta):
            light = (polar, azimuth)
            values[a, t] = _values(function, light, vndf[a, t], ndf, sigma, rough.isotropic, side)
    luminance = values.mean(axis=2)
    luminance += _DARKEST * luminance.mean(axis=(2, 3), keepdims=True)
    fields = {
        "phi_i": phi, "theta_i": theta, "ndf": ndf, "sigma": sigma, "vndf": vndf,
        "luminance": luminance, ("spectra" if source.wavelengths else "rgb"): values,
    }  # fmt: skip
    if source.wavelengths:
        fields["wavelengths"] = np.array(source.wavelengths)
    text = f"{source.name}, written by microsurf".encode()
    return {
        "description": np.frombuffer(text, np.uint8),
        "jacobian": np.ones(1, np.uint8),
        **{name: array.astype(np.float32) for name, array in fields.items()},
    }


def _normals(u: Array, v: Array) -> Array:
    return direction(u**2 * np.pi / 2, (2 * v - 1) * np.pi)


def _distribution(m: Array, slopes: tuple[float, float, float]) -> Array:
    """D, but no more than that of the mean normal: for γ < 2 it is infinite at the horizon."""
    top = student_t.distribution(np.array([0.0, 0.0, 1.0]), *slopes)
    return np.asarray(np.minimum(student_t.distribution(m, *slopes), top) + FLOOR)


def _visible(
    i: Array, slopes: tuple[float, float, float], shape: tuple[int, int], *, isotropic: bool
) -> tuple[Array, float]:
    """Density of visible normals on the unit square, and their projected area.

    Where it is 0 a renderer's warp has no inverse: a little is left there.
    """
    v, u = np.meshgrid(np.linspace(0, 1, shape[0]), np.linspace(0, 1, shape[1]), indexing="ij")
    m = _normals(u, v)
    incident = direction(np.arctan2(np.hypot(i[0], i[1]), i[2]), 0.0) if isotropic else i
    facing = np.maximum(m @ incident, 0)
    density = 2 * np.pi**2 * u * np.sin(u**2 * np.pi / 2) * facing * _distribution(m, slopes)
    along = np.trapezoid(density, dx=1 / (shape[1] - 1), axis=1)
    area = float(np.trapezoid(along, dx=1 / (shape[0] - 1)))
    return density + 1e-4 * density.mean(), area


def _area_table(theta: Array, phi: Array, area: Array) -> Array:
    """σ on the renderer's grid of u = √(2θ/π) and v = φ/2π + ½, by interpolation."""
    at = (np.linspace(0, 1, _FINE) ** 2) * np.pi / 2
    rows = np.stack([np.interp(at, theta, row) for row in area])
    if len(phi) == 1:
        return np.repeat(rows, 2, axis=0)
    azimuth = np.abs(np.linspace(-np.pi, np.pi, _FINE_AZIMUTHS + 1))
    quarter = -np.pi + np.minimum(np.pi - azimuth, azimuth)  # the same in both mirrors
    return np.stack([np.interp(quarter, phi, column) for column in rows.T], axis=1)


def _values(
    function: Callable[[Array, Array], Array],
    light: tuple[float, float],
    vndf: Array,
    ndf: Array,
    sigma: Array,
    isotropic: bool,
    side: int,
) -> Array:
    """f cosθ_o · 4σ/D at the points of one incidence, shape (channels, side, side).

    Scaled so that a renderer, which interpolates between them, reads the function's albedo: the
    error of the interpolation is looked at in the middle of each cell.
    """
    polar, azimuth = light
    i = direction(polar, 0.0 if isotropic else azimuth)
    position = np.sqrt(polar * 2 / np.pi), (azimuth + np.pi) / (2 * np.pi)
    area = interpolate(sigma, *map(np.atleast_1d, position))
    density = vndf.astype(np.float32).astype(float)

    def at_points(line: Array) -> tuple[Array, Array, Array, Array]:
        """Points of the square, values there, what they stand for, and its part of the light."""
        v, u = (w.ravel() for w in np.meshgrid(line, line, indexing="ij"))
        at = sample_bilinear(density, u, v)
        m = _normals(at[0], at[1])
        facing = m @ i
        o = 2 * facing[:, None] * m - i
        up = o[:, 2] > 0
        towards = o[up] / np.linalg.norm(o[up], axis=1, keepdims=True)
        f = function(np.broadcast_to(i, towards.shape), towards) * towards[:, 2:]
        samples = np.zeros((len(u), f.shape[1]))
        samples[up] = f
        per_value = interpolate(ndf, *at) / (4 * area)
        # dω_o/dω_m = 4 i·m, and ω_m on the unit square over the density of the points there.
        weight = up * facing * at[0] * np.sin(at[0] ** 2 * np.pi / 2) / interpolate(density, *at)
        return np.stack([u, v]), samples / per_value[:, None], per_value, weight

    values = at_points(np.linspace(0, 1, side))[1].T.reshape(-1, side, side)
    points, wanted, per_value, weight = at_points((np.arange(side - 1) + 0.5) / (side - 1))
    light_of_point = weight * per_value
    for channel in range(len(values)):
        there = light_of_point @ interpolate(values[channel], *points)
        if there > 0:
            error = light_of_point @ wanted[:, channel] / there - 1
            # Over a cell the mean of x(1 − x) + y(1 − y) is 2/3 of what it is in the middle.
            values[channel] *= 1 + 2 / 3 * error
    return values


def _moved(nodes: Array, onto: Array) -> Array:
    """Nodes with the nearest to each of some values moved onto it, inside their range."""
    moved = nodes.copy()
    for value in onto[(onto > nodes[0]) & (onto < nodes[-1])]:
        moved[np.abs(nodes - value).argmin()] = value
    return moved
