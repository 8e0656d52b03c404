"""First hits and their shadow rays between two calls of Embree; compiled."""

from ...jit import compiled
from .empty_space import put
from .intersection import ON, OUT, arrival


@compiled
def take_hits(active, wave, then, triangle, u, v, grid, x0, y0, top, reach, hit, free):
    """Note what each ray met, and put what goes on into ``then``; how many do, how many are lost.

    Of a ray's state, order 0 is light and 1 what was mirrored; the batch is its number.
    """
    alive = lost = 0
    for r in range(active):
        dx, dy, dz = wave.directions[r, 0], wave.directions[r, 1], wave.directions[r, 2]
        order, number = wave.state[r, 0], wave.state[r, 3]
        fate, _, again, mx, my, mz, mu, px, py, pz, wraps = arrival(
            r, wave, triangle[r], u[r], v[r], grid, x0, y0, top, reach, order == 0
        )
        if fate == ON:
            put(then, alive, px, py, pz, dx, dy, dz, 1.0, order, 0, wraps, number)
            then.state[alive, 7] = again
            alive += 1
        elif fate >= 0:
            lost += 1
        elif fate == OUT:
            free[number] = order == 1
        elif order == 0:
            hit[number] = triangle[r]
            ox, oy, oz = dx + 2 * mu * mx, dy + 2 * mu * my, dz + 2 * mu * mz
            if oz > 0 and pz >= top:
                free[number] = True
            elif oz > 0:
                put(then, alive, px, py, pz, ox, oy, oz, 1.0, 1, 0, wraps, number)
                alive += 1
    return alive, lost
