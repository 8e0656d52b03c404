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
from ...physics.fresnel_kernels import reflected, transmittance
from ...results import detector
from .facet_kernels import OVER, diffused, scatter, uniform
from .smith_kernels import above, mirrored, smith_step, visible_normal

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
def through_gap(dz, side, length):
    """Light that has left one surface goes on down onto the other: d_z, side, and length."""
    return -dz, SUBSTRATE if side == BELOW else BELOW, length + 1 / dz


@force_inlined
def after_hit(dx, dy, dz, mx, my, mz, h, side, body, facets, state):
    """Direction, height, side and body events after a hit; the latter < 0 if light ends there."""
    interface, substrate, _ = facets
    if side == SUBSTRATE:
        dx, dy, dz, body = scatter(dx, dy, dz, mx, my, mz, body, substrate, state)
        return dx, dy, dz, h, side, body
    dx, dy, dz, passed = interface_event(dx, dy, dz, mx, my, mz, side, interface, state)
    if passed:
        side = BELOW if side == OUTSIDE else OUTSIDE
        return dx, dy, -dz, other_side(h), side, max(body, 1)
    return dx, dy, dz, h, side, body


@force_inlined
def layered_walk(exits, events, most, i, slopes, facets, state):
    """Walk ``len(exits)`` paths from light in direction i, at most ``most`` facet events each.

    Into exits, shape (walks, 4), go the directions in which they leave, and the length between
    the layers in units of the gap. Into events, shape (walks, 5), numbers of hits on the interface
    from outside; body events (0 never inside, else one more than substrate events, or why there
    is no exit); entries; hits from below; and facet events in all.
    """
    upper, lower = slopes
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
                dz, side, length = through_gap(dz, side, length)
                h = 0.0
                continue
            if total == most:
                body = OVER
                break
            total += 1
            mx, my, mz = facet_ahead(dx, dy, dz, of_side, state)
            outside = side == OUTSIDE
            order += outside
            hits += side == BELOW
            dx, dy, dz, h, side, body = after_hit(
                dx, dy, dz, mx, my, mz, h, side, body, facets, state
            )
            if body < 0:
                break
            entries += outside and side == BELOW
        exits[k, 0], exits[k, 1], exits[k, 2], exits[k, 3] = dx, dy, dz, length
        events[k, 0], events[k, 1], events[k, 2] = order, body, entries
        events[k, 3], events[k, 4] = hits, total


@force_inlined
def escape_rate(oz, ox, oy, slopes):
    """Λ(o): from the height h the part exp(h Λ) gets out."""
    across = np.sqrt((slopes.scale_x * ox) ** 2 + (slopes.scale_y * oy) ** 2)
    return above(oz, across, slopes) / oz if across > 0 else 0.0


@force_inlined
def bent_density(dx, dy, dz, area, ox, oy, oz, n, slopes):
    """Density in sr⁻¹ of refracted directions at o, and the cosine of o at the facet; o_z < 0.

    D_w(m) |dω_m/dω_o| of the facet m ∝ n w + o that bends w = −d to o (Walter et al. 2007,
    eqs. 16 and 17), with D_w(m) = ⟨w, m⟩ D(m)/σ(w).
    """
    hx, hy, hz = ox - n * dx, oy - n * dy, oz - n * dz
    norm = np.sqrt(hx * hx + hy * hy + hz * hz)
    if not (hz > 0 and norm > 0):
        return 0.0, 1.0
    mx, my, mz = hx / norm, hy / norm, hz / norm
    inner, outer = -(dx * mx + dy * my + dz * mz), -(ox * mx + oy * my + oz * mz)
    if not (inner > 0 and outer > 0):
        return 0.0, 1.0
    t2 = (mx / (slopes.scale_x * mz)) ** 2 + (my / (slopes.scale_y * mz)) ** 2
    log_kernel = -t2 / 2 if slopes.nu == np.inf else -(slopes.nu / 2 + 1) * np.log1p(t2 / slopes.nu)
    height = inner * outer / (2 * np.pi * slopes.scale_x * slopes.scale_y * area * norm * norm)
    return height * np.exp(log_kernel - 4 * np.log(mz)), min(outer, 1.0)


