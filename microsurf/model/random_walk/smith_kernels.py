# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators
# ruff: noqa: ANN001, ANN201 - numba finds the types
"""The random walks, compiled: one path of light at a time among facets that have no place.

Smith: Heitz et al., "Multiple-Scattering Microfacet BSDFs with the Smith Model", ACM
TOG 35(4), 2016, in an exponential half-space of heights h ≤ 0. Slopes are in units of
σ/√2 along each axis, as in `physics.visible_normals`. V-cavities: `vcavity_kernels`.
"""

import numpy as np

from ...jit import force_inlined
from ...physics.fresnel_kernels import reflected
from ...results import detector
from .facet_kernels import OVER, diffused, scatter, uniform

_FAR = 200.0  # beyond e^200 slopes are held as a ratio, so that their squares do not overflow


@force_inlined
def power_rise(u, exponent):
    """u^(−exponent) − 1 for u in (0, 1]."""
    if exponent == 2.0:
        return 1 / (u * u) - 1
    if exponent == 1.0:
        return 1 / u - 1
    return np.expm1(-exponent * np.log(u))


@force_inlined
def above(wz, across, parameters):
    """|w_z| Λ(|w_z|), across = |(scale_x w_x, scale_y w_y)|: what a ray that goes up can meet.

    Off by less than 1e−10 E times `across` (the table is interpolated by cubics).
    """
    if parameters.nu == 2.0:  # GGX: no table and no power
        return across * across / (np.sqrt(wz * wz + 2 * across * across) + wz)
    table = parameters.table
    index = wz / (wz + across) * (len(table) - 1)
    k = min(int(index), len(table) - 2)
    t = index - k
    s = 1 - t
    left = s * s * (table[k, 0] * (1 + 2 * t) + table[k, 1] * t)
    right = t * t * (table[k + 1, 0] * (1 + 2 * s) - table[k + 1, 1] * s)
    x2 = (wz / across) ** 2
    exponent = x2 if parameters.nu == np.inf else (parameters.nu - 1) * np.log1p(x2 / parameters.nu)
    return across * parameters.excess * np.exp(-exponent / 2) * (left + right)


@force_inlined
def radial_slope(nu, state):
    """Two slopes (p, q) of the distribution itself; each alone is Student's t_ν (Bailey 1994)."""
    while True:
        u, v = 2 * uniform(state) - 1, 2 * uniform(state) - 1
        w = u * u + v * v
        if 0 < w < 1:
            break
    factor = np.sqrt((-2 * np.log(w) if nu == np.inf else nu * power_rise(w, 2 / nu)) / w)
    return u * factor, v * factor


@force_inlined
def across_slope(p, unit, nu, state):
    """Slope q given p, both in 1/unit."""
    t = radial_slope(nu + 1, state)[0]
    return t * unit if nu == np.inf else t * np.sqrt((nu * unit * unit + p * p) / (nu + 1))


@force_inlined
def seen_from_above(wz, across, parameters, state):
    """Slopes (p, q) in 1/unit, and the unit, visible from c = w_z/across ≥ 0."""
    nu = parameters.nu
    total = wz + across * parameters.excess
    while True:  # a rejection starts again from the choice of the branch
        if uniform(state) * total < wz:
            p, q = radial_slope(nu, state)
            if p <= 0 or uniform(state) * wz < wz - p * across:
                return p, q, 1.0
        else:
            u = 1 - uniform(state)
            unit = 1.0
            if nu == np.inf:
                p = -np.sqrt(-2 * np.log(u))
            elif -2 * np.log(u) < _FAR * (nu - 1):
                p = -np.sqrt(nu * power_rise(u, 2 / (nu - 1)))
            else:
                p, unit = -np.sqrt(nu), np.exp(np.log(u) / (nu - 1))
            return p, across_slope(p, unit, nu, state), unit


@force_inlined
def seen_from_below(a, nu, state):
    """Slopes (p, q) in 1/unit, and the unit, seen from c = −a < 0 (`physics.visible_normals`)."""
    bound = 1 / (a * a) if nu == np.inf else (nu / (a * a) + 1) / (nu - 1)
    while True:
        s = -np.log(1 - uniform(state))
        level = 1.0
        if bound < 1:
            s -= np.log(1 - uniform(state))
            level = s * bound
        unit = 1.0
        if nu == np.inf:
            rise = 2 * s
        elif 2 * s < _FAR * (nu - 1):
            rise = (nu + a * a) * np.expm1(2 * s / (nu - 1))
        else:
            rise, unit = nu + a * a, np.exp(-s / (nu - 1))
        if unit < 1:
            if uniform(state) * level >= 1:
                continue
            p = -np.sqrt(rise)
        else:
            x = np.sqrt(a * a + rise)
            if uniform(state) * level >= rise / (x * (x + a)):
                continue
            p = -x
        return p, across_slope(p, unit, nu, state), unit


