# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators
# ruff: noqa: ANN001, ANN201 - numba finds the types
"""Light between both facets of a V-cavity, sent towards one direction o, compiled.

Facet a faces the azimuth of u, b is its mirror image, w = π − 2 tilt is the angle
between them, and the place on a facet is its distance t in (0, 1] from the bottom, as in
`smith_kernels`. Across the V-cavity β in (0, π) is the angle of a direction from u upwards,
and s = √(u² + z²) the length of what it has there. Unfolded at its mirrors a path is
straight, and the facets are rays from the bottom w apart. So light that leaves towards o
from the last facet, a if the number j of mirrors before it is even (else β is π − β),

    met that facet at cosine s cos(β − w/2), those before at s cos(β − (m + ½) w),
    left the first at the place t if max(0, cos(β + w/2)) ≤ t cos(β − (j + ½) w) ≤ cos(β − w/2).

Chains of mirrors alone then have a density in closed form. k mirrors send i to o only if
w = (β_i + β_o)/k with u along the horizontal part H of i + o, or against it, and
dω_o = 2k |H| dθ dφ for a V-cavity of tilt θ and azimuth φ. With P22 the density of slopes,

    f cosθ_o = Σ_k Σ_±u P22 tanθ/(cos³θ 2k |H|) (s/i_z) V Π F,
    V = min(cos(β_i − w/2), cos(β_o − w/2)) − max(0, cos(β_i + w/2), cos(β_o + w/2)),

where V > 0. One mirror is F D(h) G/(4 i_z), G of Torrance and Sparrow (1967). More are
without bound as 1/|H| about the mirror direction, to which V-cavities of any azimuth send
light; what a cone of directions receives is finite.
"""

import numpy as np

from ...jit import force_inlined
from ...physics.fresnel_kernels import reflected
from ...results import detector
from .facet_kernels import OVER, diffused, scatter, uniform
from .smith_kernels import mirrored, radial_slope

SUMMED = 32
"""Mirrors of a chain up to which its terms are summed, and beyond which they are drawn."""
_APART = 1e-9  # least |H|: to this unit vectors are checked


@force_inlined
def mirrored_part(slant, angle, width, count, facet):
    """Π F of ``count`` mirrors, met at cosines slant · cos(angle − m width)."""
    light = 1.0
    for m in range(count):
        mu = slant * np.cos(angle - m * width)
        light *= reflected(min(max(mu, 1e-300), 1.0), facet)
    return light


@force_inlined
def illuminated(beta_i, beta_o, width):
    """V, its differences of cosines as products: of grazing light they would leave no digit."""
    half = np.sin(width / 2)
    both, apart = np.sin((beta_i + beta_o) / 2), beta_i - beta_o
    return min(
        np.cos(beta_i - width / 2),
        np.cos(beta_o - width / 2),
        2 * np.sin(beta_i) * half,
        2 * np.sin(beta_o) * half,
        2 * both * np.sin((width - abs(apart)) / 2),
    )


