# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators
# ruff: noqa: ANN001, ANN201 - numba finds the types
"""White furnace of the Smith walk: what its facets send out, *evaluated* in all directions.

At each event two directions are drawn, one uniformly over the hemisphere and one
mirrored at a visible normal, and weighed by the balance heuristic (Veach and Guibas,
SIGGRAPH 1995). So the estimate is bounded by the number of events. With uniform
directions alone its variance is infinite for γ ≤ 1.75, where D² is not integrable.
"""

import numpy as np

from ..jit import force_inlined
from ..model.random_walk.facet_kernels import diffused, scatter, uniform
from ..model.random_walk.smith_kernels import above, mirrored, smith_step, visible_normal
from ..physics.fresnel_kernels import transmittance


@force_inlined
def escape(h, ox, oy, oz, parameters):
    """G1(o, h): the chance to get away towards o from height h."""
    if oz <= 0:
        return 0.0
    across = np.sqrt((parameters.scale_x * ox) ** 2 + (parameters.scale_y * oy) ** 2)
    return np.exp(h * above(oz, across, parameters) / oz)


@force_inlined
def furnace(values, i, parameters, facet, state, cap):
    """Estimate ∫ f cosθ_o dω_o by each walk; ``cap`` events at most. Returns all events."""
    total = 0
    for k in range(len(values)):
        dx, dy, dz = -i[0], -i[1], -i[2]
        h = light = 0.0
        order = body = 0
        while order < cap:
            gain, area = smith_step(dx, dy, dz, parameters, state)
            h += gain
            if dz > 0 and not h < 0:
                break
            mx, my, mz = visible_normal(-dx, -dy, -dz, parameters, state)
            order += 1
            oz = uniform(state)
            azimuth = 2 * np.pi * uniform(state)
            ring = np.sqrt(1 - oz * oz)
            ox, oy = ring * np.cos(azimuth), ring * np.sin(azimuth)
            out = escape(h, ox, oy, oz, parameters)
            light += 2 * np.pi * out * diffused(dx, dy, dz, mx, my, mz, ox, oy, oz, facet)
            if facet.interface:
                density, mu = mirrored(dx, dy, dz, area, ox, oy, oz, parameters)
                weight = density / (density + 1 / (2 * np.pi))
                light += out * (1 - transmittance(mu, facet.n)) * weight
                mu = -(dx * mx + dy * my + dz * mz)
                ox, oy, oz = dx + 2 * mu * mx, dy + 2 * mu * my, dz + 2 * mu * mz
                density, mu = mirrored(dx, dy, dz, area, ox, oy, oz, parameters)
                weight = density / (density + 1 / (2 * np.pi))
                reflected = 1 - transmittance(min(mu, 1.0), facet.n)
                light += escape(h, ox, oy, oz, parameters) * reflected * weight
            dx, dy, dz, body = scatter(dx, dy, dz, mx, my, mz, body, facet, state)
            if body < 0:
                break
        values[k] = light
        total += order
    return total