@force_inlined
def visible_normal(wx, wy, wz, parameters, state):
    """One normal m visible from w, as `physics.visible_normals.sample`."""
    ux, uy = parameters.scale_x * wx, parameters.scale_y * wy
    across = np.sqrt(ux * ux + uy * uy)
    if wz >= 0:
        p, q, unit = seen_from_above(wz, across, parameters, state)
    else:
        p, q, unit = seen_from_below(-wz / across, parameters.nu, state)
    cosine, sine = (ux / across, uy / across) if across > 0 else (1.0, 0.0)
    mx = -parameters.scale_x * (p * cosine - q * sine)
    my = -parameters.scale_y * (p * sine + q * cosine)
    norm = np.sqrt(mx * mx + my * my + unit * unit)
    return mx / norm, my / norm, unit / norm


@force_inlined
def smith_step(dx, dy, dz, parameters, state):
    """Height gained until the next facet, ∞ if there is none; and σ(−d)."""
    across = np.sqrt((parameters.scale_x * dx) ** 2 + (parameters.scale_y * dy) ** 2)
    area = above(abs(dz), across, parameters) + max(-dz, 0.0)
    return -np.log(1 - uniform(state)) * dz / area, area


@force_inlined
def smith_walk(exits, events, most, i, parameters, facet, state):
    """Walk ``len(exits)`` paths from light in direction i, at most ``most`` events each.

    Directions in which they leave go into exits, shape (walks, 3); numbers of facet
    events, and of body events or why there is no exit, into events, shape (walks, 2).
    """
    for k in range(len(exits)):
        dx, dy, dz = -i[0], -i[1], -i[2]
        h = 0.0
        order = body = 0
        while True:
            gain, _ = smith_step(dx, dy, dz, parameters, state)
            h += gain
            if dz > 0 and not h < 0:  # NaN is 0 · ∞: nothing left to meet
                break
            if order == most:
                body = OVER
                break
            mx, my, mz = visible_normal(-dx, -dy, -dz, parameters, state)
            dx, dy, dz, body = scatter(dx, dy, dz, mx, my, mz, body, facet, state)
            order += 1
            if body < 0:
                break
        exits[k, 0], exits[k, 1], exits[k, 2] = dx, dy, dz
        events[k, 0], events[k, 1] = order, body


@force_inlined
def mirrored(dx, dy, dz, area, ox, oy, oz, parameters):
    """Density in sr⁻¹ of mirror directions at o, D(h)/(4 σ(−d)), and the cosine at the facet."""
    hx, hy, hz = ox - dx, oy - dy, oz - dz
    norm = np.sqrt(hx * hx + hy * hy + hz * hz)
    if not (hz > 0 and norm > 0):
        return 0.0, 1.0
    t2 = (hx / (parameters.scale_x * hz)) ** 2 + (hy / (parameters.scale_y * hz)) ** 2
    log_kernel = (
        -t2 / 2
        if parameters.nu == np.inf
        else -(parameters.nu / 2 + 1) * np.log1p(t2 / parameters.nu)
    )
    height = 1 / (8 * np.pi * parameters.scale_x * parameters.scale_y * area)
    return height * np.exp(log_kernel - 4 * np.log(hz / norm)), norm / 2


@force_inlined
def smith_next_event(values, first, last, i, o, parameters, facet, state):
    """Estimate f cosθ_o of orders first … last, specular and body, shape (walks, 2).

    Walk k goes from i[k % len(i)]; at each facet it meets it adds what that facet sends
    towards o[k % len(o)], times the part that gets out. Returns the number of events.
    """
    total = 0
    for k in range(len(values)):
        ox, oy, oz = o[k % len(o)]
        dx, dy, dz = i[k % len(i)]
        dx, dy, dz = -dx, -dy, -dz
        across = np.sqrt((parameters.scale_x * ox) ** 2 + (parameters.scale_y * oy) ** 2)
        rate = above(oz, across, parameters) / oz  # Λ(o)
        h = specular = diffuse = 0.0
        order = body = 0
        while order < last:
            gain, area = smith_step(dx, dy, dz, parameters, state)
            h += gain
            if dz > 0 and not h < 0:
                break
            mx, my, mz = visible_normal(-dx, -dy, -dz, parameters, state)
            order += 1
            # Beyond BODY_EXACT events roulette takes the place of the weight.
            weight = facet.survival ** min(body, detector.BODY_EXACT)
            if order >= first:
                out = weight * np.exp(h * rate)
                if facet.interface:
                    density, mu = mirrored(dx, dy, dz, area, ox, oy, oz, parameters)
                    value = out * density * reflected(mu, facet)
                    if body == 0:
                        specular += value
                    else:
                        diffuse += value
                diffuse += out * diffused(dx, dy, dz, mx, my, mz, ox, oy, oz, facet)
            dx, dy, dz, body = scatter(dx, dy, dz, mx, my, mz, body, facet, state)
            if body < 0:
                break
        values[k, 0], values[k, 1] = specular, diffuse
        total += order
    return total
