"""What happens to each ray between two calls of Embree, compiled: the loop where rays scatter.

The hit is recomputed in float64 from its triangle and (u, v); the next ray starts
off the facet by a distance that scales with float32's rounding of the coordinates,
and far enough inside the triangle that this step stays above it: a heightfield has
nothing above its own triangle, so the new origin is above the surface.

A light ray is *split* at its first facet: one path is mirrored with weight F, `BODY_PATHS`
come out of the substrate with weight T/BODY_PATHS each (Arvo & Kirk 1990, "Particle transport
and image synthesis"). The weights add up to the light ray's, so the books close ray by ray.
At later facets a path draws one of both.
"""

import numpy as np
from numba import njit

from .. import result
from .empty_space import MOST_WRAPS, OFFSET, advance, put
from .grid import MARGIN
from .wave import ABSORBED, BEHIND, BELOW, LEFT_OUT, WRAPPED

BODY_PATHS = 4
"""Paths out of the substrate at a light ray's first facet."""

_BACK = 1e-6  # float32 directions may meet a grazed triangle from behind by this cosine
_EDGE = 1e-4  # a ray that grazes a ridge may be said to hit its far side, this near the edge
_GOLDEN = (np.sqrt(5) - 1) / 2


@njit(cache=True, nogil=True, error_model="numpy")
def transmittance(mu, n, k):
    """T(μ) as in `physics.fresnel.transmittance`, one number at a time; k > 0 is a conductor."""
    if k > 0:
        eta2 = complex((n - k) * (n + k), 2 * n * k)
        root = np.sqrt(complex((n - 1) * (n + 1) - k * k + mu * mu, 2 * n * k))
        across, along = abs(root + mu) ** 2, abs(eta2 * mu + root) ** 2
        return 2 * mu * (root.real / across + (eta2 * root.conjugate()).real / along)
    g = np.sqrt((n - 1) * (n + 1) + mu * mu)
    return 2 * g * mu * (1 / (g + mu) ** 2 + n * n / (n * n * mu + g) ** 2)


@njit(cache=True, nogil=True, error_model="numpy")
def _corners(cell_x, cell_y, side, heights, flipped):
    """Corners of a triangle in the order of `grid.triangles`, and its slopes p, q."""
    h00, h10 = float(heights[cell_y, cell_x]), float(heights[cell_y, cell_x + 1])
    h01, h11 = float(heights[cell_y + 1, cell_x]), float(heights[cell_y + 1, cell_x + 1])
    if flipped[cell_y, cell_x]:
        if side == 0:
            return 0, 0, h00, 1, 0, h10, 0, 1, h01, h10 - h00, h01 - h00
        return 1, 0, h10, 1, 1, h11, 0, 1, h01, h11 - h01, h11 - h10
    if side == 0:
        return 0, 0, h00, 1, 0, h10, 1, 1, h11, h10 - h00, h11 - h10
    return 0, 0, h00, 1, 1, h11, 0, 1, h01, h11 - h01, h01 - h00


@njit(cache=True, nogil=True, error_model="numpy")
def _body_direction(mx, my, mz, s, turn, n, bound, interface, rng):
    """Direction of light that leaves the substrate: ∝ T(μ_o) μ_o about the normal.

    A uniform point of the sphere that touches the facet, here by s and turn in [0, 1),
    is a cosine lobe; kept ∝ T(μ_o) it leaves every body event the same weight.
    """
    while True:
        s = 2 * s - 1
        azimuth = 2 * np.pi * turn
        ring = np.sqrt(1 - s * s)
        dx, dy, dz = mx + ring * np.cos(azimuth), my + ring * np.sin(azimuth), mz + s
        norm = np.sqrt(dx * dx + dy * dy + dz * dz)
        if norm > 1e-9:
            dx, dy, dz = dx / norm, dy / norm, dz / norm
            if not interface:
                return dx, dy, dz
            mu = dx * mx + dy * my + dz * mz
            if mu > 0 and rng.random() * bound < transmittance(mu, n, 0.0):
                return dx, dy, dz
        s, turn = rng.random(), rng.random()


