# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators
# ruff: noqa: ANN001, ANN201 - numba finds the types
"""Light between a rough interface and a rough substrate that know nothing of each other, compiled.

Position-free (Guo, Hašan, Zhao, "Position-Free Monte Carlo Simulation for Arbitrary Layered
BSDFs", ACM TOG 37(6), 2018): light that leaves one surface meets the other anywhere. Among the
facets of either it walks as in `smith_kernels`, through the interface as Heitz et al. (2016) do.
Light under the interface is described in a frame turned upside down. There the surface is
another of the same slopes, and the height h = ln C1 becomes ln(1 − e^h), for what is
above a height of one is below it in the other.
"""

import numpy as np

from ...jit import force_inlined
from ...physics.fresnel_kernels import transmittance
from .facet_kernels import OVER, scatter, uniform
from .smith_kernels import smith_step, visible_normal

OUTSIDE, BELOW, SUBSTRATE = 0, 1, 2
"""Where light is: over the interface, under it, over the substrate."""
_DEEPEST = -700.0  # h of less than 1e−300 of the facets


@force_inlined
def onward(h, dx, dy, dz, slopes, state):
    """Height of the next facet, and whether there is none, so that light leaves upwards."""
    if slopes.scale_x == 0:
        return 0.0, dz > 0  # a plane
    gain, _ = smith_step(dx, dy, dz, slopes, state)
    h += gain
    return h, dz > 0 and not h < 0


@force_inlined
def facet_ahead(dx, dy, dz, slopes, state):
    """Normal of a facet that light going along d meets."""
    if slopes.scale_x == 0:
        return 0.0, 0.0, 1.0
    return visible_normal(-dx, -dy, -dz, slopes, state)


@force_inlined
def other_side(h):
    """The height in the frame turned upside down."""
    return max(np.log(-np.expm1(h)), _DEEPEST) if h < 0 else _DEEPEST


@force_inlined
def squared_cosine(mu, ratio):
    """Squared cosine of refracted light; ``ratio`` of the indices before and behind; ≤ 0: total."""
    return (1 - ratio) * (1 + ratio) + (ratio * mu) ** 2


@force_inlined
def refract(dx, dy, dz, mx, my, mz, mu, through, ratio):
    """Direction behind a facet met at −d·m = μ and left at the cosine ``through``."""
    bend = ratio * mu - through
    dx, dy, dz = ratio * dx + bend * mx, ratio * dy + bend * my, ratio * dz + bend * mz
    norm = np.sqrt(dx * dx + dy * dy + dz * dz)
    return dx / norm, dy / norm, dz / norm


@force_inlined
def passes(mu, squared, side, interface, state):
    """Whether light passes: T is the same both ways, that of the cosine outside."""
    if not interface.interface:
        return True
    outside = mu if side == OUTSIDE else np.sqrt(max(squared, 0.0))
    return squared > 0 and uniform(state) < transmittance(min(outside, 1.0), interface.n)


@force_inlined
def interface_event(dx, dy, dz, mx, my, mz, side, interface, state):
    """Direction after a hit on the interface, and whether light has passed."""
    mu = min(max(-(dx * mx + dy * my + dz * mz), 1e-300), 1.0)
    ratio = 1 / interface.n if side == OUTSIDE else interface.n
    squared = squared_cosine(mu, ratio)
    if passes(mu, squared, side, interface, state):
        through = np.sqrt(max(squared, 0.0))
        dx, dy, dz = refract(dx, dy, dz, mx, my, mz, mu, through, ratio)
        return dx, dy, dz, True
    dx, dy, dz = dx + 2 * mu * mx, dy + 2 * mu * my, dz + 2 * mu * mz
    norm = np.sqrt(dx * dx + dy * dy + dz * dz)
    return dx / norm, dy / norm, dz / norm, False


@force_inlined
def layered_walk(exits, events, most, i, slopes, facets, state):
    """Walk ``len(exits)`` paths from light in direction i, at most ``most`` facet events each.

    Into exits, shape (walks, 4), go the directions in which they leave, and the length between
    the layers in units of the gap. Into events, shape (walks, 5), numbers of hits on the interface
    from outside; body events (0 never inside, else one more than substrate events, or why there
    is no exit); entries; hits from below; and facet events in all.
    """
    upper, lower = slopes
    interface, substrate = facets
    for k in range(len(exits)):
        dx, dy, dz = -i[0], -i[1], -i[2]
        side = OUTSIDE
        h = length = 0.0
        order = body = entries = hits = total = 0
        while True:
            of_side = lower if side == SUBSTRATE else upper
            h, leaves = onward(h, dx, dy, dz, of_side, state)
            if leaves:
                if side == OUTSIDE:
                    break
                # Through the gap, and down onto the other surface.
                length += 1 / dz
                side = SUBSTRATE if side == BELOW else BELOW
                dz, h = -dz, 0.0
                continue
            if total == most:
                body = OVER
                break
            total += 1
            mx, my, mz = facet_ahead(dx, dy, dz, of_side, state)
            if side == SUBSTRATE:
                dx, dy, dz, body = scatter(dx, dy, dz, mx, my, mz, body, substrate, state)
                if body < 0:
                    break
                continue
            order += side == OUTSIDE
            hits += side == BELOW
            dx, dy, dz, passed = interface_event(dx, dy, dz, mx, my, mz, side, interface, state)
            if passed:
                entries += side == OUTSIDE
                body = max(body, 1)
                side = BELOW if side == OUTSIDE else OUTSIDE
                dz, h = -dz, other_side(h)
        exits[k, 0], exits[k, 1], exits[k, 2], exits[k, 3] = dx, dy, dz, length
        events[k, 0], events[k, 1], events[k, 2] = order, body, entries
        events[k, 3], events[k, 4] = hits, total
