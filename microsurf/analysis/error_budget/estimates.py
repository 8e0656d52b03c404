"""Parts of what was predicted and measured with their errors, of all angles at once."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...results import albedos as summary
from ...results import detector
from ...stats import intervals
from .regions import FIRST, HIGHER, LOBES, REGIONS, components, region_masks
from .terms import TermEstimate

Array = NDArray[np.float64]

Estimates = Mapping[str, tuple[Array, Array]]
"""Values and half widths by part, each of shape (theta_i, phi_i)."""


def parts_of(models: tuple[xr.Dataset, xr.Dataset | None], n: float, kd: float) -> Estimates:
    """Order 1 of the first model, which is exact, later orders of the second."""
    first, walk = models
    parts = {
        q: (v[0], np.zeros_like(v[0])) for q, v in components(first, n, kd).items()
        if q in (*FIRST, *LOBES)
    }  # fmt: skip
    if walk is not None:
        walked = walked_parts(walk, n, kd)
        parts |= {q: walked[q] for q in HIGHER if q in walked}
    return parts


def walked_parts(walk: xr.Dataset, n: float, kd: float) -> Estimates:
    """Parts of a walk; a path brings 0 … 1, so that the variance of a part is below the part."""
    paths = walk.paths.values[0] if "paths" in walk else np.inf
    return {
        q: (v[0], intervals.normal() * np.sqrt(np.maximum(v[0], 0.0) / paths))
        for q, v in components(walk, n, kd).items()
    }


def at(estimates: Estimates, index: tuple[int, int]) -> dict[str, TermEstimate]:
    """Estimates at one incidence."""
    return {q: TermEstimate(float(v[index]), float(h[index])) for q, (v, h) in estimates.items()}


def ray_errors_of(measured: xr.Dataset, n: float, kd: float) -> dict[str, Array]:
    """Of one surface: albedos from batches, lobes from their bins, later orders a bound."""
    first = {"order-1 specular": "specular", "order-1 body": "body", "total": "total"}
    by_quantity: dict[str, Array] = {
        q: measured.microsurf.ray_error(**summary.SELECTED[name], kd=kd).values[0]
        for q, name in first.items()
    }
    light = measured.light_rays.values[0]
    for q, v in components(measured, n, kd).items():
        if q in HIGHER:
            by_quantity[q] = np.sqrt(v[0] / light)
    for part, kind in zip(FIRST, detector.KINDS, strict=True):
        for region, mask in zip(REGIONS, region_masks(), strict=True):
            errors = measured.microsurf.region_ray_error(kind, mask, kd=kd)
            by_quantity[f"{part} {region}"] = errors.values[0]
    return by_quantity
