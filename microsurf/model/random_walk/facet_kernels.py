# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators
# ruff: noqa: ANN001, ANN201 - numba finds the types
"""One facet, compiled: what it mirrors, what its substrate sends out, random numbers.

The formulas are those of `physics.facet`, one number at a time.
"""

import numpy as np

from ...jit import force_inlined
from ...physics.fresnel_kernels import passed, transmittance
from ...results import detector

ABSORBED, OVER = -1, -2  # ends of paths: in the substrate, or after the most events asked for


@force_inlined
def uniform(state):
    """Next number in [0, 1) of SFC64, as numpy's; inlined it takes a third of the time."""
    a, b, c = state[0], state[1], state[2]
    word = a + b + state[3]
    state[3] += np.uint64(1)
    state[0] = b ^ (b >> np.uint64(11))
    state[1] = c + (c << np.uint64(3))
    state[2] = ((c << np.uint64(24)) | (c >> np.uint64(40))) + word
    return (word >> np.uint64(11)) * 2.0**-53


@force_inlined
def body_exit(mx, my, mz, facet, state):
    """Direction of density ∝ T(o·m) o·m: a cosine lobe, from the sphere on the facet, thinned."""
    while True:
        u, v = 2 * uniform(state) - 1, 2 * uniform(state) - 1
        w = u * u + v * v
        if w >= 1:
            continue
        ring = 2 * np.sqrt(1 - w)
        x, y, z = mx + u * ring, my + v * ring, mz + 1 - 2 * w
        norm = np.sqrt(x * x + y * y + z * z)
        if norm < 1e-9:  # the point where the sphere touches: no direction
            continue
        x, y, z = x / norm, y / norm, z / norm
        if not facet.interface or uniform(state) * facet.bound < transmittance(norm / 2, facet.n):
            return x, y, z


@force_inlined
def scatter(dx, dy, dz, mx, my, mz, body, facet, state):
    """One facet event: new direction and number of body events, −1 if the light ends there."""
    mu = min(max(-(dx * mx + dy * my + dz * mz), 1e-300), 1.0)
    if not facet.interface or uniform(state) < passed(mu, facet):
        body += 1
        if not facet.substrate or (body > detector.BODY_EXACT and uniform(state) >= facet.survival):
            return dx, dy, dz, ABSORBED
        dx, dy, dz = body_exit(mx, my, mz, facet, state)
    else:
        dx, dy, dz = dx + 2 * mu * mx, dy + 2 * mu * my, dz + 2 * mu * mz
        norm = np.sqrt(dx * dx + dy * dy + dz * dz)
        dx, dy, dz = dx / norm, dy / norm, dz / norm
    return dx, dy, dz, body


@force_inlined
def diffused(dx, dy, dz, mx, my, mz, ox, oy, oz, facet):
    """Body light that facet m sends towards o, f_b^µ ⟨o·m⟩ in sr⁻¹."""
    mu_o = ox * mx + oy * my + oz * mz
    if not facet.substrate or mu_o <= 0:
        return 0.0
    through = 1.0
    if facet.interface:
        mu = min(max(-(dx * mx + dy * my + dz * mz), 0.0), 1.0)
        through = transmittance(mu, facet.n) * transmittance(mu_o, facet.n)
    return facet.survival * through * mu_o / (np.pi * facet.escape)
