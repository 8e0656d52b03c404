"""First hits and their shadow rays between two calls of Embree; compiled."""

from .compile import compiled
from .empty_space import put
from .meeting import BACK, meet, onward
from .wave import BEHIND, BELOW

_AGAIN = 3  # times a ray that fell through an edge is sent again, as in `events`


@compiled
def take_hits(active, wave, then, triangle, u, v, grid, x0, y0, top, reach, hit, free):
    """Note what each ray met, and put what goes on into ``then``; how many do, how many are lost.

    Of a ray's state, order 0 is light and 1 what was mirrored; the batch is its number.
    """
    alive = lost = 0
    for r in range(active):
        dx, dy, dz = wave.directions[r, 0], wave.directions[r, 1], wave.directions[r, 2]
        order, wraps, number = wave.state[r, 0], wave.state[r, 2], wave.state[r, 3]
        again = wave.state[r, 7]
        grazed = out = False
        end = -1
        mx = my = mz = mu = 0.0
        if triangle[r] < 0:
            gone, end, px, py, pz, wraps = onward(r, wave, grid, x0, y0, top, reach)
            out = gone == 1
            same = not out and end < 0
        else:
            mx, my, mz, mu, grazed, px, py, pz = meet(
                r, wave, triangle[r], u[r], v[r], grid, x0, y0, reach, order == 0
            )
            same = grazed
            if mu < -BACK and not grazed:
                end = BEHIND
        if end in (BELOW, BEHIND) and again < _AGAIN:
            again += 1
            lift = again * 2.0**-20 * reach
            aside = lift if order == 0 else 0.0
            px, py = wave.origins[r, 0] + aside, wave.origins[r, 1] + 0.7 * aside
            pz = wave.origins[r, 2] + lift
            wraps = wave.state[r, 2]
            same = True
        if same:
            put(then, alive, px, py, pz, dx, dy, dz, 1.0, order, 0, wraps, number)
            then.state[alive, 7] = again
            alive += 1
        elif end >= 0:
            lost += 1
        elif out:
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
