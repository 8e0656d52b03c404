"""What comes out of the substrate of a first facet, a whole azimuth at a time, compiled.

On a heightfield, what a point sees along one azimuth has one border: a ray that gets away
shows that all steeper ones do, a ray that is blocked that all flatter ones are. So light
that leaves a substrate is not sent as single paths but as a *fan*: an azimuth drawn from
the facet's lobe, and in it one direction for each of the detector's rings, each with its
share of the light. A few rays find the first ring that is blocked. What is steeper arrives
as a whole; the rest goes on as one path, along one of the blocked directions, drawn by
their shares. The shares add up to the light, so energy is conserved fan by fan.

The share of a ring is ∫ T(μ) μ sinθ dθ, with μ = m_z cosθ + m_t sinθ for a normal with
m_t along the azimuth: without an interface (T = 1) in closed form, else by Gauss's rule of
two nodes a ring, right to 1e−6 of the light for n ≤ 2.4. Its direction is drawn from the
density that is linear between the ring's edges. Rings go on below the horizon, where all
are blocked.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...jit import inlined
from ...results import detector
from .empty_space import push_ray

FAN = 9
START_X, START_Y, START_Z, COS_PHI, SIN_PHI, NORMAL_Z, NORMAL_T, RANDOM, LAST_THETA = range(FAN)
"""Numbers of a fan: its start x, y, z; cos φ, sin φ; m_z, m_t; the random number of its θ;
and the θ up to which the facet looks, 90° + arctan(m_t / m_z)."""
_GAUSS = 0.5 - 0.5 / np.sqrt(3)
_NEAR = 0.05  # radians
_LEVELS, _TILTS = 16, 8
LIKE = _LEVELS * _TILTS
"""Classes of fans that see alike, see `like`."""


class Rings(NamedTuple):
    """Rings in θ from the zenith to the nadir, and the facet whose light they share.

    Edges, their sines and cosines, those of Gauss's nodes; ∫ cosθ sinθ dθ and ∫ sin²θ dθ of
    each ring; index n, 1 without an interface.
    """

    edges: NDArray[np.float64]
    edge_sines: NDArray[np.float64]
    edge_cosines: NDArray[np.float64]
    sines: NDArray[np.float64]
    cosines: NDArray[np.float64]
    along_normal: NDArray[np.float64]
    across_normal: NDArray[np.float64]
    n: float


def all_rings(n: float) -> Rings:
    """The detector's rings, mirrored below the horizon."""
    up = np.radians(detector.RING_EDGES)
    edges = np.concatenate([up, np.pi - up[-2::-1]])
    nodes = edges[:-1, None] + np.diff(edges)[:, None] * np.array([_GAUSS, 1 - _GAUSS])
    sine, cosine = np.sin(edges), np.cos(edges)
    parts = np.diff(sine**2) / 2, np.diff(edges - sine * cosine) / 2
    return Rings(edges, sine, cosine, np.sin(nodes), np.cos(nodes), *parts, n)


@inlined
def _density(sine, cosine, mz, mt, n):
    """T(μ) μ sinθ; 0 where the facet does not look. T over one denominator, for speed."""
    mu = mz * cosine + mt * sine
    if mu <= 0:
        return 0.0
    if n == 1:
        return mu * sine
    g = np.sqrt((n - 1) * (n + 1) + mu * mu)
    across, along = g + mu, n * n * mu + g
    both = across * along
    return 2 * g * mu * (along * along + n * n * across * across) / (both * both) * mu * sine


@inlined
def shares(mz, mt, last, rings, into):
    """Light of each ring the facet looks into, up to ``last``; their number and their sum."""
    total = 0.0
    count = 0
    if rings.n == 1:
        while count < len(into) and rings.edges[count + 1] <= last:
            into[count] = mz * rings.along_normal[count] + mt * rings.across_normal[count]
            total += into[count]
            count += 1
        if count < len(into) and rings.edges[count] < last:
            low, sine, cosine = rings.edges[count], np.sin(last), np.cos(last)
            low_sine, low_cosine = rings.edge_sines[count], rings.edge_cosines[count]
            into[count] = mz * (sine - low_sine) * (sine + low_sine) / 2
            into[count] += mt * (last - low - (sine * cosine - low_sine * low_cosine)) / 2
            into[count] = max(into[count], 0.0)
            total += into[count]
            count += 1
        return count, total
    while count < len(into) and rings.edges[count] < last:
        low, high = rings.edges[count], rings.edges[count + 1]
        if high <= last:
            light = _density(
                rings.sines[count, 0], rings.cosines[count, 0], mz, mt, rings.n
            ) + _density(rings.sines[count, 1], rings.cosines[count, 1], mz, mt, rings.n)
        else:
            high = last
            light = 0.0
            for share in (_GAUSS, 1 - _GAUSS):
                node = low + share * (high - low)
                light += _density(np.sin(node), np.cos(node), mz, mt, rings.n)
        into[count] = 0.5 * (high - low) * light
        total += into[count]
        count += 1
    return count, total


