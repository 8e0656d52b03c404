"""The walks for single pairs of directions, every order: `evaluate_walk`."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...scene import Scene
from ..directions import checked
from ..registry import walk_of
from .parameters import LayeredSlopes, stream
from .simulate import CHUNK, MOST_EVENTS, arguments_of

Array = NDArray[np.float64]

_DRAWS = 16  # of the terms of long chains of mirrors in a V-cavity


class BrdfEstimate(NamedTuple):
    """A BRDF in sr⁻¹, or its standard error: of paths without body events, with, and of all."""

    specular: Array
    body: Array
    total: Array


def evaluate_walk(
    scene: Scene,
    i: Array,
    o: Array,
    kind: str,
    walks: int,
    rng: np.random.Generator,
    orders: tuple[int, int] = (1, MOST_EVENTS),
) -> tuple[BrdfEstimate, BrdfEstimate]:
    """Unbiased estimate of the BRDF for pairs of directions, and its standard error.

    At each facet a walk from i meets, what that facet sends towards o is evaluated and
    not waited for (next-event estimation). In two layers that is done at the interface; of a plane
    interface at the substrate, and what such a plane mirrors is left out. In V-cavities chains
    of mirrors alone have a closed form (see `vcavity_kernels`), and no error up to 32 of them;
    about the mirror direction chains of two and more have a caustic, cut off at 1e−9 from it.

    Parameters
    ----------
    scene : Scene
        With one Kd and σ > 0; with two layers for a kind that is of them.
    i, o : array, shape (..., 3)
        Unit directions towards the light and the detector; 0 below the horizon.
    kind : str
        A model of all orders, see `model.registry`.
    walks : int
        Walks for each pair, ≥ 2.
    rng : numpy.random.Generator
        Source of randomness.
    orders : tuple of int
        First and last number of facet events that counts.

    Raises
    ------
    InputError
        If one of these is not as described.

    """
    kd, rough = scene.material.kd, scene.roughness
    model = walk_of(kind)
    if len(kd) > 1:
        raise InputError(f"material.kd = {list(kd)}: must be one number to evaluate directions")
    if not scene.requires.roughness:
        raise InputError(f"roughness.sigma = {list(rough.sigma)}: must be > 0; take model flat")
    if walks < 2:
        raise InputError(f"walks = {walks}: must be 2 or more, for a standard error")
    i, o = checked(i=i, o=o)
    shape = i.shape[:-1]
    i, o = np.ascontiguousarray(i.reshape(-1, 3)), np.ascontiguousarray(o.reshape(-1, 3))
    if not scene.requires.multiple_scattering:
        orders = orders[0], min(orders[1], 1)
    parameters, facet = _parameters(scene, kind)
    state = stream(rng)
    mean, error = np.zeros((2, len(i), 3))
    up = np.flatnonzero((i[:, 2] > 0) & (o[:, 2] > 0))
    walked = model.mirrors is None or scene.requires.substrate
    for start in range(0, len(up) if walked else 0, max(1, CHUNK // walks)):
        pairs = up[start : start + max(1, CHUNK // walks)]
        moments = np.zeros((2, len(pairs), 3))
        for done in range(0, walks, CHUNK):
            values = np.zeros((min(CHUNK, walks - done) * len(pairs), 3))
            model.next_event(values, *orders, i[pairs], o[pairs], parameters, facet, state)
            values[:, 2] = values[:, 0] + values[:, 1]
            of_pair = values.reshape(-1, len(pairs), 3)
            moments += of_pair.sum(axis=0), (of_pair**2).sum(axis=0)
        first, second = moments / walks
        mean[pairs] = first
        error[pairs] = np.sqrt(np.maximum(second - first**2, 0) / (walks - 1))
    if model.mirrors is not None and scene.requires.interface:
        value, spread = np.zeros((2, len(up)))
        model.mirrors(value, spread, _DRAWS, *orders, i[up], o[up], parameters, facet, state)
        mean[up] += value[:, None] * [1, 0, 1]
        error[up, 0] = spread
        error[up, 2] = np.hypot(error[up, 2], spread)
    cosine = np.where(o[:, 2:] > 0, o[:, 2:], 1.0)
    return _estimate(mean / cosine, shape), _estimate(error / cosine, shape)


def _parameters(scene: Scene, kind: str) -> tuple[Any, Any]:
    """Slopes and facets; an interface with the index of air is seen through as a plane is."""
    arguments = arguments_of(scene, kind)
    slopes = arguments.slopes
    if isinstance(slopes, LayeredSlopes) and not scene.requires.interface:
        plane = slopes.interface._replace(scale_x=0.0, scale_y=0.0)
        slopes = slopes._replace(interface=plane)
    return slopes, arguments.facets


def _estimate(values: Array, shape: tuple[int, ...]) -> BrdfEstimate:
    return BrdfEstimate(*values.T.reshape(3, *shape))
