"""All bounces between both facets of an infinitely long symmetric groove.

The model of Torrance and Sparrow, JOSA 57, 1967, with more than one bounce. Every groove,
whatever its slope, offers the light its opening; there facet a and its mirror image b
are seen in proportion to ⟨i·a⟩ and ⟨i·b⟩. The place on a facet is its distance t in
(0, 1] from the bottom of the groove. A ray that leaves a at t in direction d meets b at
t (d·a)/(−d·b), or passes above it if that is past 1. So the first order is exactly
that of the closed G, `physics.vcavity`.
"""

import numpy as np
from numpy.typing import NDArray

from .. import result
from ..physics import facet as facet_law
from ..physics import fresnel, std
from .walk_kernels import ABSORBED, OVER
from .walk_law import Facet

Array = NDArray[np.float64]

_ACROSS = np.array([-1.0, -1.0, 1.0])  # takes a facet to its mirror image


def vcavity_walk(
    exits: Array,
    events: NDArray[np.int64],
    most: int,
    i: Array,
    roughness: tuple[float, float, float],
    facet: Facet,
    rng: np.random.Generator,
) -> None:
    """Follow ``len(exits)`` paths of light from direction i, at most ``most`` events each.

    Directions in which they leave go into exits, shape (walks, 3); numbers of facet
    events, and of body events or why there is no exit, into events, shape (walks, 2).
    ``roughness`` is γ, σ_x, σ_y.
    """
    rows = np.arange(len(exits))
    a = std.normals(*std.sample_slopes(rng, len(exits), *roughness))
    chosen = rng.random(len(exits))
    to_a, to_b = np.maximum(a @ i, 0), np.maximum((a * _ACROSS) @ i, 0)
    other = chosen * (to_a + to_b) >= to_a
    a[other] *= _ACROSS
    to_a, to_b = a @ i, (a * _ACROSS) @ i
    # Light past the edge of b reaches a from t = −i·b/(i·a) upwards.
    shadow = np.maximum(-to_b / to_a, 0)
    t = 1 - rng.random(len(exits)) * (1 - shadow)
    towards = np.broadcast_to(i, a.shape)
    order, body = np.zeros(len(exits), np.int64), np.zeros(len(exits), np.int64)
    for _ in range(most):
        mu = np.clip(np.sum(towards * a, axis=-1), 0, 1)
        if facet.substrate:
            o, is_body = facet_law.sample(towards, a, facet.n, rng)
        else:
            o = facet_law.mirror(towards, a)
            is_body = rng.random(len(a)) < fresnel.transmittance(mu, facet.n)
        order, body = order + 1, body + is_body
        ends = is_body & (not facet.substrate)
        if facet.survival < 1:
            ends |= is_body & (body > result.BODY_EXACT) & (rng.random(len(a)) >= facet.survival)
        leaving = t * np.maximum(np.sum(o * a, axis=-1), 0)
        onto = -np.sum(o * (a * _ACROSS), axis=-1)
        out = ~ends & (leaving >= onto) & (o[:, 2] > 0)
        over = ends | out
        exits[rows[out]] = o[out]
        events[rows[over], 0] = order[over]
        events[rows[over], 1] = np.where(ends, ABSORBED, body)[over]
        rows, order, body = rows[~over], order[~over], body[~over]
        if not rows.size:
            return
        a, o = a[~over], o[~over]
        t = np.minimum(leaving[~over] / onto[~over], 1)
        a, towards = a * _ACROSS, -o
    events[rows, 0], events[rows, 1] = order, OVER
