"""How well a measurement is known: errors of its rays, of its surfaces, and what to buy next.

The error of a mean over realisations has two parts, told apart as in a one-way analysis
of variance: rays on one surface (*within*) and differences of surfaces (*between*).
Errors of rays come from batches that know nothing of each other.
"""

import numpy as np
import xarray as xr
from scipy import stats

from . import result, summary
from .scene import Scene

_NORMAL = float(stats.norm.ppf(0.975))


def lobe_ray_variance(dataset: xr.Dataset, kind: str, n: float, kd: float) -> xr.DataArray:
    """Variance of an order-1 lobe's bins in each realisation from its rays alone."""
    weight = 1.0 if kind == "specular" else float(result.body_weights(2, n, kd)[1])
    return xr.DataArray(dataset.bin_variance.sel(kind=kind, drop=True) * weight**2)


def lobe(dataset: xr.Dataset, kind: str, n: float, kd: float) -> xr.DataArray:
    """Energy in the bins of an order-1 lobe, by realisation and angle."""
    return result.by_kind(dataset.flux.sel(order=1, drop=True), n, kd).sel(kind=kind, drop=True)


def _relative(variance: xr.DataArray, values: xr.DataArray) -> xr.DataArray:
    """Error of a lobe relative to itself: root of the sums of squares over its bins."""
    bins = ("theta_o", "phi_o")
    return xr.DataArray(np.sqrt(variance.sum(bins) / (values**2).sum(bins))).fillna(0.0)


def lobe_error(dataset: xr.Dataset, kind: str, n: float, kd: float) -> xr.DataArray:
    """Relative error of an order-1 lobe's mean over realisations, of its rays if there is one."""
    values = lobe(dataset, kind, n, kd)
    count = dataset.sizes["realisation"]
    if count == 1:
        variance = lobe_ray_variance(dataset, kind, n, kd).isel(realisation=0, drop=True)
    else:
        variance = values.var("realisation", ddof=1) / count
    return _relative(variance, values.mean("realisation"))


def surplus(dataset: xr.Dataset, scene: Scene) -> float:
    """Greatest error over what the scene asks for; ≤ 1 is enough.

    Few surfaces know their own spread badly: their error is widened so that twice it
    covers what Student's t says.
    """
    asked = scene.accuracy.standard_error or np.inf
    asked_of_lobes = scene.accuracy.lobe_error or asked
    count = dataset.sizes["realisation"]
    widened = 1.0 if count == 1 else float(stats.t.ppf(0.975, count - 1)) / _NORMAL
    n = scene.material.n
    worst = 0.0
    for kd in scene.material.kd:
        albedo = float(summary.standard_error(dataset, "total", n, kd).max())
        lobes = max(float(lobe_error(dataset, kind, n, kd).max()) for kind in result.KINDS)
        worst = max(worst, widened * albedo / asked, widened * lobes / asked_of_lobes)
    return worst