@njit(cache=True, nogil=True, error_model="numpy")
def _mirrored(dx, dy, dz, mx, my, mz, mu):
    dx, dy, dz = dx + 2 * mu * mx, dy + 2 * mu * my, dz + 2 * mu * mz
    norm = np.sqrt(dx * dx + dy * dy + dz * dz)
    return dx / norm, dy / norm, dz / norm


@njit(cache=True, nogil=True, error_model="numpy")
def _arrive(detector, dx, dy, dz, weight, order, body, batch, azimuth, ring_cosines, body_edges):
    """Count what reaches the detector; ``azimuth`` is that of incidence in degrees."""
    row = min(order, 4) - 1
    if body > result.BODY_EXACT:
        body = np.searchsorted(body_edges, body, "right") - 1
    ring, last = 0, len(ring_cosines) - 1
    while ring < last:
        middle = (ring + last) // 2
        if dz <= ring_cosines[middle]:
            ring = middle + 1
        else:
            last = middle
    turn = (np.degrees(np.arctan2(dy, dx)) - azimuth) / 360 * result.SECTORS
    sector = int(np.floor(turn + 0.5)) % result.SECTORS
    detector.energy[body, row, ring, sector] += weight
    detector.batches[batch, row, body] += weight
    if order == 1:
        detector.squares[body, ring, sector] += weight * weight


