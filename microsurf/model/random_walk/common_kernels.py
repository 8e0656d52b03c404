# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators
# ruff: noqa: ANN001, ANN201 - numba finds the types
"""Smith's walk with common random numbers, light by its body events; see `by_body`.

Every walk has a stream of its own, seeded by its place: where parameters change a little, most
walks change a little, and a fit can follow.
"""

import numpy as np

from ...jit import force_inlined
from ...physics.fresnel_kernels import reflected
from .facet_kernels import diffused, scatter
from .smith_kernels import above, mirrored, smith_step, visible_normal


@force_inlined
def seeded(state, seed, pair, walk):
    """Fill the state of an SFC64 by SplitMix64 of three numbers."""
    word = (seed * np.uint64(0x9E3779B97F4A7C15)) ^ (pair * np.uint64(0xD1B54A32D192ED03))
    word ^= walk * np.uint64(0x8CB92BA72F3D8DD7)
    for k in range(3):
        word += np.uint64(0x9E3779B97F4A7C15)
        z = word
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        state[k] = z ^ (z >> np.uint64(31))
    state[3] = np.uint64(1)


@force_inlined
def smith_by_body(sums, walks, seed, first, last, i, o, parameters, facet):
    """Add f cosθ_o of orders first … last by body events, shape (pairs, events).

    As `smith_next_event` with its weights left out: light after b body events stands in
    column b, the last holds all beyond. The facet's substrate must be white.
    """
    state = np.empty(4, np.uint64)
    most = sums.shape[1] - 1
    for k in range(len(i)):
        ox, oy, oz = o[k]
        across = np.sqrt((parameters.scale_x * ox) ** 2 + (parameters.scale_y * oy) ** 2)
        rate = above(oz, across, parameters) / oz  # Λ(o)
        for walk in range(walks):
            seeded(state, seed, np.uint64(k), np.uint64(walk))
            dx, dy, dz = i[k]
            dx, dy, dz = -dx, -dy, -dz
            h = 0.0
            order = body = 0
            while order < last:
                gain, area = smith_step(dx, dy, dz, parameters, state)
                h += gain
                if dz > 0 and not h < 0:
                    break
                mx, my, mz = visible_normal(-dx, -dy, -dz, parameters, state)
                order += 1
                if order >= first:
                    out = np.exp(h * rate)
                    if facet.interface:
                        density, mu = mirrored(dx, dy, dz, area, ox, oy, oz, parameters)
                        sums[k, min(body, most)] += out * density * reflected(mu, facet)
                    sent = diffused(dx, dy, dz, mx, my, mz, ox, oy, oz, facet)
                    sums[k, min(body + 1, most)] += out * sent
                dx, dy, dz, body = scatter(dx, dy, dz, mx, my, mz, body, facet, state)
                if body < 0:
                    break