@inlined
def elevation(ring, mz, mt, last, random_number, rings):
    """θ of a ring's direction: ``random_number`` in [0, 1) through the density of its light."""
    low, high = rings.edges[ring], rings.edges[ring + 1]
    a = _density(rings.edge_sines[ring], rings.edge_cosines[ring], mz, mt, rings.n)
    b = _density(rings.edge_sines[ring + 1], rings.edge_cosines[ring + 1], mz, mt, rings.n)
    if high > last - _NEAR:
        # Where the facet stops looking light falls as μ, with an interface as T(μ) μ ∝ μ².
        most, least = last - low, max(last - high, 0.0)
        if rings.n == 1:
            most, least = most * most, least * least
            return last - np.sqrt(most - random_number * (most - least))
        most, least = most * most * most, least * least * least
        return last - np.cbrt(most - random_number * (most - least))
    return low + (high - low) * random_number * (a + b) / (
        a + np.sqrt(a * a + random_number * (b * b - a * a))
    )


@inlined
def next_probe(fan, low, high, blocked_counts, grid):
    """Which ring to try, the first blocked one being in low … high: the median of like fans."""
    counts = blocked_counts[like(fan, grid)]
    total = 0
    for i in range(low, high + 1):
        total += counts[i]
    so_far = counts[low]
    ring = low
    while ring < high - 1 and 2 * so_far < total:
        ring += 1
        so_far += counts[ring]
    return ring


@inlined
def like(fan, grid):
    """Class of fans that see alike: those of similar height and tilt along their azimuth."""
    level = int((fan[START_Z] - grid.bottom) / (grid.top - grid.bottom + 1e-300) * _LEVELS)
    tilt = int(fan[LAST_THETA] / np.pi * _TILTS)
    return min(max(level, 0), _LEVELS - 1) * _TILTS + min(max(tilt, 0), _TILTS - 1)


@inlined
def probe(next_rays, alive, fan, ring, weight, batch, rings):
    """Send a ray along a fan's direction in one ring, from its start."""
    theta = elevation(ring, fan[NORMAL_Z], fan[NORMAL_T], fan[LAST_THETA], fan[RANDOM], rings)
    sine, cosine = np.sin(theta), np.cos(theta)
    push_ray(
        next_rays, alive, fan[START_X], fan[START_Y], fan[START_Z],
        sine * fan[COS_PHI], sine * fan[SIN_PHI], cosine, weight, 1, 1, 0, batch,
    )  # fmt: skip
    for j in range(FAN):
        next_rays.fan[alive, j] = fan[j]


@inlined
def sector_of(dx, dy, azimuth):
    """Sector of a direction, ``azimuth`` of incidence in degrees."""
    turn = (np.degrees(np.arctan2(dy, dx)) - azimuth) / 360 * detector.SECTORS
    return int(np.floor(turn + 0.5)) % detector.SECTORS


@inlined
def ring_of(dz, ring_cosines):
    """Ring of a direction; cosines of the rings' outer edges, shape (rings,)."""
    ring, last = 0, len(ring_cosines) - 1
    while ring < last:
        middle = (ring + last) // 2
        if dz <= ring_cosines[middle]:
            ring = middle + 1
        else:
            last = middle
    return ring


@inlined
def unfold(fan, first, weight, batch, azimuth, rings, light, tallies, random_number):
    """Count what a fan sees, rings below ``first``; the ring to go on along, and with what.

    Light is ``weight``; ``random_number`` in [0, 1) draws the ring, −1 if nothing is blocked.
    """
    count, total = shares(fan[NORMAL_Z], fan[NORMAL_T], fan[LAST_THETA], rings, light)
    sector = sector_of(fan[COS_PHI], fan[SIN_PHI], azimuth)
    arrived = 0.0
    for ring in range(min(first, count)):
        part = light[ring] * (weight / total)
        tallies.energy[1, 0, sector, ring] += part
        tallies.squares[1, sector, ring] += part * part
        arrived += light[ring]
    tallies.batches[batch, 0, 1] += arrived / total * weight
    blocked = total - arrived
    ring = min(first, count)
    left = random_number * blocked
    if ring == count:
        return -1, 0.0
    while ring < count - 1 and left >= light[ring]:
        left -= light[ring]
        ring += 1
    return ring, blocked / total * weight
