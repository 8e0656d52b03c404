"""The Smith walk for single pairs of directions, every order: `evaluate_walk`."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..scene import Scene
from .walk import MOST_EVENTS, PIECE
from .walk_kernels import smith_next_event
from .walk_law import facet_of, law_of, stream

Array = NDArray[np.float64]


class Estimate(NamedTuple):
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
) -> tuple[Estimate, Estimate]:
    """Unbiased estimate of the BRDF for pairs of directions, and its standard error.

    At each facet a walk from i meets, what that facet sends towards o is evaluated and
    not waited for (next-event estimation).

    Parameters
    ----------
    scene : Scene
        With one Kd and σ > 0.
    i, o : array, shape (..., 3)
        Unit directions towards the light and the detector; 0 below the horizon.
    kind : str
        "smith-walk"; in a groove a chain of mirrors has no density to evaluate.
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
    if kind != "smith-walk":
        raise InputError(f"kind = {kind!r}: single directions need smith-walk")
    if len(kd) > 1:
        raise InputError(f"material.kd = {list(kd)}: must be one number to evaluate directions")
    if not scene.requires.roughness:
        raise InputError(f"roughness.sigma = {list(rough.sigma)}: must be > 0; take model flat")
    if walks < 2:
        raise InputError(f"walks = {walks}: must be 2 or more, for a standard error")
    for name, w in (("i", i), ("o", o)):
        if np.shape(w)[-1:] != (3,) or np.any(~(np.abs(np.linalg.norm(w, axis=-1) - 1) < 1e-9)):
            raise InputError(
                f"{name}: must be unit vectors along its last axis of 3; divide by length"
            )
    i, o = np.broadcast_arrays(np.asarray(i, np.float64), np.asarray(o, np.float64))
    law, facet = law_of(rough.gamma, rough.sigma_x, rough.sigma_y), facet_of(scene, kd[0])
    state = stream(rng)
    mean, error = np.zeros((2, i[..., 0].size, 3))
    for k, (to_light, to_detector) in enumerate(
        zip(i.reshape(-1, 3), o.reshape(-1, 3), strict=True)
    ):
        if to_light[2] <= 0 or to_detector[2] <= 0:
            continue
        moments = np.zeros((2, 3))
        for start in range(0, walks, PIECE):
            values = np.zeros((min(PIECE, walks - start), 3))
            smith_next_event(
                values, *orders, to_light[None].copy(), to_detector[None].copy(), law, facet, state
            )
            values[:, 2] = values[:, 0] + values[:, 1]
            moments += np.sum(values, axis=0), np.sum(values**2, axis=0)
        first, second = moments / walks
        mean[k] = first / to_detector[2]
        variance = np.maximum(second - first**2, 0) / (walks - 1)
        error[k] = np.sqrt(variance) / to_detector[2]
    shape = (3, *i.shape[:-1])
    return Estimate(*mean.T.reshape(shape)), Estimate(*error.T.reshape(shape))
