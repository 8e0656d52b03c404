"""How well a measurement is known: errors of its rays, of its surfaces, and what to buy next.

The error of a mean over realisations has two parts, separated in `components_of`: rays on one
surface (*within*) and differences of surfaces (*between*). Errors of rays come from
batches that know nothing of each other, those of a lobe's bins from its paths. On isotropic
surfaces light comes from azimuths that are the same for every run of as many paths: what
others would have shown is a difference between surfaces.
"""

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..scene import Scene
from ..stats import intervals
from ..stats.variance_components import (
    KNOWN,
    Improvement,
    VarianceComponents,
    components_of,
    improvement,
)
from . import albedos, datasets, detector


def lobe_ray_variance(dataset: xr.Dataset, kind: str, n: float, kd: float) -> xr.DataArray:
    """Variance of an order-1 lobe's bins in each realisation from its rays alone."""
    weight = (
        1.0 if kind == "specular" else float(datasets.bin_weights(dataset.flux, n, kd)[1:2].sum())
    )
    return xr.DataArray(dataset.bin_variance.sel(kind=kind, drop=True) * weight**2)


def region_ray_error(
    dataset: xr.Dataset, kind: str, region: NDArray[np.bool_], n: float, kd: float
) -> xr.DataArray:
    """Standard error of an order-1 lobe's light in a region, in each realisation; a bound.

    From the rays alone. ``region`` says which bins it has, shape (theta_o, phi_o). A mirrored
    ray ends in one bin: variances add up. A fan of body light fills one sector: along it
    errors add up, as if its rings always went together.
    """
    bins = lobe_ray_variance(dataset, kind, n, kd)
    mirrored = bins.roll(phi_o=-1).isel(phi_o=slice(None, None, -1))
    # Folded lobes hold half of every ray at φ and half at −φ: the sum of both is the ray.
    twice = 1 + bool(np.allclose(bins.values, mirrored.values, rtol=1e-9, atol=0))
    inside = bins.where(xr.DataArray(region, dims=("theta_o", "phi_o")), 0.0)
    if kind == "specular":
        sectors = inside.sum("theta_o")
    else:
        sectors = xr.DataArray(np.sqrt(inside)).sum("theta_o") ** 2
    total = sectors.sum("phi_o").transpose("realisation", "theta_i", "phi_i")
    return xr.DataArray(np.sqrt(twice * total))


def lobe(dataset: xr.Dataset, kind: str, n: float, kd: float) -> xr.DataArray:
    """Energy in the bins of an order-1 lobe, by realisation and angle."""
    return datasets.by_kind(dataset.flux.sel(order=1, drop=True), n, kd).sel(kind=kind, drop=True)


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
    target = scene.accuracy.standard_error or np.inf
    target_of_lobes = scene.accuracy.lobe_error or target
    count = dataset.sizes["realisation"]
    widened = intervals.over_values(count) / intervals.normal()
    n = scene.material.n
    worst = 0.0
    for kd in scene.material.kd:
        albedo = float(albedos.standard_error(dataset, "total", n, kd).max())
        lobes = max(float(lobe_error(dataset, kind, n, kd).max()) for kind in detector.KINDS)
        worst = max(worst, widened * albedo / target, widened * lobes / target_of_lobes)
    return worst


LOBES = {f"{kind} lobe": f"order-1 {kind} lobe" for kind in detector.KINDS}
"""Errors of lobes are root sums of squares over their bins; so is their size."""


@dataclass(frozen=True)
class QuantityUncertainty:
    """What is known of one quantity (of summary.QUANTITIES or LOBES) at one incidence."""

    quantity: str
    theta_i: float
    phi_i: float
    kd: float
    components: VarianceComponents
    advice: Improvement


def of_measurement(dataset: xr.Dataset, scene: Scene) -> list[QuantityUncertainty]:
    """Errors of all that a report prints, and what to buy next; what is zero is left out."""
    only = scene.surface.file is not None or not scene.requires.roughness
    rows = []
    n = scene.material.n
    for name in (*albedos.QUANTITIES, *LOBES):
        for kd in scene.material.kd:
            for incidence, components in _components(dataset, name, n, kd):
                if components.mean > 0:
                    bought = improvement(components, only=only)
                    rows.append(QuantityUncertainty(name, *incidence, kd, components, bought))
    return rows


def as_json(dataset: xr.Dataset, scene: Scene) -> list[dict[str, Any]]:
    """The same for JSON, which has no ∞: an unbounded σ_b becomes null."""
    rows = []
    for known in of_measurement(dataset, scene):
        row = asdict(known)
        row |= row.pop("components")
        row |= {"between_low": row.pop("low"), "between_high": row.pop("high")}
        if np.isinf(row["between_high"]):
            row["between_high"] = None
        row["advice"] = row["advice"]["text"]
        bought = known.advice
        row |= {"dominant": bought.dominant, "rays_to_halve": bought.rays}
        rows.append(row | {"surfaces_to_halve": bought.surfaces})
    return rows


def _components(
    dataset: xr.Dataset, name: str, n: float, kd: float
) -> Iterator[tuple[tuple[float, float], VarianceComponents]]:
    """Spreads of one quantity over the surfaces, by θ_i and φ_i in degrees."""
    is_lobe = name in LOBES
    if is_lobe:
        kind = name.removesuffix(" lobe")
        values, variance = (of(dataset, kind, n, kd) for of in (lobe, lobe_ray_variance))
    else:
        values = albedos.quantity(dataset, name, n, kd)
        variance = xr.DataArray(albedos.ray_error(dataset, name, n, kd) ** 2)
    for t, theta in enumerate(dataset.theta_i.values):
        for p, phi in enumerate(dataset.phi_i.values):
            index = {"theta_i": t, "phi_i": p}
            of_rays = variance.isel(index).values
            batches = (dataset.batch_light.isel(index).values > 0).sum(axis=1)
            # Paths know the variance of their bins well; a few batches that of their sum.
            dof = (
                KNOWN
                if is_lobe
                else float(intervals.dof_of_sum(of_rays, np.maximum(batches - 1, 1)))
            )
            components = components_of(values.isel(index).values, of_rays, dof)
            yield (float(theta), float(phi)), components
