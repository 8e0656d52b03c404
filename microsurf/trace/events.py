"""What happens to each ray between two calls of Embree, compiled: the loop where rays scatter.

The hit is recomputed in float64 from its triangle and (u, v); the next ray starts
off the facet by a distance that scales with float32's rounding of the coordinates,
and far enough inside the triangle that this step stays above it: a heightfield has
nothing above its own triangle, so the new origin is above the surface.
"""

import numpy as np
from numba import njit

from .. import result
from .grid import LEVEL_STEP, MARGIN

MOST_WRAPS = 100_000
OFFSET = 4 * 2.0**-23  # of the coordinates' reach, along the facet normal
_BACK = 1e-6  # float32 directions may meet a grazed triangle from behind by this cosine
_EDGE = 1e-4  # a ray that grazes a ridge may be said to hit its far side, this near the edge


@njit(cache=True, nogil=True)
def transmittance(mu, n, k):
    """T(μ) as in `physics.fresnel.transmittance`, one number at a time; k > 0 is a conductor."""
    if k > 0:
        eta2 = complex((n - k) * (n + k), 2 * n * k)
        root = np.sqrt(complex((n - 1) * (n + 1) - k * k + mu * mu, 2 * n * k))
        across, along = abs(root + mu) ** 2, abs(eta2 * mu + root) ** 2
        return 2 * mu * (root.real / across + (eta2 * root.conjugate()).real / along)
    g = np.sqrt((n - 1) * (n + 1) + mu * mu)
    return 2 * g * mu * (1 / (g + mu) ** 2 + n * n / (n * n * mu + g) ** 2)


@njit(cache=True, nogil=True)
def _advance(px, py, pz, dx, dy, dz, tops, levels, left, front, columns, rows, top, reach):
    """Carry a ray through blocks that it passes above, round the period as often as need be.

    Returns 1 if it leaves for good, 2 after MOST_WRAPS rounds, else 0; the new
    origin; and how often it went round.
    """
    clear = 2.0**-20 * reach  # float32 must not see the ray lower than the block's top
    nudge = 2.0**-40 * reach  # past the border, into the next block
    nudge_x, nudge_y = np.copysign(nudge, dx), np.copysign(nudge, dy)
    per_x = 1 / dx if dx != 0 else np.inf
    per_y = 1 / dy if dy != 0 else np.inf
    x, y = px - left, py - front
    wraps = 0
    coarsest = len(levels) - 1
    level = coarsest
    parent_x = parent_y = 0
    while wraps < MOST_WRAPS:
        if dz > 0 and pz >= top:
            return 1, x + left, y + front, pz, wraps
        if x < 0 or x >= columns:
            x -= np.floor(x / columns) * columns
            wraps += 1
        if y < 0 or y >= rows:
            y -= np.floor(y / rows) * rows
            wraps += 1
        power, start, across = levels[level, 0], levels[level, 1], levels[level, 2]
        # Rounding can leave the coordinate on the far edge, which belongs to no block.
        bx = min(int(x) >> power, across - 1)
        by = min(int(y) >> power, levels[level, 3] - 1)
        if level < coarsest and (bx >> LEVEL_STEP != parent_x or by >> LEVEL_STEP != parent_y):
            # Out of the larger block that was not clear as a whole: try its neighbour so.
            level += 1
            parent_x >>= LEVEL_STEP
            parent_y >>= LEVEL_STEP
            continue
        tx = ty = np.inf
        if dx > 0:
            tx = (min((bx + 1) << power, columns) - x) * per_x
        elif dx < 0:
            tx = ((bx << power) - x) * per_x
        if dy > 0:
            ty = (min((by + 1) << power, rows) - y) * per_y
        elif dy < 0:
            ty = ((by << power) - y) * per_y
        t = max(min(tx, ty), 0.0)
        lowest = pz + t * dz if dz < 0 else pz
        if lowest > tops[start + by * across + bx] + clear:
            if t == np.inf:
                return 1, x + left, y + front, pz, wraps
            x, y, pz = x + t * dx, y + t * dy, pz + t * dz
            if tx <= ty:
                x += nudge_x
            else:
                y += nudge_y
        elif level > 0:
            level -= 1
            parent_x, parent_y = bx, by
        else:
            return 0, x + left, y + front, pz, wraps
    return 2, x + left, y + front, pz, wraps