@force_inlined
def chain(k, ix, iy, iz, ox, oy, oz, parameters, facet):
    """f cosθ_o of exactly k mirrors; of one as F D(h) G/(4 i_z), exact at grazing too.

    Within 1e−9 of the mirror direction k > 1 has the value at 1e−9 and azimuth across i.
    This is about its mean over the directions nearer than 2e−9.
    """
    if k == 1:
        density, mu = mirrored(-ix, -iy, -iz, iz, ox, oy, oz, parameters)
        masking = min(1.0, (iz + oz) * min(iz, oz) / (mu * mu))
        return density * masking * reflected(min(mu, 1.0), facet)
    hx, hy = ix + ox, iy + oy
    apart = np.sqrt(hx * hx + hy * hy)
    if apart < _APART:
        hx, hy = (-iy, ix) if ix != 0 or iy != 0 else (1.0, 0.0)
    norm = np.sqrt(hx * hx + hy * hy)
    ux, uy = hx / norm, hy / norm
    total = 0.0
    for _side in range(2):
        along_i, along_o = ix * ux + iy * uy, ox * ux + oy * uy
        beta_i = np.arctan2(iz, along_i)
        beta_o = np.arctan2(oz, along_o if k % 2 == 1 else -along_o)
        width = (beta_i + beta_o) / k
        part = illuminated(beta_i, beta_o, width)
        if part > 0:
            up, across = np.sin(width / 2), np.cos(width / 2)  # cosθ, sinθ
            x, y = across / up * ux / parameters.scale_x, across / up * uy / parameters.scale_y
            t2 = x * x + y * y
            log_kernel = (
                -t2 / 2
                if parameters.nu == np.inf
                else -(parameters.nu / 2 + 1) * np.log1p(t2 / parameters.nu)
            )
            density = np.exp(log_kernel - 4 * np.log(up)) / (
                2 * np.pi * parameters.scale_x * parameters.scale_y
            )
            slant = np.sqrt(along_i * along_i + iz * iz)
            light = mirrored_part(slant, beta_i - width / 2, width, k, facet)
            total += density * across * slant / iz * part * light
        ux, uy = -ux, -uy
    return total / (2 * k * max(apart, _APART))


@force_inlined
def more_mirrors(values, first, last, ix, iy, iz, ox, oy, oz, parameters, facet, state):
    """Unbiased estimates of f cosθ_o beyond SUMMED mirrors: k is reached by roulette (SUMMED/k)².

    A ray that turns round in a V-cavity meets it at cosines that do not depend on k, where
    F < 1: the terms fall faster than any power, and the variance is finite. V > 0 asks
    for |β_i − β_o| < w, so that most pairs of directions have no long chains at all.
    """
    values[:] = 0
    chances = np.empty(len(values))
    least = 1.0
    for draw in range(len(values)):
        chances[draw] = 1 - uniform(state)
        least = min(least, chances[draw])
    k = max(first, SUMMED + 1)
    while k <= last and least * k * k < SUMMED * SUMMED:
        value = chain(k, ix, iy, iz, ox, oy, oz, parameters, facet)
        if value > 0:
            for draw in range(len(values)):
                if chances[draw] * k * k < SUMMED * SUMMED:
                    values[draw] += value * (k / SUMMED) ** 2
        k += 1


@force_inlined
def mirrors(means, errors, draws, first, last, i, o, parameters, facet, state):
    """f cosθ_o of chains of first … last mirrors for each pair, and its standard error."""
    values = np.empty(draws)
    for pair in range(len(means)):
        ix, iy, iz = i[pair]
        ox, oy, oz = o[pair]
        total = 0.0
        for k in range(first, min(last, SUMMED) + 1):
            total += chain(k, ix, iy, iz, ox, oy, oz, parameters, facet)
        if last > SUMMED:
            more_mirrors(values, first, last, ix, iy, iz, ox, oy, oz, parameters, facet, state)
            total += values.mean()
            errors[pair] = values.std() / np.sqrt(draws - 1)
        means[pair] = total


@force_inlined
def sent(first, last, t, dx, dy, dz, ax, ay, az, ox, oy, oz, facet, state):
    """Body light from the place t of a, through first … last mirrors of the V-cavity, towards o.

    Beyond SUMMED mirrors j is reached by roulette SUMMED/j. A ray from one place fits few
    j, the longest about π/w: the variance is finite as the mean slope is, for γ > 3/2.
    """
    across = np.sqrt(ax * ax + ay * ay)
    ux, uy = (ax / across, ay / across) if across > 0 else (1.0, 0.0)
    width = 2 * np.arctan2(az, across)
    along = ox * ux + oy * uy
    slant = np.sqrt(along * along + oz * oz)
    chance = uniform(state)
    total = 0.0
    j = first
    while j <= last and j * width < np.pi and (j <= SUMMED or chance * j < SUMMED):
        beta = np.arctan2(oz, along if j % 2 == 0 else -along)
        out, beyond = np.cos(beta - width / 2), np.cos(beta + width / 2)
        mu = np.cos(beta - (j + 0.5) * width)
        if mu > 0 and max(beyond, 0.0) <= t * mu <= out:
            light = max(1.0, j / SUMMED) * mirrored_part(slant, beta - width / 2, width, j, facet)
            mu *= slant  # of o unfolded at a, of which nothing else matters there
            light *= diffused(dx, dy, dz, ax, ay, az, mu * ax, mu * ay, mu * az, facet)
            total += light
        j += 1
    return total


