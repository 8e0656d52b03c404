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

from ..scene import Scene
from ..stats import intervals
from ..stats.variance_components import (
    KNOWN,
    Improvement,
    VarianceComponents,
    components_of,
    improvement,
)
from . import albedos, detector


def surplus(dataset: xr.Dataset, scene: Scene) -> float:
    """Greatest error over what the scene asks for; ≤ 1 is enough.

    Few surfaces know their own spread badly: their error is widened so that twice it
    covers what Student's t says.
    """
    target = scene.accuracy.standard_error or np.inf
    target_of_lobes = scene.accuracy.lobe_error or target
    count = dataset.sizes["realisation"]
    widened = intervals.over_values(count) / intervals.normal()
    worst = 0.0
    for kd in scene.material.kd:
        albedo = float(dataset.microsurf.standard_error(kd=kd).max())
        lobes = max(
            float(dataset.microsurf.lobe_error(kind, kd=kd).max()) for kind in detector.KINDS
        )
        worst = max(worst, widened * albedo / target, widened * lobes / target_of_lobes)
    return worst


LOBES = {f"{kind} lobe": f"order-1 {kind} lobe" for kind in detector.KINDS}
"""Errors of lobes are root sums of squares over their bins; so is their size."""


@dataclass(frozen=True)
class QuantityUncertainty:
    """What is known of one quantity (of albedos.QUANTITIES or LOBES) at one incidence."""

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
    for name in (*albedos.QUANTITIES, *LOBES):
        for kd in scene.material.kd:
            for incidence, components in _components(dataset, name, kd):
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
    dataset: xr.Dataset, name: str, kd: float
) -> Iterator[tuple[tuple[float, float], VarianceComponents]]:
    """Spreads of one quantity over the surfaces, by θ_i and φ_i in degrees."""
    result = dataset.microsurf
    is_lobe = name in LOBES
    if is_lobe:
        kind = name.removesuffix(" lobe")
        values = result.lobe(1, kind, kd=kd)
        variance = result.lobe_ray_variance(kind, kd=kd)
    else:
        selected = albedos.SELECTED[name]
        values = result.albedo(**selected, kd=kd)
        variance = xr.DataArray(result.ray_error(**selected, kd=kd) ** 2)
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