@njit(cache=True, nogil=True, error_model="numpy")
def take_events(
    active, wave, then, triangle, u, v, grid, x0, y0, top, reach,
    facet, bound, azimuths, ring_cosines, body_edges, detector, rng,
):  # fmt: skip
    """Take one facet event for each of the wave's active rays; what goes on is put into ``then``.

    A ray that only grazes a ridge, hit from behind at its edge, goes on as it was.
    Returns the number of rays that go on, of those among them that have met no facet
    yet, and of grazes.
    """
    width = grid.flipped.shape[1]
    x1, y1 = x0 + width, y0 + grid.flipped.shape[0]
    body_paths = BODY_PATHS if facet.substrate else 0
    branches = body_paths + (1 if facet.interface or not facet.substrate else 0)
    alive = unmet = grazes = 0
    for r in range(active):
        dx, dy, dz = wave.directions[r, 0], wave.directions[r, 1], wave.directions[r, 2]
        order, body = wave.state[r, 0], wave.state[r, 1]
        wraps, batch = wave.state[r, 2], wave.state[r, 3]
        weight = wave.weight[r]
        end = -1
        if triangle[r] < 0:
            # Out of the tile's side: above everything, below everything, or round the period.
            px, py = float(wave.origins[r, 0]), float(wave.origins[r, 1])
            pz = float(wave.origins[r, 2])
            tx = ty = np.inf
            if dx != 0:
                tx = (x1 - px) / dx if dx > 0 else (x0 - px) / dx
            if dy != 0:
                ty = (y1 - py) / dy if dy > 0 else (y0 - py) / dy
            t = min(tx, ty)
            z = pz + t * dz if t < np.inf else np.copysign(np.inf, dz)
            ahead = 0
            if dz > 0 and z >= top:
                ahead = 1
            elif dz <= 0 and z < grid.bottom:
                end = BELOW
            elif wraps >= MOST_WRAPS:
                end = WRAPPED
            else:
                # A little back, so that rounding leaves no gap between the two parts.
                t = max(0.0, t - (2.0**-19 * reach + 2.0**-20 * t))
                px, py, pz = px + t * dx, py + t * dy, pz + t * dz
                if tx <= ty:
                    px -= np.copysign(float(grid.columns), dx)
                else:
                    py -= np.copysign(float(grid.rows), dy)
                ahead, px, py, pz, more = advance(
                    px, py, pz, dx, dy, dz, grid.tops, grid.levels,
                    x0 + MARGIN, y0 + MARGIN, grid.columns, grid.rows, top, reach,
                )  # fmt: skip
                wraps += 1 + more
                if ahead != 1 and wraps >= MOST_WRAPS:
                    end = WRAPPED
            if ahead == 1:
                _arrive(
                    detector, dx, dy, dz, weight, order, body, batch,
                    azimuths[batch], ring_cosines, body_edges,
                )  # fmt: skip
            elif end >= 0:
                detector.ended[end] += weight
                detector.lost[end] += 1 if order > 0 else branches
            else:
                put(then, alive, px, py, pz, dx, dy, dz, weight, order, body, wraps, batch)
                alive += 1
                unmet += order == 0
            continue

        cell, side = triangle[r] // 2, triangle[r] % 2
        cell_y, cell_x = cell // width, cell % width
        ax, ay, az, bx, by, bz, ex, ey, ez, p, q = _corners(
            cell_x, cell_y, side, grid.heights, grid.flipped
        )
        length = np.sqrt(1 + p * p + q * q)
        mx, my, mz = -p / length, -q / length, 1 / length
        mu = -(dx * mx + dy * my + dz * mz)
        wb, we = float(u[r]), float(v[r])
        wa = 1 - wb - we
        grazed = mu < -_BACK and min(wa, wb, we) < _EDGE
        if mu < -_BACK and not grazed:
            end = BEHIND
        elif order >= 1 and not facet.multiple_scattering and not grazed:
            end = LEFT_OUT
        if end >= 0:
            detector.ended[end] += weight
            detector.lost[end] += 1 if order > 0 else branches
            continue

        # Where the next rays start, see the module's text.
        step = OFFSET * reach * (abs(mx) + abs(my) + abs(mz))
        inset = min(0.25, 2 * step * np.hypot(mx, my) + 2.0**-22 * reach)
        wa, wb, we = max(wa, inset), max(wb, inset), max(we, inset)
        total = wa + wb + we
        wa, wb, we = wa / total, wb / total, we / total
        px = (cell_x - MARGIN) % grid.columns + MARGIN + x0
        py = (cell_y - MARGIN) % grid.rows + MARGIN + y0
        px += wa * ax + wb * bx + we * ex + step * mx
        py += wa * ay + wb * by + we * ey + step * my
        pz = wa * az + wb * bz + we * ez + step * mz

        if grazed:
            grazes += 1
            put(then, alive, px, py, pz, dx, dy, dz, weight, order, body, wraps, batch)
            alive += 1
            unmet += order == 0
            continue

        mu = min(max(mu, 1e-12), 1.0)
        through = transmittance(mu, facet.n, facet.k) if facet.interface else 1.0
        if order == 0:
            mirrors = 1 if facet.interface else 0
            bodies = body_paths
            mirror_weight, body_weight = (1 - through) * weight, 0.0
            if bodies > 0:
                body_weight = through * weight / bodies
            else:
                detector.ended[ABSORBED] += through * weight
        else:
            mirrors = 1 if facet.interface and rng.random() >= through else 0
            bodies = 1 - mirrors
            mirror_weight = body_weight = weight
            if bodies and (
                not facet.substrate
                or (body >= result.BODY_EXACT and rng.random() >= facet.survival)
            ):
                bodies = 0
                detector.ended[ABSORBED] += weight
        order += 1
        # The bodies' directions are a lattice of rank one, shifted at random.
        s, turn = rng.random(), rng.random()
        for j in range(mirrors + bodies):
            if j < mirrors:
                ox, oy, oz = _mirrored(dx, dy, dz, mx, my, mz, mu)
                now, share = body, mirror_weight
            else:
                ox, oy, oz = _body_direction(
                    mx, my, mz, s, turn, facet.n, bound, facet.interface, rng
                )
                s = (s + 1 / bodies) % 1.0
                turn = (turn + _GOLDEN) % 1.0
                now, share = body + 1, body_weight
            if oz > 0 and pz >= top:
                _arrive(
                    detector, ox, oy, oz, share, order, now, batch,
                    azimuths[batch], ring_cosines, body_edges,
                )  # fmt: skip
            else:
                put(then, alive, px, py, pz, ox, oy, oz, share, order, now, wraps, batch)
                alive += 1
    return alive, unmet, grazes
