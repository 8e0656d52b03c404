"""What happens to each ray between two calls of Embree, compiled: the loop where rays scatter.

A light ray is *split* at its first facet: one path is mirrored with weight F, the rest T
comes out of the substrate as a fan, see `lobe_fans` (splitting: Arvo & Kirk 1990, "Particle
transport and image synthesis"). The weights add up to the light ray's, so energy is conserved
ray by ray. At later facets a path draws one of both.
"""

import numpy as np

from ...jit import compiled, inlined
from ...physics.fresnel_kernels import passed, transmittance
from ...results import detector
from .empty_space import push_ray
from .intersection import CONTINUES, ESCAPED, ON_FACET, classify_ray
from .lobe_fans import (
    COS_PHI,
    FAN,
    LAST_THETA,
    NORMAL_T,
    NORMAL_Z,
    RANDOM,
    SIN_PHI,
    START_X,
    START_Y,
    START_Z,
    like,
    next_probe,
    probe,
    ring_of,
    sector_of,
    unfold,
)
from .state import ABSORBED, BATCH, BODY, FAN_RING, HIGH_RING, LEFT_OUT, LOW_RING, ORDER, RETRIES


@compiled
def _body_direction(mx, my, mz, facet, bound, rng):
    """Direction of light that leaves the substrate: ∝ T(μ_o) μ_o about the normal.

    A uniform point of the sphere that touches the facet is a cosine lobe; kept ∝ T(μ_o)
    it leaves every body event the same weight.
    """
    while True:
        s = 2 * rng.random() - 1
        azimuth = 2 * np.pi * rng.random()
        ring = np.sqrt(1 - s * s)
        dx, dy, dz = mx + ring * np.cos(azimuth), my + ring * np.sin(azimuth), mz + s
        norm = np.sqrt(dx * dx + dy * dy + dz * dz)
        if norm > 1e-9:
            dx, dy, dz = dx / norm, dy / norm, dz / norm
            if not facet.interface:
                return dx, dy, dz
            mu = dx * mx + dy * my + dz * mz
            if mu > 0 and rng.random() * bound < transmittance(mu, facet.n):
                return dx, dy, dz


@inlined
def mirror(dx, dy, dz, mx, my, mz, mu):
    """Direction of a ray after a mirror; μ is the cosine of incidence."""
    dx, dy, dz = dx + 2 * mu * mx, dy + 2 * mu * my, dz + 2 * mu * mz
    norm = np.sqrt(dx * dx + dy * dy + dz * dz)
    return dx / norm, dy / norm, dz / norm


@inlined
def arrive(tallies, dx, dy, dz, weight, order, body, batch, bins):
    """Count what reaches the detector."""
    row = min(order, 4) - 1
    if body > detector.BODY_EXACT:
        body = np.searchsorted(bins.body_edges, body, "right") - 1
    ring = ring_of(dz, bins.ring_cosines)
    sector = sector_of(dx, dy, bins.azimuth)
    tallies.energy[body, row, sector, ring] += weight
    tallies.batches[batch, row, body] += weight
    if order == 1:
        tallies.squares[body, sector, ring] += weight * weight


