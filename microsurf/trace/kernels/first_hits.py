"""First hits and their shadow rays between two calls of Embree; compiled."""

from ...jit import compiled
from .empty_space import push_ray
from .intersection import CONTINUES, ESCAPED, classify_ray
from .state import BATCH, ORDER, RETRIES


@compiled
def record_first_hits(active, rays, next_rays, hits, grid, frame, hit, free):
    """Record what each ray met, push what goes on to ``next_rays``; how many do, how many are lost.

    Of a ray's state, order 0 is light and 1 what was mirrored; the batch is its number.
    """
    alive = lost = 0
    for r in range(active):
        dx, dy, dz = rays.directions[r, 0], rays.directions[r, 1], rays.directions[r, 2]
        order, number = rays.state[r, ORDER], rays.state[r, BATCH]
        status, _, again, mx, my, mz, mu, px, py, pz, wraps = classify_ray(
            r, rays, hits, grid, frame, order == 0
        )
        if status == CONTINUES:
            push_ray(next_rays, alive, px, py, pz, dx, dy, dz, 1.0, order, 0, wraps, number)
            next_rays.state[alive, RETRIES] = again
            alive += 1
        elif status >= 0:
            lost += 1
        elif status == ESCAPED:
            free[number] = order == 1
        elif order == 0:
            hit[number] = hits.triangle[r]
            ox, oy, oz = dx + 2 * mu * mx, dy + 2 * mu * my, dz + 2 * mu * mz
            if oz > 0 and pz >= frame.top:
                free[number] = True
            elif oz > 0:
                push_ray(next_rays, alive, px, py, pz, ox, oy, oz, 1.0, 1, 0, wraps, number)
                alive += 1
    return alive, lost