@force_inlined
def enter(dx, dy, dz, parameters, state):
    """Facet a that light going along d meets first in a V-cavity, and the place t where."""
    # A V-cavity offers the light its opening, whatever its slope: the distribution itself.
    p, q = radial_slope(parameters.nu, state)
    ax, ay = -parameters.scale_x * p, -parameters.scale_y * q
    norm = np.sqrt(ax * ax + ay * ay + 1)
    ax, ay, az = ax / norm, ay / norm, 1 / norm
    to_a, to_b = -(dx * ax + dy * ay + dz * az), dx * ax + dy * ay - dz * az
    # One of both faces the light at least; each is seen in proportion to its cosine.
    if uniform(state) * (max(to_a, 0.0) + max(to_b, 0.0)) >= to_a:
        ax, ay, to_a, to_b = -ax, -ay, to_b, to_a
    # Light past the edge of b reaches a from t = −i·b/(i·a) upwards.
    return ax, ay, az, 1 - uniform(state) * (1 - max(-to_b / to_a, 0.0))


@force_inlined
def cross(t, dx, dy, dz, ax, ay, az):
    """Place on the other facet where a ray from t of a meets it, 0 if it leaves the V-cavity."""
    leaving = t * max(dx * ax + dy * ay + dz * az, 0.0)
    towards = dx * ax + dy * ay - dz * az
    if dz > 0 and leaving >= towards:
        return 0.0
    return max(min(leaving / towards, 1.0), 5e-324)


@force_inlined
def vcavity_walk(exits, events, most, i, parameters, facet, state):
    """As `smith_kernels.smith_walk`, between both facets of a V-cavity (Torrance, Sparrow 1967)."""
    for k in range(len(exits)):
        dx, dy, dz = -i[0], -i[1], -i[2]
        ax, ay, az, t = enter(dx, dy, dz, parameters, state)
        order = body = 0
        while t > 0:
            if order == most:
                body = OVER
                break
            dx, dy, dz, body = scatter(dx, dy, dz, ax, ay, az, body, facet, state)
            order += 1
            if body < 0:
                break
            t = cross(t, dx, dy, dz, ax, ay, az)
            ax, ay = -ax, -ay
        exits[k, 0], exits[k, 1], exits[k, 2] = dx, dy, dz
        events[k, 0], events[k, 1] = order, body


@force_inlined
def vcavity_next_event(values, first, last, i, o, parameters, facet, state):
    """Estimate f cosθ_o of orders first … last with body events, into values[:, 1].

    Walk k goes from i[k % len(i)] as in `vcavity_walk`; at each facet it meets it adds
    what a body event there sends towards o[k % len(o)].
    """
    for k in range(len(values)):
        ox, oy, oz = o[k % len(o)]
        dx, dy, dz = i[k % len(i)]
        dx, dy, dz = -dx, -dy, -dz
        ax, ay, az, t = enter(dx, dy, dz, parameters, state)
        order = body = 0
        total = 0.0
        while t > 0 and order < last:
            order += 1
            # Beyond BODY_EXACT events roulette takes the place of the weight.
            weight = facet.survival ** min(body, detector.BODY_EXACT)
            least, most = max(first - order, 0), last - order if facet.interface else 0
            total += weight * sent(least, most, t, dx, dy, dz, ax, ay, az, ox, oy, oz, facet, state)
            dx, dy, dz, body = scatter(dx, dy, dz, ax, ay, az, body, facet, state)
            if body < 0:
                break
            t = cross(t, dx, dy, dz, ax, ay, az)
            ax, ay = -ax, -ay
        values[k, 1] = total
