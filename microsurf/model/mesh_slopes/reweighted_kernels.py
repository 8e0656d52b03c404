# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators
# ruff: noqa: ANN001, ANN201 - numba finds the types
"""The Smith walk, compiled, with the weight each walk has under another distribution of slopes."""

import numpy as np

from ...jit import force_inlined
from ..random_walk.facet_kernels import OVER, scatter
from ..random_walk.smith_kernels import smith_step, visible_normal


@force_inlined
def bin_of(rho2, edges2):
    """Bin of ρ², where edges2 are the squared lower ends of the bins."""
    low, high = 0, len(edges2)
    while high - low > 1:
        middle = (low + high) // 2
        if edges2[middle] <= rho2:
            low = middle
        else:
            high = middle
    return low


@force_inlined
def kept(dx, dy, dz, length, parameters, table):
    """Weight of a free path under the other slopes: exp(−Δσ(−d) · length).

    Δσ = across · δ(c), δ tabulated over c/(1+c), c = |d_z|/across.
    """
    across = np.sqrt(2 * ((parameters.scale_x * dx) ** 2 + (parameters.scale_y * dy) ** 2))
    if across == 0:
        return 1.0
    index = abs(dz) / (abs(dz) + across) * (len(table) - 1)
    k = min(int(index), len(table) - 2)
    t = index - k
    return np.exp(-across * ((1 - t) * table[k] + t * table[k + 1]) * length)


@force_inlined
def weighted_walk(exits, events, weights, most, i, parameters, facet, edges2, ratios, table, state):
    """Walk as `smith_kernels.smith_walk`; weights, shape (walks,), are the walks' likelihoods.

    Each event multiplies them by the ratio of densities at its facet's ρ, each free path by
    that of its length; projected areas cancel between the two.
    """
    for k in range(len(exits)):
        dx, dy, dz = -i[0], -i[1], -i[2]
        h = 0.0
        order = body = 0
        weight = 1.0
        while True:
            gain, _ = smith_step(dx, dy, dz, parameters, state)
            if dz > 0 and not h + gain < 0:  # NaN is 0 · ∞: nothing left to meet
                weight *= kept(dx, dy, dz, -h / dz, parameters, table)
                break
            if order == most:
                body = OVER
                break
            weight *= kept(dx, dy, dz, gain / dz, parameters, table)
            h += gain
            mx, my, mz = visible_normal(-dx, -dy, -dz, parameters, state)
            x, y = mx / (parameters.scale_x * mz), my / (parameters.scale_y * mz)
            weight *= ratios[bin_of((x * x + y * y) / 2, edges2)]
            dx, dy, dz, body = scatter(dx, dy, dz, mx, my, mz, body, facet, state)
            order += 1
            if body < 0:
                break
        exits[k, 0], exits[k, 1], exits[k, 2] = dx, dy, dz
        events[k, 0], events[k, 1] = order, body
        weights[k] = weight