@njit(cache=True, nogil=True)
def launch(
    first, last, starts, incident, origins, rays, directions, state,
    tops, levels, x0, y0, columns, rows, top, reach,
):  # fmt: skip
    """Start paths at ``starts`` on the plane above everything; bring them near the surface."""
    dx, dy, dz = incident
    for r in range(first, last):
        _, px, py, pz, wraps = _advance(
            starts[r - first, 0], starts[r - first, 1], top, dx, dy, dz, tops, levels,
            x0 + MARGIN, y0 + MARGIN, columns, rows, top, reach,
        )  # fmt: skip
        origins[r, 0], origins[r, 1], origins[r, 2] = px, py, pz
        rays[r, 0], rays[r, 1], rays[r, 2] = dx, dy, dz
        directions[r, 0], directions[r, 1], directions[r, 2] = dx, dy, dz
        state[r, 0], state[r, 1], state[r, 2] = 0, 0, wraps


@njit(cache=True, nogil=True)
def take_events(
    active, origins, rays, directions, state, ended,
    triangle, u, v,
    heights, flipped, x0, y0, columns, rows, bottom, top, reach,
    n, k, bound, interface, substrate, multiple_scattering, survival, body_edges,
    tops, levels, ring_cosines, phi_i, uniform, rng,
):  # fmt: skip
    """Take one facet event for each active ray in place; survivors move to the front.

    A ray that only grazes a ridge, hit from behind at its edge, goes on as it was.
    ``uniform`` holds four random numbers for each ray; what rejection needs beyond
    comes from ``rng``. Returns the numbers of survivors, of paths whose code now
    stands in ``ended``, and of grazes.
    """
    width = flipped.shape[1]
    xs = x0, x0 + width
    ys = y0, y0 + flipped.shape[0]
    alive = 0
    over = 0
    grazes = 0
    for r in range(active):
        dx, dy, dz = directions[r, 0], directions[r, 1], directions[r, 2]
        order, body, wraps = state[r, 0], state[r, 1], state[r, 2]
        end = 0  # 0 goes on, 1 escapes, < 0 see paths._ENDS
        if triangle[r] < 0:
            # Out of the tile's side: above everything, below everything, or round the period.
            ox, oy, oz = float(origins[r, 0]), float(origins[r, 1]), float(origins[r, 2])
            tx = ty = np.inf
            if dx != 0:
                tx = (xs[1] - ox) / dx if dx > 0 else (xs[0] - ox) / dx
            if dy != 0:
                ty = (ys[1] - oy) / dy if dy > 0 else (ys[0] - oy) / dy
            t = min(tx, ty)
            z = oz + t * dz if t < np.inf else np.copysign(np.inf, dz)
            if dz > 0 and z >= top:
                end = 1
            elif dz <= 0 and z < bottom:
                end = -3
            elif wraps >= MOST_WRAPS:
                end = -5
            else:
                # A little back, so that rounding leaves no gap between the two parts.
                t = max(0.0, t - (2.0**-19 * reach + 2.0**-20 * t))
                px, py, pz = ox + t * dx, oy + t * dy, oz + t * dz
                if tx <= ty:
                    px -= np.copysign(float(columns), dx)
                else:
                    py -= np.copysign(float(rows), dy)
                wraps += 1
                ahead, px, py, pz, more = _advance(
                    px, py, pz, dx, dy, dz, tops, levels,
                    x0 + MARGIN, y0 + MARGIN, columns, rows, top, reach,
                )  # fmt: skip
                wraps += more
                if ahead == 1:
                    end = 1
                elif wraps >= MOST_WRAPS:
                    end = -5
        else:
            cell, side = triangle[r] // 2, triangle[r] % 2
            cy, cx = cell // width, cell % width
            h00, h10 = float(heights[cy, cx]), float(heights[cy, cx + 1])
            h01, h11 = float(heights[cy + 1, cx]), float(heights[cy + 1, cx + 1])
            # Corners of the triangle in the order of grid.triangles, and its slopes.
            if flipped[cy, cx]:
                if side == 0:
                    ax, ay, az, bx, by, bz, ex, ey, ez = 0, 0, h00, 1, 0, h10, 0, 1, h01
                    p, q = h10 - h00, h01 - h00
                else:
                    ax, ay, az, bx, by, bz, ex, ey, ez = 1, 0, h10, 1, 1, h11, 0, 1, h01
                    p, q = h11 - h01, h11 - h10
            elif side == 0:
                ax, ay, az, bx, by, bz, ex, ey, ez = 0, 0, h00, 1, 0, h10, 1, 1, h11
                p, q = h10 - h00, h11 - h10
            else:
                ax, ay, az, bx, by, bz, ex, ey, ez = 0, 0, h00, 1, 1, h11, 0, 1, h01
                p, q = h11 - h01, h01 - h00
            length = np.sqrt(1 + p * p + q * q)
            mx, my, mz = -p / length, -q / length, 1 / length
            mu = -(dx * mx + dy * my + dz * mz)
            wb, we = float(u[r]), float(v[r])
            wa = 1 - wb - we
            grazed = mu < -_BACK and min(wa, wb, we) < _EDGE
            if grazed:
                grazes += 1
            elif mu < -_BACK:
                end = -4
            elif order >= 1 and not multiple_scattering:
                end = -2
            else:
                mu = min(max(mu, 1e-12), 1.0)
                scattered_body = True
                if interface:
                    scattered_body = uniform[r, 0] < transmittance(mu, n, k)
                if scattered_body and not substrate:
                    end = -1
                else:
                    order += 1
                    if scattered_body:
                        body += 1
                        if body > result.BODY_EXACT and rng.random() >= survival:
                            end = -1
                        # A uniform point of the sphere that touches the facet is a cosine
                        # lobe; kept ∝ T(μ_o) it leaves every body event the same weight.
                        s, turn, chance = uniform[r, 1], uniform[r, 2], uniform[r, 3]
                        while True:
                            s = 2 * s - 1
                            azimuth = 2 * np.pi * turn
                            ring = np.sqrt(1 - s * s)
                            dx = mx + ring * np.cos(azimuth)
                            dy = my + ring * np.sin(azimuth)
                            dz = mz + s
                            norm = np.sqrt(dx * dx + dy * dy + dz * dz)
                            if norm > 1e-9:
                                dx, dy, dz = dx / norm, dy / norm, dz / norm
                                if not interface:
                                    break
                                mu_o = dx * mx + dy * my + dz * mz
                                if mu_o > 0 and chance * bound < transmittance(mu_o, n, 0.0):
                                    break
                            s, turn, chance = rng.random(), rng.random(), rng.random()
                    else:
                        dx, dy, dz = dx + 2 * mu * mx, dy + 2 * mu * my, dz + 2 * mu * mz
                        norm = np.sqrt(dx * dx + dy * dy + dz * dz)
                        dx, dy, dz = dx / norm, dy / norm, dz / norm
            if end == 0:
                # The start of the next ray, see the module's text.
                step = OFFSET * reach * (abs(mx) + abs(my) + abs(mz))
                inset = min(0.25, 2 * step * np.hypot(mx, my) + 2.0**-22 * reach)
                wa, wb, we = max(wa, inset), max(wb, inset), max(we, inset)
                total = wa + wb + we
                wa, wb, we = wa / total, wb / total, we / total
                px = (cx - MARGIN) % columns + MARGIN + x0
                py = (cy - MARGIN) % rows + MARGIN + y0
                px += wa * ax + wb * bx + we * ex + step * mx
                py += wa * ay + wb * by + we * ey + step * my
                pz = wa * az + wb * bz + we * ez + step * mz
                if dz > 0 and pz >= top:
                    end = 1
        if end == 0:
            origins[alive, 0], origins[alive, 1], origins[alive, 2] = px, py, pz
            rays[alive, 0], rays[alive, 1], rays[alive, 2] = dx, dy, dz
            directions[alive, 0], directions[alive, 1], directions[alive, 2] = dx, dy, dz
            state[alive, 0], state[alive, 1], state[alive, 2] = order, body, wraps
            alive += 1
            continue
        code = end
        if end == 1:
            if body > result.BODY_EXACT:
                body = np.searchsorted(body_edges, body, "right") - 1
            ring_index, last = 0, len(ring_cosines) - 1
            while ring_index < last:
                middle = (ring_index + last) // 2
                if dz <= ring_cosines[middle]:
                    ring_index = middle + 1
                else:
                    last = middle
            turn = (np.degrees(np.arctan2(dy, dx)) - phi_i) / 360 * result.SECTORS
            sector = int(np.floor(turn + 0.5)) % result.SECTORS
            code = (
                (body * len(result.ORDERS) + min(order, 4) - 1) * result.RINGS + ring_index
            ) * result.SECTORS + sector
        ended[over] = code
        over += 1
    return alive, over, grazes
