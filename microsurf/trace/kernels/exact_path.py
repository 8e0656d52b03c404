"""Light rays of the exact engine from the light to their end, compiled.

The chain of mirrors from the light is followed as it is, with the weight of its Fresnel
factors. What passes into the substrate of the first facet comes out as a fan (see `lobe_fans`). The
light that the fan loses behind its horizon, and all that enters substrates later along the
chain, goes into a *reservoir* (Chao 1982, "A general purpose unequal probability sampling
plan"): it keeps one of them, by weight, and one path follows it with the weight of all. So
energy is conserved light ray by light ray, and later orders cost no branching.
"""

import numpy as np

from ...jit import compiled, inlined
from ...physics.fresnel_kernels import passed, transmittance
from ...results import detector
from .exact_horizon import FOOTPRINT, first_blocked, free_flight
from .exact_lobe_fans import deposit
from .exact_walk import sideways, walk
from .facet_scattering import arrive, mirror
from .lobe_fans import (
    COS_PHI,
    LAST_THETA,
    NORMAL_T,
    NORMAL_Z,
    RANDOM,
    SIN_PHI,
    START_X,
    START_Y,
    START_Z,
    elevation,
    sector_of,
)
from .splitmix import uniform
from .state import ABSORBED, BATCHES, LEFT_OUT


@inlined
def body_direction(mx, my, mz, first, second, facet, bound, random):
    """Direction of light that leaves the substrate: ∝ T(μ_o) μ_o about the normal.

    A uniform point of the sphere that touches the facet, of two numbers in [0, 1), is a
    cosine lobe; kept ∝ T(μ_o) it leaves every body event the same weight.
    """
    while True:
        s = 2 * first - 1
        turn = 2 * np.pi * second
        ring = np.sqrt(1 - s * s)
        dx, dy, dz = mx + ring * np.cos(turn), my + ring * np.sin(turn), mz + s
        norm = np.sqrt(dx * dx + dy * dy + dz * dz)
        if norm > 1e-9:
            dx, dy, dz = dx / norm, dy / norm, dz / norm
            if not facet.interface:
                break
            mu = dx * mx + dy * my + dz * mz
            if mu > 0 and uniform(random) * bound < transmittance(mu, facet.n):
                break
        first, second = uniform(random), uniform(random)
    return dx, dy, dz