@force_inlined
def seen_through_plane(dx, dy, dz, mx, my, mz, h, ox, oy, oz, slopes, facets):
    """f cosθ_o of a substrate's facet seen through an interface that does not scatter."""
    interface, substrate, _ = facets
    ratio = 1 / interface.n
    inner = np.sqrt(squared_cosine(oz, ratio))
    ix, iy = ratio * ox, ratio * oy
    out = np.exp(h * escape_rate(inner, ix, iy, slopes.substrate)) if h < 0 else 1.0
    if interface.interface:
        out *= transmittance(oz, interface.n)
    narrowed = ratio * ratio * oz / inner  # dω inside over dω outside
    return narrowed * out * diffused(dx, dy, dz, mx, my, mz, ix, iy, inner, substrate), inner


@force_inlined
def sent(dx, dy, dz, mx, my, mz, h, length, side, ox, oy, oz, rate, slopes, facets):
    """f cosθ_o of one event: of a rough interface's, or through a plane of the substrate's."""
    upper = slopes.interface
    interface, _, thickness = facets
    if upper.scale_x == 0:
        if side != SUBSTRATE:
            return 0.0
        light, inner = seen_through_plane(dx, dy, dz, mx, my, mz, h, ox, oy, oz, slopes, facets)
        return light * np.exp(-thickness * (length + 1 / inner))
    if side == SUBSTRATE:
        return 0.0
    across = np.sqrt((upper.scale_x * dx) ** 2 + (upper.scale_y * dy) ** 2)
    area = above(abs(dz), across, upper) + max(-dz, 0.0)
    left = np.exp(-thickness * length)
    if side == OUTSIDE:
        density, mu = mirrored(dx, dy, dz, area, ox, oy, oz, upper)
        return left * density * np.exp(h * rate) * reflected(mu, interface)
    density, mu = bent_density(dx, dy, dz, area, ox, oy, -oz, interface.n, upper)
    return left * density * np.exp(other_side(h) * rate) * transmittance(mu, interface.n)


@force_inlined
def layered_next_event(values, first, last, i, o, slopes, facets, state):
    """Estimate f cosθ_o of orders first … last, specular and body, shape (walks, 2).

    Walk k goes from i[k % len(i)]; at each hit on the interface it adds what is reflected
    there, or refracted from below, towards o[k % len(o)], times the part that gets out. A plane
    sends light one way only: through it substrate's facets are seen, and what it mirrors is left
    out. Returns the number of events.
    """
    upper, lower = slopes
    _, substrate, _ = facets
    total = 0
    for k in range(len(values)):
        ox, oy, oz = o[k % len(o)]
        dx, dy, dz = i[k % len(i)]
        dx, dy, dz = -dx, -dy, -dz
        rate = escape_rate(oz, ox, oy, upper)
        side = OUTSIDE
        h = length = specular = diffuse = 0.0
        order = body = 0
        while True:
            of_side = lower if side == SUBSTRATE else upper
            h, leaves = onward(h, dx, dy, dz, of_side, state)
            if leaves:
                if side == OUTSIDE:
                    break
                dz, side, length = through_gap(dz, side, length)
                h = 0.0
                continue
            if side == OUTSIDE and order == last:
                break
            total += 1
            order += side == OUTSIDE
            mx, my, mz = facet_ahead(dx, dy, dz, of_side, state)
            # Beyond BODY_EXACT events roulette takes the place of the weight.
            weight = substrate.survival ** max(min(body, detector.BODY_EXACT) - 1, 0)
            weight *= order >= first
            light = weight * sent(
                dx, dy, dz, mx, my, mz, h, length, side, ox, oy, oz, rate, slopes, facets
            )
            if body == 0:
                specular += light
            else:
                diffuse += light
            dx, dy, dz, h, side, body = after_hit(
                dx, dy, dz, mx, my, mz, h, side, body, facets, state
            )
            if body < 0:
                break
        values[k, 0], values[k, 1] = specular, diffuse
    return total
