"""Light rays between two explicit surfaces, from the light to their end, compiled.

The interface is a dielectric from both sides, the substrate is Lambertian about its facets'
normals. A ray inside meets what is nearer: the interface from below, which is the walk over
the interface turned upside down, or the substrate from above. So both use the next-hit walk
of the single surface as it is.

As over one surface, the chain of mirrors from the light is followed with the weight of its
Fresnel factors, and draws no random number that a layer below could change: what has never
been inside is the same to the bit whatever lies under the interface. All light that enters
along the chain goes into a reservoir, which keeps one entry by weight, and one path follows
it with the weight of all, drawing at each facet whether it is mirrored or passes.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...jit import compiled, inlined
from ...physics.fresnel_kernels import transmittance
from ...results import detector
from ...results.layers import A_DECADE, LENGTHS, SHORTEST
from .exact_horizon import FOOTPRINT, free_flight
from .exact_walk import sideways, walk
from .facet_scattering import mirror
from .lobe_fans import ring_of, sector_of
from .splitmix import uniform
from .state import ABSORBED, BATCHES, WRAPPED

MANY = 3
"""Numbers of outer reflections and of entries are counted apart below it."""
REFLECTIONS_BY_ENTRIES = (MANY + 1) ** 2

LENGTH = REFLECTIONS_BY_ENTRIES
"""Rows of the table of what has been inside, each by bins of body events. First light by outer
reflections and entries, row by row; from here on light times length, times substrate events,
times hits on the interface from below."""
SUBSTRATE_EVENTS, INNER_HITS, LENGTH_LIGHT = LENGTH + 1, LENGTH + 2, LENGTH + 3
LENGTH_SUM = LENGTH_LIGHT + LENGTHS
"""From LENGTH_LIGHT on light by bins of the length, from LENGTH_SUM on light times length."""
ROWS = LENGTH_SUM + LENGTHS


class Layers(NamedTuple):
    """Both surfaces as rays meet them, see `exact.ExactTile`; heights in float64.

    The interface from above, the interface turned upside down, and the substrate.
    """

    above: Any
    inverted: Any
    substrate: Any


class LayerTallies(NamedTuple):
    """What has ended: the tallies of one surface, and the table of what has been inside.

    ``inside`` is light before absorption on the way, shape (ROWS, body_events).
    """

    outside: Any
    inside: NDArray[np.float64]


@inlined
def _normal(p, q):
    length = np.sqrt(1 + p * p + q * q)
    return -p / length, -q / length, 1 / length


@inlined
def _into(dx, dy, dz, mx, my, mz, mu, n):
    """Direction inside of light that comes from above with −d·m = μ."""
    g = np.sqrt((n - 1) * (n + 1) + mu * mu)  # n times the cosine inside
    # g − μ without a difference of near equals at n → 1.
    bend = (n - 1) * (n + 1) / (g + mu)
    dx, dy, dz = (dx - bend * mx) / n, (dy - bend * my) / n, (dz - bend * mz) / n
    norm = np.sqrt(dx * dx + dy * dy + dz * dz)
    return dx / norm, dy / norm, dz / norm


@inlined
def _squared_cosine_outside(inner, n):
    """Of light that meets the interface from below with the cosine ``inner``; ≤ 0 is total."""
    return n * n * inner * inner - (n - 1) * (n + 1)


@inlined
def _passes_out(squared, n):
    """Part of it that passes, by reciprocity that of light which comes the other way."""
    return transmittance(min(np.sqrt(squared), 1.0), n)


@inlined
def _out(dx, dy, dz, mx, my, mz, inner, mu, n):
    """Direction outside of light that comes from below with d·m = ``inner``, then μ."""
    bend = (n - 1) * (n + 1) / (n * inner + mu)
    dx, dy, dz = n * dx - bend * mx, n * dy - bend * my, n * dz - bend * mz
    norm = np.sqrt(dx * dx + dy * dy + dz * dz)
    return dx / norm, dy / norm, dz / norm


@inlined
def _lambertian(mx, my, mz, random):
    """Direction ∝ cosine about a normal: a point of the sphere that touches the facet."""
    while True:
        s = 2 * uniform(random) - 1
        turn = 2 * np.pi * uniform(random)
        ring = np.sqrt(1 - s * s)
        dx, dy, dz = mx + ring * np.cos(turn), my + ring * np.sin(turn), mz + s
        norm = np.sqrt(dx * dx + dy * dy + dz * dz)
        if norm > 1e-9:
            return dx / norm, dy / norm, dz / norm


@inlined
def _arrive(tallies, dx, dy, dz, weight, order, body, batch, bins):
    """Count what reaches the detector; of order 1 all that was inside shares its squares."""
    row = min(order, 4) - 1
    ring = ring_of(dz, bins.ring_cosines)
    sector = sector_of(dx, dy, bins.azimuth)
    tallies.energy[body, row, sector, ring] += weight
    tallies.batches[batch, row, body] += weight
    if order == 1:
        tallies.squares[min(body, 1), sector, ring] += weight * weight


@inlined
def _bin_of(length):
    """Bin of the length inside; what is shorter or longer than all is in the first or last."""
    decade_bin = A_DECADE * np.log10(max(length, SHORTEST) / SHORTEST)
    return min(int(decade_bin), LENGTHS - 1)


@inlined
def _record(inside, body, weight, reflections, entries, length, events, hits):
    """Count one path that was inside and reached the detector."""
    inside[min(reflections, MANY) * (MANY + 1) + min(entries, MANY), body] += weight
    inside[LENGTH, body] += weight * length
    inside[SUBSTRATE_EVENTS, body] += weight * events
    inside[INNER_HITS, body] += weight * hits
    decade_bin = _bin_of(length)
    inside[LENGTH_LIGHT + decade_bin, body] += weight
    inside[LENGTH_SUM + decade_bin, body] += weight * length


@compiled
def trace_layers(layers, ray_origins, dx, dy, dz, facet, absorption, bins, tallies, random):
    """Follow light rays from ``ray_origins``, in the plane of the highest point, to their end.

    Body events are counted as: 0, never inside; k, inside with k − 1 substrate events.
    Returns the number of rays.
    """
    above, inverted, substrate = layers
    outside, inside = tallies
    n = facet.n
    traced = 0
    dx, dy = sideways(dx), sideways(dy)
    block_x = block_y = -1
    free = 0.0
    # Of what enters along the chain the entry that was drawn.
    ex = ey = ez = eox = eoy = eoz = 0.0
    ecx = ecy = eside = eorder = 0
    for k in range(len(ray_origins)):
        batch = k % BATCHES
        x, y = ray_origins[k, 0], ray_origins[k, 1]
        cx, cy = min(int(x), above.columns - 1), min(int(y), above.rows - 1)
        if cx // FOOTPRINT != block_x or cy // FOOTPRINT != block_y:
            block_x, block_y = cx // FOOTPRINT, cy // FOOTPRINT
            free = free_flight(above, block_x * FOOTPRINT, block_y * FOOTPRINT, dx, dy, dz)
        t = free
        if t > 0:
            ix, iy = int(np.floor(x + t * dx)), int(np.floor(y + t * dy * above.aspect))
            cx, cy = ix % above.columns, iy % above.rows
            x, y = x - (ix - cx), y - (iy - cy)
        z, side, under = above.top, -1, -1
        ox, oy, oz = dx, dy, dz
        weight, entered = 1.0, 0.0
        order = entries = events = hits = 0
        length = 0.0
        chain, within = True, False
        while True:
            traced += 1
            ox, oy = sideways(ox), sideways(oy)
            if within:
                up, ux, uy, ufx, ufy, up_p, up_q, uz, ut = walk(
                    inverted, x, y, -z, ox, oy, -oz, 0.0, cx, cy, side
                )
                down, sx, sy, sfx, sfy, p, q, sz, st = walk(
                    substrate, x, y, z, ox, oy, oz, 0.0, cx, cy, under
                )
                if up < 0 and down < 0:
                    outside.ended[WRAPPED] += weight
                    outside.lost[WRAPPED] += 1
                    break
                if down >= 0 and (up < 0 or st < ut):
                    # Lambertian about the substrate's facet.
                    length += st
                    if not facet.substrate or (
                        events + 1 >= detector.BODY_EXACT and uniform(random) >= facet.survival
                    ):
                        outside.ended[ABSORBED] += weight
                        break
                    events += 1
                    cx, cy, side, under = sx, sy, -1, down
                    x, y, z = cx + sfx, cy + sfy, sz
                    mx, my, mz = _normal(p, q)
                    ox, oy, oz = _lambertian(mx, my, mz, random)
                    continue
                # The interface from below: its slopes are those of the inverted one turned over.
                length += ut
                hits += 1
                cx, cy, side, under = ux, uy, up, -1
                x, y, z = cx + ufx, cy + ufy, -uz
                mx, my, mz = _normal(-up_p, -up_q)
                inner = min(max(ox * mx + oy * my + oz * mz, 1e-12), 1.0)
                squared = _squared_cosine_outside(inner, n)
                if facet.interface and (squared <= 0 or uniform(random) >= _passes_out(squared, n)):
                    ox, oy, oz = mirror(ox, oy, oz, -mx, -my, -mz, inner)
                    continue
                ox, oy, oz = _out(ox, oy, oz, mx, my, mz, inner, min(np.sqrt(squared), 1.0), n)
                within = False
                continue

            side, cx, cy, fx, fy, p, q, z, _ = walk(above, x, y, z, ox, oy, oz, t, cx, cy, side)
            t = 0.0
            if side < 0:
                if chain:
                    _arrive(outside, ox, oy, oz, weight, order, 0, batch, bins)
                    if entered == 0:
                        break
                    # On with what entered along the chain.
                    chain, within = False, True
                    x, y, z, cx, cy, side, under = ex, ey, ez, ecx, ecy, eside, -1
                    ox, oy, oz, order = eox, eoy, eoz, eorder
                    weight, entries = entered, 1
                    continue
                body = np.searchsorted(bins.body_edges, events + 1, "right") - 1
                reflections = order - entries
                left = weight * np.exp(-absorption * length)
                _arrive(outside, ox, oy, oz, left, order, body, batch, bins)
                outside.ended[ABSORBED] += weight - left
                _record(inside, body, weight, reflections, entries, length, events, hits)
                break
            order += 1
            x, y = cx + fx, cy + fy
            mx, my, mz = _normal(p, q)
            mu = min(max(-(ox * mx + oy * my + oz * mz), 1e-12), 1.0)
            through = transmittance(mu, n) if facet.interface else 1.0
            if chain:
                into = through * weight
                entered += into
                if entered == into or uniform(random) * entered < into:
                    ex, ey, ez, ecx, ecy, eside, eorder = x, y, z, cx, cy, side, order
                    eox, eoy, eoz = _into(ox, oy, oz, mx, my, mz, mu, n)
                if facet.interface:
                    weight *= 1 - through
                    ox, oy, oz = mirror(ox, oy, oz, mx, my, mz, mu)
                    continue
                # n = 1: nothing is mirrored, all of it is inside.
                chain, within, entries, under = False, True, 1, -1
                weight = entered
                ox, oy, oz = eox, eoy, eoz
                continue
            if facet.interface and uniform(random) >= through:
                ox, oy, oz = mirror(ox, oy, oz, mx, my, mz, mu)
                continue
            entries += 1
            within, under = True, -1
            ox, oy, oz = _into(ox, oy, oz, mx, my, mz, mu, n)
    return traced