@compiled
def trace_light(
    tile, ray_origins, dx, dy, dz, facet, bound, bins, rings, nodes, room, pair,
    tallies, random,
):  # fmt: skip
    """Follow light rays from ``ray_origins``, in the plane of the highest point, to their end.

    ``room`` is for the numbers of one fan, two numbers and one number a ring; ``pair`` is the
    point of a low-discrepancy sequence, for the fans' directions. Returns the number of rays.
    """
    fan, light, into_rings = room
    count = len(ray_origins)
    traced = 0
    even_x, even_y = pair
    dx, dy = sideways(dx), sideways(dy)
    block_x = block_y = -1
    free = 0.0
    # The first facet that was met, and what the reservoir keeps.
    ax = ay = az = amx = amy = amz = 0.0
    acx = acy = aside = 0
    bx = by = bz = box = boy = boz = 0.0
    bcx = bcy = bside = border = 0
    for k in range(count):
        batch = k % BATCHES
        x, y = ray_origins[k, 0], ray_origins[k, 1]
        cx, cy = min(int(x), tile.columns - 1), min(int(y), tile.rows - 1)
        if cx // FOOTPRINT != block_x or cy // FOOTPRINT != block_y:
            block_x, block_y = cx // FOOTPRINT, cy // FOOTPRINT
            free = free_flight(tile, block_x * FOOTPRINT, block_y * FOOTPRINT, dx, dy, dz)
        t = free
        if t > 0:
            # Back into the period, the start too: coordinates count from the cell's period.
            ix, iy = int(np.floor(x + t * dx)), int(np.floor(y + t * dy * tile.aspect))
            cx, cy = ix % tile.columns, iy % tile.rows
            x, y = x - (ix - cx), y - (iy - cy)
        z, side = tile.top, -1
        ox, oy, oz = dx, dy, dz
        weight = 1.0
        entered = waiting = 0.0  # light in the first facet's substrate; in the reservoir
        order = 0
        while True:
            traced += 1
            side, cx, cy, fx, fy, p, q, z, _ = walk(tile, x, y, z, ox, oy, oz, t, cx, cy, side)
            if side < 0:
                arrive(tallies, ox, oy, oz, weight, order, 0, batch, bins)
                break
            if order > 0 and not facet.multiple_scattering:
                tallies.ended[LEFT_OUT] += weight
                break
            order += 1
            x, y, t = cx + fx, cy + fy, 0.0
            length = np.sqrt(1 + p * p + q * q)
            mx, my, mz = -p / length, -q / length, 1 / length
            mu = min(max(-(ox * mx + oy * my + oz * mz), 1e-12), 1.0)
            through = passed(mu, facet) if facet.interface else 1.0
            into = through * weight
            if not facet.substrate:
                tallies.ended[ABSORBED] += into
            elif order == 1:
                entered = into
                ax, ay, az, amx, amy, amz = x, y, z, mx, my, mz
                acx, acy, aside = cx, cy, side
            else:
                waiting += into
                if waiting == into or uniform(random) * waiting < into:
                    bx, by, bz, bcx, bcy, bside, border = x, y, z, cx, cy, side, order
                    box, boy, boz = body_direction(
                        mx, my, mz, uniform(random), uniform(random), facet, bound, random
                    )
            if not facet.interface:
                break
            weight *= 1 - through
            ox, oy, oz = mirror(ox, oy, oz, mx, my, mz, mu)
            ox, oy = sideways(ox), sideways(oy)
        if entered > 0:
            even_x, even_y = (even_x + _R2_X) % 1.0, (even_y + _R2_Y) % 1.0
            ox, oy, oz = body_direction(amx, amy, amz, even_x, even_y, facet, bound, random)
            across = max(np.sqrt(ox * ox + oy * oy), 1e-150)
            fan[START_X], fan[START_Y], fan[START_Z] = ax, ay, az
            fan[COS_PHI], fan[SIN_PHI] = ox / across, oy / across
            fan[NORMAL_Z], fan[NORMAL_T] = amz, amx * fan[COS_PHI] + amy * fan[SIN_PHI]
            fan[RANDOM] = uniform(random)
            fan[LAST_THETA] = np.pi / 2 + np.arctan2(fan[NORMAL_T], amz)
            high = min(np.searchsorted(rings.edges, fan[LAST_THETA]), len(bins.ring_cosines))
            first = first_blocked(
                tile, ax, ay, az, acx, acy, aside, fan[COS_PHI], fan[SIN_PHI],
                fan[NORMAL_Z], fan[NORMAL_T], fan[LAST_THETA], fan[RANDOM], high, rings, nodes,
            )  # fmt: skip
            ring, blocked = deposit(
                fan, first, entered, batch, sector_of(fan[COS_PHI], fan[SIN_PHI], bins.azimuth),
                rings, nodes, light, into_rings, tallies, uniform(random),
            )  # fmt: skip
            if ring >= 0 and not facet.multiple_scattering:
                tallies.ended[LEFT_OUT] += blocked
            elif ring >= 0:
                waiting += blocked
                if waiting == blocked or uniform(random) * waiting < blocked:
                    bx, by, bz, bcx, bcy, bside, border = ax, ay, az, acx, acy, aside, 1
                    theta = elevation(
                        ring, fan[NORMAL_Z], fan[NORMAL_T], fan[LAST_THETA], fan[RANDOM], rings
                    )
                    sine = np.sin(theta)
                    box, boy, boz = sine * fan[COS_PHI], sine * fan[SIN_PHI], np.cos(theta)
        if waiting == 0:
            continue

        x, y, z, cx, cy, side, order = bx, by, bz, bcx, bcy, bside, border
        ox, oy, oz = box, boy, boz
        weight = waiting
        body = 1
        while True:
            traced += 1
            ox, oy = sideways(ox), sideways(oy)
            side, cx, cy, fx, fy, p, q, z, _ = walk(tile, x, y, z, ox, oy, oz, 0.0, cx, cy, side)
            if side < 0:
                arrive(tallies, ox, oy, oz, weight, order, body, batch, bins)
                break
            order += 1
            x, y = cx + fx, cy + fy
            length = np.sqrt(1 + p * p + q * q)
            mx, my, mz = -p / length, -q / length, 1 / length
            mu = min(max(-(ox * mx + oy * my + oz * mz), 1e-12), 1.0)
            if facet.interface and uniform(random) >= passed(mu, facet):
                ox, oy, oz = mirror(ox, oy, oz, mx, my, mz, mu)
                continue
            if body >= detector.BODY_EXACT and uniform(random) >= facet.survival:
                tallies.ended[ABSORBED] += weight
                break
            body += 1
            ox, oy, oz = body_direction(
                mx, my, mz, uniform(random), uniform(random), facet, bound, random
            )
    return traced


_R2_X, _R2_Y = 0.7548776662466927, 0.5698402909980532
"""Steps of the R2 sequence (Roberts 2018): 1/g and 1/g², g³ = g + 1."""
