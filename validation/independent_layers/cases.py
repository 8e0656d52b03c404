"""Independent surfaces of the same slopes far apart: what is traced of them, what theories say."""

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from microsurf import measure
from microsurf.model import walk
from microsurf.physics.thick_layers import thick_albedo
from microsurf.results import datasets, detector
from microsurf.scene import Accuracy, Layers, Light, Material, Roughness, Scene, Substrate, Surface

from ..checkpoint import LATEST, once

Array = NDArray[np.float64]

KEPT = LATEST / "independent_layers"
N, KD, SIGMA, LENGTH = 1.5, 0.8, 0.5, 8.0
GAPS = {8.0: 50.0, 2.0: 200.0}
"""By γ, in correlation lengths: heavy tails have deep minima."""
THETAS = (0.0, 60.0, 80.0)
REALISATIONS, PATHS, WALKS, SEED = 16, 40_000, 1_000_000, 23
DIFFUSE_PATHS = 10_000
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(6)
DIFFUSE = tuple(np.degrees(np.arcsin(np.sqrt((_NODES + 1) / 2))).tolist())
"""Incidences of Lambertian light: Gauss's nodes in sin²θ."""
QUANTITIES = ("total", "specular", "body", "back", "forward", "zenith")
"""Albedo; its order-1 specular and body part; body light of all orders beyond θ_o = 45° within 25°
of the light's azimuth, as far from it on the other side, and within θ_o = 15°."""
SOURCES = ("layers", "layered-walk", "thick limit", "il", "smith-walk")
"""Both surfaces traced; its theory; the closed limit from traces of each surface; IL facets
traced on the interface; and their theory."""
_FLAT_RINGS = slice(int(np.searchsorted(detector.RING_EDGES, 45)), None)
_SECTORS = {"back": [34, 35, 0, 1, 2], "forward": [16, 17, 18, 19, 20]}


def scene_of(gamma: float, thetas: tuple[float, ...] = THETAS, paths: int = PATHS) -> Scene:
    """Both surfaces."""
    return Scene(
        material=Material(N, (KD,)),
        roughness=Roughness(gamma, (SIGMA,)),
        surface=Surface(cells=256, correlation=LENGTH, realisations=REALISATIONS),
        light=Light(thetas),
        accuracy=Accuracy(paths, engine="exact"),
        layers=Layers(GAPS[gamma] * LENGTH, Substrate(gamma, (SIGMA,))),
    )


def light_of(gamma: float, source: str) -> Array:
    """QUANTITIES by realisation (one of a theory) and θ_i; what is not known is NaN."""
    return np.array(once(_file(gamma, source), partial(_light, gamma, source)), float)


def lobes_of(gamma: float, source: str) -> xr.DataArray:
    """BRDF of body light in the plane of incidence in sr⁻¹, by realisation, θ_i and signed θ_o."""
    light_of(gamma, source)
    values, theta_o = once(_file(gamma, f"{source}-lobes"), list)
    return xr.DataArray(
        values, dims=("realisation", "theta_i", "theta_o"),
        coords={"theta_i": list(THETAS), "theta_o": theta_o},
    )  # fmt: skip


def _file(gamma: float, name: str) -> Path:
    return KEPT / f"{gamma:g}-{name}.json"


def _light(gamma: float, source: str) -> list[Any]:
    if source == "thick limit":
        return list(_thick(gamma).tolist())
    scene = scene_of(gamma)
    if not source.startswith("layer"):
        scene = replace(scene, layers=None)
    if source.endswith("walk"):
        result = walk(scene, source, walks=WALKS, seed=1, workers=1)
    else:
        result = measure(scene, seed=SEED, workers=1)
    plane = datasets.in_plane(datasets.brdf(result.microsurf.lobe(None, "body").isel(phi_i=0)))
    lobes = [np.round(plane.values, 6).tolist(), plane.theta_o.values.tolist()]
    once(_file(gamma, f"{source}-lobes"), lambda: lobes)
    return list(np.round(quantities(result), 8).tolist())


def quantities(dataset: xr.Dataset) -> Array:
    """QUANTITIES by realisation and θ_i."""
    result = dataset.microsurf
    lobe = result.lobe(None, "body").isel(phi_i=0)
    zenith = slice(int(np.searchsorted(detector.RING_EDGES, 15)))
    values = [
        result.albedo(), result.albedo(1, "specular"), result.albedo(1, "body"),
        *(
            lobe.isel(theta_o=_FLAT_RINGS, phi_o=sectors).sum(("theta_o", "phi_o"))
            for sectors in _SECTORS.values()
        ),
        lobe.isel(theta_o=zenith).sum(("theta_o", "phi_o")),
    ]  # fmt: skip
    return np.stack([np.asarray(v).reshape(lobe.shape[:2]) for v in values], axis=-1)


def _thick(gamma: float) -> Array:
    """The closed limit from R and r_e′ of the interface's traces, and K of the substrate's."""
    traced = measure(scene_of(gamma, (*THETAS, *DIFFUSE), DIFFUSE_PATHS), seed=SEED, workers=1)
    returned = traced.flux.isel(body_events=slice(0, 2), phi_i=0)
    reflected = np.asarray(returned.sum(("order", "body_events", "theta_o", "phi_o")))
    beams, diffuse = reflected[:, : len(THETAS)], reflected[:, len(THETAS) :] @ _WEIGHTS / 2
    # Other surfaces than those under the interface, of the same slopes.
    alone = replace(
        scene_of(gamma, DIFFUSE, DIFFUSE_PATHS), layers=None, material=Material(1.0, (KD,))
    )
    albedos = measure(alone, seed=SEED + 1, workers=1).microsurf.albedo().isel(phi_i=0)
    k = np.asarray(albedos) @ _WEIGHTS / 2
    values = np.full((REALISATIONS, len(THETAS), len(QUANTITIES)), np.nan)
    values[..., 0] = thick_albedo(beams, diffuse[:, None], k[:, None], N)
    return values
