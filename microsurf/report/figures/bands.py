"""Cuts of lobes in the plane of incidence, and the half widths of their 95 % bands.

Several surfaces: Student's t over them. One surface: over its rays. Bins of order 1 have
the variance that was summed over their paths (``bin_variance``). Higher orders have
none: there a light ray brings a bin between 0 and 1, so the variance of their mean is
at most that mean over the number of light rays (Poisson's). The error of all orders
together is at most the sum of these errors, and that is what is drawn. Rays are taken as
independent: stratified they spread less.
"""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...results import datasets, detector
from ...scene import Scene
from ...stats import intervals

Array = NDArray[np.float64]


def cut(dataset: xr.Dataset, scene: Scene, kd: float) -> xr.DataArray:
    """BRDF at one incidence in its plane, θ_o signed; where every plane is one, their mean."""
    density = datasets.brdf(datasets.by_kind(dataset.flux, scene.material.n, kd))
    if _no_plane(dataset, scene):
        density = density * 0 + density.mean("phi_o")
    return datasets.in_plane(density)


def _no_plane(dataset: xr.Dataset, scene: Scene) -> bool:
    """Whether incidence is normal on an isotropic surface."""
    return float(dataset.theta_i) == 0 and scene.roughness.isotropic


def half_widths(
    curves: Mapping[str, xr.DataArray], measured: xr.Dataset, scene: Scene, kd: float
) -> dict[str, Array]:
    """Of the bands of `cut` curves, keys "specular" and "body" (order 1) and "total"."""
    count = measured.sizes["realisation"]
    if count > 1:
        factor = intervals.student(count - 1) / np.sqrt(count)
        return {k: factor * c.std("realisation", ddof=1).values for k, c in curves.items()}
    return {
        key: intervals.normal() * error for key, error in ray_errors(measured, scene, kd).items()
    }


def ray_errors(measured: xr.Dataset, scene: Scene, kd: float) -> dict[str, Array]:
    """Standard errors of the `cut` curves of one surface, from its rays."""
    n = scene.material.n
    first = {
        kind: measured.microsurf.lobe_ray_variance(kind, kd=kd).isel(realisation=0)
        for kind in detector.KINDS
    }
    higher = datasets.by_kind(measured.flux.isel(realisation=0, order=slice(1, None)), n, kd)
    bound = higher.sum(("order", "kind")) / measured.light_rays.isel(realisation=0)
    errors = {
        key: np.sqrt(_cut_variance(variance, measured, scene).values)
        for key, variance in (first | {"higher": bound}).items()
    }
    return errors | {"total": sum(errors.values(), np.zeros(1))}


def _cut_variance(energy: xr.DataArray, measured: xr.Dataset, scene: Scene) -> xr.DataArray:
    """Variance of a `cut` from that of the energy in its bins."""
    density = datasets.brdf(datasets.brdf(xr.DataArray(energy)))
    # Folded lobes hold every bin twice, φ and −φ: a mean over sectors has half of them.
    mirrored = energy.values[..., [0, *range(detector.SECTORS - 1, 0, -1)]]
    twice = 1 + bool(np.allclose(energy.values, mirrored, rtol=1e-9, atol=0))
    of_mean = density.mean("phi_o") * twice / detector.SECTORS
    averaged = (density.theta_o == 0) | _no_plane(measured, scene)
    # `in_plane` averages the cap's sectors: they now all hold the variance of that mean.
    return datasets.in_plane(density.where(~averaged, of_mean))
