"""Independent surfaces of the same slopes far apart: what is traced of them, what theories say."""

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from microsurf import measure
from microsurf.model import walk
from microsurf.physics.thick_layers import thick_albedo
from microsurf.results import datasets, detector
from microsurf.scene import Accuracy, Layers, Light, Material, Roughness, Scene, Substrate, Surface

from ...checkpoint import LATEST, once

Array = NDArray[np.float64]

KEPT = LATEST / "layers" / "independent"
N, KD, SIGMA, LENGTH = 1.5, 0.8, 0.5, 8.0
GAPS = {8.0: 50.0, 2.0: 200.0}
"""By γ, in correlation lengths: heavy tails have deep minima."""
THETAS = (0.0, 60.0, 80.0)
REALISATIONS, PATHS, WALKS, SEED = 16, 40_000, 1_000_000, 23
FARTHER = 5
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


def scene_of(
    gamma: float,
    thetas: tuple[float, ...] = THETAS,
    structure: str = "independent",
    cells: int = 256,
) -> Scene:
    """Both surfaces; those of other structures are higher, and farther apart."""
    gap = GAPS[gamma] * LENGTH * (1 if structure == "independent" else FARTHER)
    return Scene(
        material=Material(N, (KD,)),
        roughness=Roughness(gamma, (SIGMA,)),
        surface=Surface(
            cells=cells, correlation=LENGTH, structure=structure, realisations=REALISATIONS
        ),
        light=Light(thetas),
        accuracy=Accuracy(PATHS, engine="exact"),
        layers=Layers(gap, Substrate(gamma, (SIGMA,))),
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


class Parts(NamedTuple):
    """Of what the thick limit is made, by realisation (one of walks).

    reflected : array, shape (realisations, θ_i)
        R, what the interface sends back of a beam without a substrate event.
    diffuse, substrate : array, shape (realisations, 1)
        r_e′, the same of Lambertian light, and K, the albedo of the substrate alone.
    total : array, shape (realisations, θ_i)
        Albedo of both layers.

    """

    reflected: Array
    diffuse: Array
    substrate: Array
    total: Array

    @property
    def limit(self) -> Array:
        """The closed limit by realisation and θ_i."""
        return thick_albedo(self.reflected, self.diffuse, self.substrate, N)


def traced_parts(gamma: float, structure: str = "independent", cells: int = 256) -> Parts:
    """Parts of the surfaces; K is of others than those under the interface, of the same slopes."""
    name = "parts" if (structure, cells) == ("independent", 256) else f"parts-{structure}-{cells}"

    def trace() -> Any:
        both = scene_of(gamma, (*THETAS, *DIFFUSE), structure=structure, cells=cells)
        return _parts(
            measure(both, seed=SEED, workers=1),
            measure(_substrate_of(both), seed=SEED + 1, workers=1),
        )

    return Parts(*(np.array(part) for part in once(_file(gamma, name), trace)))


def walked_parts(gamma: float) -> Parts:
    """Parts of walks: of the layered walk, and of Smith's on the substrate alone."""

    def run() -> Any:
        both = scene_of(gamma, (*THETAS, *DIFFUSE))
        return _parts(
            walk(both, "layered-walk", walks=WALKS, seed=2, workers=1),
            walk(_substrate_of(both), "smith-walk", walks=WALKS, seed=3, workers=1),
        )

    return Parts(*(np.array(part) for part in once(_file(gamma, "parts-walk"), run)))


def _substrate_of(both: Scene) -> Scene:
    return replace(both, layers=None, material=Material(1.0, (KD,)), light=Light(DIFFUSE))


def _parts(both: xr.Dataset, alone: xr.Dataset) -> list[Any]:
    returned = both.flux.isel(body_events=slice(0, 2), phi_i=0)
    reflected = np.asarray(returned.sum(("order", "body_events", "theta_o", "phi_o")))
    beams, diffuse = reflected[:, : len(THETAS)], reflected[:, len(THETAS) :] @ _WEIGHTS / 2
    k = np.asarray(alone.microsurf.albedo().isel(phi_i=0)) @ _WEIGHTS / 2
    total = np.asarray(both.microsurf.albedo().isel(phi_i=0))[:, : len(THETAS)]
    return [part.tolist() for part in (beams, diffuse[:, None], k[:, None], total)]


def _thick(gamma: float) -> Array:
    """The closed limit from parts of the surfaces."""
    limit = traced_parts(gamma).limit
    values = np.full((*limit.shape, len(QUANTITIES)), np.nan)
    values[..., 0] = limit
    return values