@compiled
def scatter_batch(active, rays, next_rays, hits, grid, frame, scattering, bins, fans, tallies, rng):
    """Scatter each active ray at its facet; what goes on is pushed to ``next_rays``.

    A ray that only grazes a ridge, hit from behind at its edge, goes on as it was.
    Returns the number of rays that go on, of those among them that have met no facet
    yet, of grazes, and of rays that fell through an edge and are sent again.
    """
    facet, fan = scattering.facet, fans.numbers
    alive = unmet = grazes = leaks = 0
    for r in range(active):
        dx, dy, dz = rays.directions[r, 0], rays.directions[r, 1], rays.directions[r, 2]
        order, body, batch = rays.state[r, ORDER], rays.state[r, BODY], rays.state[r, BATCH]
        tried = rays.state[r, FAN_RING]  # the ring of a fan's ray, −1 for any other ray
        weight = rays.weight[r]
        status, grazed, again, mx, my, mz, mu, px, py, pz, wraps = classify_ray(
            r, rays, hits, grid, frame, tried < 0
        )
        if status == ON_FACET and order >= 1 and tried < 0 and not facet.multiple_scattering:
            status = LEFT_OUT
        if status == CONTINUES:
            push_ray(next_rays, alive, px, py, pz, dx, dy, dz, weight, order, body, wraps, batch)
            for j in range(LOW_RING, FAN_RING + 1):
                next_rays.state[alive, j] = rays.state[r, j]
            next_rays.state[alive, RETRIES] = again
            if tried >= 0:
                for j in range(FAN):
                    next_rays.fan[alive, j] = rays.fan[r, j]
            alive += 1
            unmet += order == 0
            grazes += grazed
            leaks += again > rays.state[r, RETRIES]
            continue
        if status >= 0:
            tallies.ended[status] += weight
            tallies.lost[status] += 1 if order > 0 else scattering.branches
            continue
        if tried >= 0:
            for j in range(FAN):
                fan[j] = rays.fan[r, j]
            low, high = rays.state[r, LOW_RING], rays.state[r, HIGH_RING]
            if status == ESCAPED:
                low = tried + 1
            else:
                high = tried
            alive = _search(
                low, high, weight, batch, grid, facet, bins, fans, tallies, rng, next_rays, alive
            )
            continue
        if status == ESCAPED:
            arrive(tallies, dx, dy, dz, weight, order, body, batch, bins)
            continue

        mu = min(max(mu, 1e-12), 1.0)
        through = passed(mu, facet) if facet.interface else 1.0
        mirrored = facet.interface
        scattered = facet.substrate
        mirror_weight = weight
        if order == 0:
            mirror_weight = (1 - through) * weight
            if not scattered:
                tallies.ended[ABSORBED] += through * weight
        else:
            mirrored = mirrored and rng.random() >= through
            scattered = scattered and not mirrored
            if scattered and body >= detector.BODY_EXACT:
                scattered = rng.random() < facet.survival
            if not mirrored and not scattered:
                tallies.ended[ABSORBED] += weight
        if mirrored:
            ox, oy, oz = mirror(dx, dy, dz, mx, my, mz, mu)
            if oz > 0 and pz >= frame.top:
                arrive(tallies, ox, oy, oz, mirror_weight, order + 1, body, batch, bins)
            else:
                push_ray(
                    next_rays, alive, px, py, pz, ox, oy, oz,
                    mirror_weight, order + 1, body, wraps, batch,
                )  # fmt: skip
                alive += 1
        if scattered:
            ox, oy, oz = _body_direction(mx, my, mz, facet, scattering.bound, rng)
            if order > 0:
                push_ray(
                    next_rays, alive, px, py, pz, ox, oy, oz,
                    weight, order + 1, body + 1, wraps, batch,
                )  # fmt: skip
                alive += 1
                continue
            across = max(np.hypot(ox, oy), 1e-300)
            fan[START_X], fan[START_Y], fan[START_Z] = px, py, pz
            fan[COS_PHI], fan[SIN_PHI] = ox / across, oy / across
            fan[NORMAL_Z], fan[NORMAL_T] = mz, mx * fan[COS_PHI] + my * fan[SIN_PHI]
            fan[RANDOM] = rng.random()
            # The fan's rays may be blocked from the first ring, or from none.
            fan[LAST_THETA] = np.pi / 2 + np.arctan2(fan[NORMAL_T], mz)
            high = min(np.searchsorted(fans.rings.edges, fan[LAST_THETA]), len(bins.ring_cosines))
            low = high if pz >= frame.top else 0  # nothing is above the highest point
            alive = _search(
                low,
                high,
                through * weight,
                batch,
                grid,
                facet,
                bins,
                fans,
                tallies,
                rng,
                next_rays,
                alive,
            )
    return alive, unmet, grazes, leaks


@inlined
def _search(low, high, weight, batch, grid, facet, bins, fans, tallies, rng, next_rays, alive):
    """Send a fan's next ray, or count what it sees and send what is blocked on its way."""
    fan, rings, blocked_counts = fans.numbers, fans.rings, fans.blocked_counts
    if low < high:
        ring = next_probe(fan, low, high, blocked_counts, grid)
        probe(next_rays, alive, fan, ring, weight, batch, rings)
        (
            next_rays.state[alive, LOW_RING],
            next_rays.state[alive, HIGH_RING],
            next_rays.state[alive, FAN_RING],
        ) = (
            low,
            high,
            ring,
        )
        return alive + 1
    blocked_counts[like(fan, grid), low] += 1
    ring, weight = unfold(
        fan, low, weight, batch, bins.azimuth, rings, fans.light, tallies, rng.random()
    )
    if ring < 0:
        return alive
    if not facet.multiple_scattering:
        tallies.ended[LEFT_OUT] += weight
        return alive
    probe(next_rays, alive, fan, ring, weight, batch, rings)
    return alive + 1
