"""What a budget is drawn up for: parts of the light that add up to the albedo, and lobes."""

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...results import datasets, detector

Array = NDArray[np.float64]

FIRST = ("order-1 specular", "order-1 body")
HIGHER = ("order 2", "order 3", "order 4+")
TOTAL = "total"
REGIONS = ("about the normal", "mirror side", "backward", "grazing")
"""Where order-1 light leaves to: θ_o < 30°; the half space of the mirror direction and that of
the light, 30 … 75°; beyond 75°."""
LOBES = tuple(f"{kind} {region}" for kind in FIRST for region in REGIONS)
"""The parts of order 1 by region."""


def region_masks() -> NDArray[np.bool_]:
    """Which bins of the detector belong to each of REGIONS, shape (regions, rings, sectors)."""
    theta = detector.ring_centres()[:, None]
    phi = np.radians((detector.SECTOR_EDGES[:-1] + detector.SECTOR_EDGES[1:]) / 2)[None]
    between = (theta >= 30) & (theta < 75)
    forward = np.cos(phi) < -1e-9
    return np.stack(
        np.broadcast_arrays(
            theta < 30, between & forward, between & ~forward, (theta >= 75) & (phi > -9)
        )
    )


def of_order_one(flux: Array, weight: float) -> dict[str, Array]:
    """FIRST and LOBES out of order-1 flux, shape (..., 2, rings, sectors), kinds second last.

    ``weight`` is that of the body light.
    """
    regions = {}
    masks = region_masks()
    for k, (kind, factor) in enumerate(zip(FIRST, (1.0, weight), strict=True)):
        lobe = flux[..., k, :, :] * factor
        regions[kind] = lobe.sum((-2, -1))
        for region, mask in zip(REGIONS, masks, strict=True):
            regions[f"{kind} {region}"] = (lobe * mask).sum((-2, -1))
    return regions


def components(dataset: xr.Dataset, n: float, kd: float) -> dict[str, Array]:
    """All parts by (realisation, theta_i, phi_i); those of orders a dataset lacks are absent."""
    energy = datasets.by_kind(dataset.flux, n, kd).transpose(
        "realisation", "theta_i", "phi_i", "order", "kind", "theta_o", "phi_o"
    )
    regions = of_order_one(energy.sel(order=1).values, 1.0)
    albedo = energy.sum(("kind", "theta_o", "phi_o"))
    for name, order in zip(HIGHER, detector.ORDERS[1:], strict=True):
        if order in albedo.order:
            regions[name] = albedo.sel(order=order).values
    return regions
