"""Smith's walk for pairs of directions with common random numbers, for fits: `by_body`."""

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...scene import Material, Scene
from ...scene.layers import refuse
from .common_kernels import smith_by_body
from .parameters import slope_parameters, walk_facet
from .simulate import MOST_EVENTS

Array = NDArray[np.float64]

EVENTS = 12
"""Body events kept apart; more are taken for so many."""


def by_body(
    scene: Scene,
    i: Array,
    o: Array,
    walks: int,
    seed: int,
    orders: tuple[int, int] = (2, MOST_EVENTS),
) -> Array:
    """BRDF in sr⁻¹ by numbers of body events, shape (pairs, EVENTS + 1), for a white substrate.

    With w the body weight of a Kd (`physics.facet.body_weight`), its BRDF is the sum of
    w^b times column b. The same walk of the same pair has the same random numbers
    whatever the scene.

    Parameters
    ----------
    scene : Scene
        Its Kd does not matter, but whether it has a substrate; σ > 0.
    i, o : array, shape (pairs, 3)
        Unit directions above the horizon.
    walks : int
        Walks for each pair, ≥ 1.
    seed : int
        Of all streams, in 0 … 2⁶⁴ − 1.
    orders : tuple of int
        First and last number of facet events that counts.

    Raises
    ------
    InputError
        If σ is 0, there are no walks, or the scene has layers.

    """
    refuse(scene.layers, "Smith's walk")
    if not scene.requires.roughness:
        raise InputError(f"roughness.sigma = {list(scene.roughness.sigma)}: must be > 0")
    if walks < 1:
        raise InputError(f"walks = {walks}: must be 1 or more")
    rough, n = scene.roughness, scene.material.n
    if scene.requires.substrate:
        scene = Scene(material=Material(n, (1.0,)), roughness=rough)
    parameters = slope_parameters(rough.gamma, rough.sigma_x, rough.sigma_y)
    sums = np.zeros((len(i), EVENTS + 1))
    i, o = (np.ascontiguousarray(w, np.float64) for w in (i, o))
    facet = walk_facet(scene, scene.material.kd[0])
    smith_by_body(sums, walks, np.uint64(seed), *orders, i, o, parameters, facet)
    return sums / walks / o[:, 2:]
