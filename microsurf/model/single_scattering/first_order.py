"""The first order by name: whole lobes in the detector's bins, or single directions."""

import time
from concurrent.futures import ThreadPoolExecutor
from itertools import product

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ... import memory
from ...errors import InputError
from ...physics import facet
from ...results import detector
from ...scene import Scene
from ...scene.layers import refuse
from ..directions import checked
from ..prediction import Attributes, prediction
from ..registry import entry_of, order_one
from . import brdf, flat
from .body_bins import body_bins
from .facets import Facets
from .specular_bins import specular_bins

Array = NDArray[np.float64]


def predict(scene: Scene, model: str = "smith") -> xr.Dataset:
    """First order of a scene, integrated over the detector's bins.

    Only what the scene requires runs: n = 1 has no specular part, all Kd = 0 no body
    part, and σ = 0 is flat whatever the model.

    Returns
    -------
    xarray.Dataset
        As `microsurf.results.datasets` describes, one realisation and order 1 alone, so body
        energies are those at unit body weight. In its attributes ``effects`` lists
        what ran; ``specular_error`` and ``body_error`` are the largest relative
        errors of the quadrature, measured (see `specular_bins` and `body_bins`).

    Raises
    ------
    InputError
        If the model's name is unknown, or the scene has two layers.

    """
    refuse(scene.layers, f"the model {model}")
    begin = time.perf_counter()
    facets = _facets(scene, model)
    thetas, phis = scene.light.theta, scene.light.phi
    flux = np.zeros((1, len(thetas), len(phis), 1, 2, detector.RINGS, detector.SECTORS))
    errors = np.zeros(2)
    # Where azimuth makes no difference the first stands for all.
    own_phis = phis if facets is not None and not facets.isotropic else phis[:1]

    def at(angles: tuple[float, float]) -> tuple[Array, tuple[float, float]]:
        return _bins(scene, facets, *np.radians(angles))

    with ThreadPoolExecutor(memory.cores()) as pool:
        lobes = list(pool.map(at, product(thetas, own_phis)))
    for k, (bins, error) in enumerate(lobes):
        t, p = divmod(k, len(own_phis))
        flux[0, t, p if len(own_phis) > 1 else slice(None), 0] = bins
        errors = np.maximum(errors, error)
    needs = scene.requires
    effects = {
        "interface": needs.interface,
        "substrate": needs.substrate,
        "roughness": facets is not None,
        "anisotropy": facets is not None and not facets.isotropic,
    }
    attrs: Attributes = {
        "effects": ", ".join(name for name, runs in effects.items() if runs),
        "specular_error": float(errors[0]),
        "body_error": float(errors[1]),
        "seconds": time.perf_counter() - begin,
    }
    return prediction(scene, model, flux, attrs, orders=(1,))


def evaluate(
    scene: Scene, i: NDArray[np.float64], o: NDArray[np.float64], model: str = "smith"
) -> tuple[Array, Array]:
    """BRDF of the first order in sr⁻¹, cosine not included: f_specular and f_body.

    The body part is that at the scene's Kd. A flat specular part is all in the one
    mirror direction, a Dirac delta: f_specular is 0 and `predict` holds its energy.

    Parameters
    ----------
    scene : Scene
        With one Kd.
    i, o : array, shape (..., 3)
        Unit directions towards the light and the detector; 0 below the horizon.
    model : str
        One of order 1, see `model.registry`.

    Raises
    ------
    InputError
        If the model's name is unknown, the scene has several Kd or two layers, or a
        direction is not a unit vector.

    """
    refuse(scene.layers, f"the model {model}")
    facets = _facets(scene, model)
    kd = scene.material.kd
    if len(kd) > 1:
        raise InputError(f"material.kd = {list(kd)}: must be one number to evaluate directions")
    i, o = checked(i=i, o=o)
    shape = i.shape[:-1]
    i, o = i.reshape(-1, 3), o.reshape(-1, 3)
    up = (i[:, 2] > 0) & (o[:, 2] > 0)
    specular, body = np.zeros(len(i)), np.zeros(len(i))
    n, needs = scene.material.n, scene.requires
    if needs.interface and facets is not None:
        specular[up] = brdf.specular(facets, i[up], o[up])
    if needs.substrate:
        weight = facet.body_weight(n, kd[0])
        if facets is None:
            body[up] = weight * flat.body(i[up, 2], o[up, 2], n)
        else:
            body[up] = weight * brdf.body(facets, i[up], o[up])
    return specular.reshape(shape), body.reshape(shape)


def _facets(scene: Scene, model: str) -> Facets | None:
    """The rough interface of a model; None if it is flat."""
    masking = entry_of(model, order_one()).masking
    rough = scene.roughness
    if masking is None or rough.sigma_x == 0:
        return None
    n, k = scene.material.n, scene.material.k
    return Facets(n, rough.gamma, rough.sigma_x, rough.sigma_y, masking, k)


def _bins(
    scene: Scene, facets: Facets | None, theta: float, phi: float
) -> tuple[Array, tuple[float, float]]:
    """Specular and body energies, shape (2, rings, sectors), and their relative errors."""
    if facets is None:
        return flat.lobes(scene, theta), (0.0, 0.0)
    needs = scene.requires
    bins = np.zeros((2, detector.RINGS, detector.SECTORS))
    specular_error = body_error = 0.0
    if needs.interface:
        bins[0], specular_error = specular_bins(facets, theta, phi)
    if needs.substrate:
        bins[1], body_error = body_bins(facets, theta, phi)
    return bins, (specular_error, body_error)
