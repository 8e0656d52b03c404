"""Energy of the walk's orders from 2 on by angle of incidence and body events, for renderers.

A shader needs these orders as something that it can look up, that is reciprocal, and whose energy
is right at every incidence and every Kd. With c_b(θ) the part of the light that leaves after two
facets or more and b body events, none of which absorbs, and W the weight of a body event,

    f = Σ_b W^b c_b(θ_i) c_b(θ_o) / (π C_b),   C_b = 2 ∫ c_b(θ) cosθ sinθ dθ

is all of that (the shape of Kulla & Conty, SIGGRAPH 2017 course on physically based shading, for
each number of body events): its albedo is Σ_b W^b c_b(θ_i), the walk's. Azimuths are lost.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ... import seeds
from ...scene import Material, Roughness, Scene
from ..directions import direction
from ..registry import walk_of
from .parameters import slope_parameters, stream, walk_facet
from .simulate import MOST_EVENTS

Array = NDArray[np.float64]

POLAR = 31
"""Nodes, even in θ from 0 to 90°."""
BODIES = 12
"""Numbers of body events resolved, 0 to 11; more count as 11."""
_WALKS = 100_000  # of each node: 0.16 % of the light, one standard error, at most
_GRAZING = np.radians(89.9)


@lru_cache(8)
def later_orders(n: float, gamma: float, sigma: float) -> Array:
    """c_b(θ)/√(π C_b) of isotropic interfaced-Lambertian facets; the last few are remembered.

    Parameters
    ----------
    n, gamma, sigma : float
        Relative index ≥ 1; of the slopes γ > 3/2 and σ > 0.

    Returns
    -------
    array, shape (BODIES, POLAR)
        In sr^(−1/2): the products of two of them, of both directions, sum to f; 0 where no
        walk has as many body events.

    """
    scene = Scene(material=Material(n, (1.0,)), roughness=Roughness(gamma, (sigma,)))
    parameters, facet = slope_parameters(gamma, sigma, sigma), walk_facet(scene, 1.0)
    thetas = np.linspace(0, np.pi / 2, POLAR)
    parts = np.zeros((BODIES, POLAR))
    for k, theta in enumerate(np.minimum(thetas, _GRAZING)):
        exits, events = np.zeros((_WALKS, 3)), np.zeros((_WALKS, 2), np.int64)
        state = stream(seeds.generator(0, seeds.WALKS, k, 0))
        light = direction(theta, 0.0)
        walk_of("smith-walk").simulate(exits, events, MOST_EVENTS, light, parameters, facet, state)
        counted = events[(events[:, 0] > 1) & (events[:, 1] >= 0), 1]
        parts[:, k] = np.bincount(np.minimum(counted, BODIES - 1), minlength=BODIES) / _WALKS
    fine = np.linspace(0, np.pi / 2, 40 * POLAR)
    lines = np.stack([np.interp(fine, thetas, part) for part in parts])
    total = np.asarray(np.trapezoid(lines * np.sin(2 * fine), fine, axis=1))[:, None]
    return np.divide(parts, np.sqrt(np.pi * total), out=np.zeros_like(parts), where=total > 0)
