"""What given slopes change about the orders of Smith's theory: the same walks, weighted.

Each walk among STD's facets has a weight: the likelihood of its facets and free paths under
the given slopes over that under STD's (`reweighted_kernels`). The mean of weight − 1 over the
walks of an order is what the slopes change; its error is that of the small weight − 1, a
tenth of what two walks of their own would leave.
"""

from concurrent.futures import ThreadPoolExecutor
from itertools import product

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ... import memory, seeds
from ...results import detector
from ...scene import Scene
from ...scene.layers import refuse
from ..directions import direction
from ..random_walk.parameters import (
    SlopeParameters,
    WalkFacet,
    slope_parameters,
    stream,
    walk_facet,
)
from ..random_walk.simulate import MOST_EVENTS
from .reweighted_kernels import weighted_walk
from .slope_bins import SlopeBins, slope_bins
from .slopes import Slopes

Array = NDArray[np.float64]

BATCHES = 16


def order_change(
    scene: Scene, slopes: Slopes, *, walks: int, seed: int = 0, workers: int | None = None
) -> xr.Dataset:
    """Flux by order with given slopes less that with the scene's STD.

    Parameters
    ----------
    scene : Scene
        With σ > 0: that of ``slopes``, whose azimuths are even.
    slopes : Slopes
        What is there instead of STD.
    walks : int
        For each angle, all batches together.
    seed : int
        Same seed, same bits, whatever the number of workers.
    workers : int, optional
        Threads; default one for each core.

    Returns
    -------
    xarray.Dataset
        ``change`` by batch, theta_i, phi_i, order and body_events, before the substrate's
        absorption as in `microsurf.results.datasets`; ``balance``, the mean of weight − 1 over all
        walks, lost or not: 0 but for chance.

    Raises
    ------
    InputError
        If the scene has layers.

    """
    refuse(scene.layers, "the theory on a mesh's slopes")
    rough = scene.roughness
    walked = (
        slope_parameters(rough.gamma, rough.sigma_x, rough.sigma_y),
        walk_facet(scene, max(scene.material.kd)),
        slope_bins(slopes.rho, rough.gamma),
    )
    most = MOST_EVENTS if scene.requires.multiple_scattering else 1
    angles = list(product(scene.light.theta, scene.light.phi))
    size = -(-walks // BATCHES)
    _walk(0, (0.0, 0.0), most, walked, np.random.default_rng(0))  # compiles

    def batch(index: tuple[int, int]) -> tuple[Array, float]:
        rng = seeds.generator(seed, seeds.MESH_WALKS, *index)
        return _walk(size, angles[index[0]], most, walked, rng)

    places = list(product(range(len(angles)), range(BATCHES)))
    with ThreadPoolExecutor(workers or memory.cores()) as pool:
        result = list(pool.map(batch, places))
    events = max(flux.shape[1] for flux, _ in result)
    shape = (BATCHES, len(scene.light.theta), len(scene.light.phi))
    change = np.zeros((*shape, len(detector.ORDERS), events))
    balance = np.zeros(shape)
    for (a, k), (flux, of_all) in zip(places, result, strict=True):
        index = (k, *divmod(a, len(scene.light.phi)))
        change[index][:, : flux.shape[1]] = flux
        balance[index] = of_all
    beyond = np.maximum(detector.BODY_EVENTS[:events] - detector.BODY_EXACT, 0)
    dims = ("batch", "theta_i", "phi_i")
    return xr.Dataset(
        {
            "change": ((*dims, "order", "body_events"), change * walked[1].survival ** -beyond),
            "balance": (dims, balance),
        },
        coords={
            "theta_i": list(scene.light.theta),
            "phi_i": list(scene.light.phi),
            "order": list(detector.ORDERS),
            "body_events": detector.BODY_EVENTS[:events],
        },
    )


def _walk(
    walks: int,
    angle: tuple[float, float],
    most: int,
    walked: tuple[SlopeParameters, WalkFacet, SlopeBins],
    rng: np.random.Generator,
) -> tuple[Array, float]:
    """Change of the flux, shape (orders, body events), and of all of it."""
    parameters, facet, bins = walked
    exits, events = np.zeros((walks, 3)), np.zeros((walks, 2), np.int64)
    weights = np.zeros(walks)
    i = direction(*np.radians(angle))
    weighted_walk(exits, events, weights, most, i, parameters, facet, *bins, stream(rng))
    weights -= 1
    left = events[:, 1] >= 0
    body = detector.body_bins_of(events[left, 1])
    order = np.minimum(events[left, 0], len(detector.ORDERS)) - 1
    count = int(body.max(initial=0)) + 1
    flux = np.bincount(
        order * count + body, weights[left], minlength=len(detector.ORDERS) * count
    ).reshape(-1, count)
    return flux / max(walks, 1), float(weights.sum()) / max(walks, 1)
