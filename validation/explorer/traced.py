"""Trace the points of the explorer: four surfaces' recipes, four incidences, every Kd.

    python -m validation.explorer.traced

Writes traced.json to reports/explorer. A set holds, for each surface and number of body events,
the BRDF at unit body weight in the plane of incidence: the page applies Kd, as
`results.datasets` does, and takes Student's intervals over the surfaces.
"""

import json
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from microsurf import measure
from microsurf.cli.save import save
from microsurf.results import datasets, detector
from microsurf.scene import Accuracy, Light, Material, Roughness, Scene, Surface
from microsurf.stats import intervals

Array = NDArray[np.float64]

OUT = Path(__file__).parents[2] / "reports" / "explorer"
GAMMAS, SIGMAS, N = (2.0, 8.0), (0.3, 0.5), 1.5
THETAS = (0.0, 30.0, 60.0, 75.0)
SURFACES, PATHS = 8, 500_000
"""Realisations of 512² cells, and paths for each of them and each incidence."""
LEAST_PART = 3e-3
"""Numbers of body events that bring less than this of the light of a set are pooled."""


def scene(gamma: float, sigma: float) -> Scene:
    """One recipe of surfaces, under all incidences."""
    return Scene(
        material=Material(N, (1.0,)),
        roughness=Roughness(gamma, (sigma,)),
        surface=Surface(realisations=SURFACES),
        light=Light(THETAS),
        accuracy=Accuracy(PATHS),
    )


def in_plane(result: xr.Dataset, theta: float) -> xr.DataArray:
    """BRDF at unit body weight in the plane of incidence; at 0° every plane is one."""
    density = datasets.brdf(result.flux).sel(theta_i=theta)
    density = density.isel(phi_i=0, drop=True)
    if theta == 0:
        density = density * 0 + density.mean("phi_o")
    return datasets.in_plane(density).transpose("order", "realisation", "body_events", "theta_o")


def pooled(values: xr.DataArray) -> Array:
    """Sum over orders, shape (surfaces, events, θ_o); the last number of events and all above."""
    every = values.sum("order").values
    part = every.sum(axis=(0, 2)) / every.sum()
    last = int(np.flatnonzero(np.cumsum(part[::-1])[::-1] >= LEAST_PART)[-1])
    return np.concatenate([every[:, :last], every[:, last:].sum(axis=1, keepdims=True)], axis=1)


def sets() -> list[dict[str, Any]]:
    """Trace all."""
    rows = []
    for gamma, sigma in product(GAMMAS, SIGMAS):
        result = measure(scene(gamma, sigma), progress=True)
        for theta in THETAS:
            values = in_plane(result, theta)
            first = values.sel(order=1).isel(body_events=slice(0, 2)).values
            rows.append(
                {
                    "gamma": gamma, "sigma": sigma, "n": N, "theta": theta,
                    "order_one": rounded(first), "all_orders": rounded(pooled(values)),
                }
            )  # fmt: skip
    return rows


def rounded(values: Array) -> Any:
    """Three digits of every number, as nested lists."""
    return np.vectorize(lambda v: float(f"{v:.3g}"))(values).tolist()


def main() -> None:
    """Trace and write."""
    content = {
        "theta_o": in_plane_angles(),
        "student": float(f"{intervals.student(SURFACES - 1):.6g}"),
        "surfaces": SURFACES,
        "cells": 512,
        "sets": sets(),
    }
    OUT.mkdir(parents=True, exist_ok=True)
    text = json.dumps(content, separators=(",", ":")).replace('{"gamma', '\n{"gamma')
    save(OUT, {"traced.json": text + "\n"})


def in_plane_angles() -> list[float]:
    """θ_o of `in_plane` in degrees, positive on the mirror side."""
    front = detector.ring_centres()[1:]
    return [*(-front[::-1]).tolist(), 0.0, *front.tolist()]


if __name__ == "__main__":
    main()
