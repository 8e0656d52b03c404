"""Shares of a fan's rings in loops that a processor takes several at a time, compiled.

The numbers are those of `lobe_fans.shares`, the quadrature too; only their order in memory is
made for speed, and the slopes of rings are looked up.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...jit import inlined
from .exact_walk import LEAST
from .lobe_fans import LAST_THETA, NORMAL_T, NORMAL_Z, Rings, elevation, shares

_LEVEL = 1e-7  # least slope of a fan's ray: a level one would never end


class Nodes(NamedTuple):
    """Gauss's nodes of all rings one after the other, and the slopes at the rings' edges.

    Sines times half the ring's width, sines and cosines at the nodes, each of shape
    (2 rings,); cotangents of the edges, shape (rings + 1,), ∞ at the zenith.
    """

    weights: NDArray[np.float64]
    sines: NDArray[np.float64]
    cosines: NDArray[np.float64]
    slopes: NDArray[np.float64]


def nodes_of(rings: Rings) -> Nodes:
    """Rearrange the numbers of rings."""
    half = np.diff(rings.edges)[:, None] / 2
    with np.errstate(divide="ignore"):
        slopes = rings.edge_cosines / np.maximum(rings.edge_sines, 0)
    weights = (half * rings.sines).ravel()
    return Nodes(weights, rings.sines.ravel(), rings.cosines.ravel(), slopes)


@inlined
def sum_of(numbers, count):
    """Sum of the first ``count`` numbers, in four parts: one sum would wait for each addition."""
    a = b = c = d = 0.0
    whole = count - count % 4
    for i in range(0, whole, 4):
        a += numbers[i]
        b += numbers[i + 1]
        c += numbers[i + 2]
        d += numbers[i + 3]
    for i in range(whole, count):
        a += numbers[i]
    return (a + b) + (c + d)


@inlined
def ring_shares(mz, mt, last, rings, nodes, light, into):
    """Light of each ring the facet looks into, up to ``last``; their number and their sum.

    ``light`` is room for two numbers a ring.
    """
    if rings.n == 1:
        count, total = shares(mz, mt, last, rings, into)
    else:
        whole = np.searchsorted(rings.edges, last, "right") - 1
        base, n2 = (rings.n - 1) * (rings.n + 1), rings.n * rings.n
        for i in range(2 * whole):
            mu = abs(mz * nodes.cosines[i] + mt * nodes.sines[i])
            g = np.sqrt(base + mu * mu)
            across, along = g + mu, n2 * mu + g
            both = across * along
            light[i] = (
                2 * g * (along * along + n2 * across * across)
                / (both * both) * mu * mu * nodes.weights[i]
            )  # fmt: skip
        for ring in range(whole):
            into[ring] = light[2 * ring] + light[2 * ring + 1]
        total = sum_of(into, whole)
        count = whole
        if whole < len(into) and rings.edges[whole] < last:
            # The ring in which the facet stops looking.
            low = rings.edges[whole]
            into[whole] = 0.0
            for share in (_GAUSS, 1 - _GAUSS):
                node = low + share * (last - low)
                sine = np.sin(node)
                mu = abs(mz * np.cos(node) + mt * sine)
                g = np.sqrt(base + mu * mu)
                across, along = g + mu, n2 * mu + g
                both = across * along
                into[whole] += (
                    (last - low) * g * (along * along + n2 * across * across)
                    / (both * both) * mu * mu * sine
                )  # fmt: skip
            total += into[whole]
            count += 1
    return count, total


_GAUSS = 0.5 - 0.5 / np.sqrt(3)


@inlined
def steeper(ring, slope, needed, mz, mt, last, chance, rings, nodes):
    """First ring from ``ring`` up whose next ray is steeper than ``needed``, and its slope.

    Rays of rings from the returned one on are blocked; the slope is that of the next ray.
    """
    while ring > 0 and slope <= needed:
        ring -= 1
        while ring > 0 and nodes.slopes[ring - 1] <= needed:
            ring -= 1
        slope = np.inf
        if ring > 0:
            theta = elevation(ring - 1, mz, mt, last, chance, rings)
            slope = max(np.cos(theta) / max(np.sin(theta), LEAST), _LEVEL)
    return ring, slope


@inlined
def deposit(fan, first, weight, batch, sector, rings, nodes, light, into, tallies, chance):
    """Count what a fan sees, rings below ``first``; the ring to go on along, and with what.

    As `lobe_fans.unfold`: ``chance`` in [0, 1) draws the ring, which is −1 if nothing is blocked.
    """
    count, total = ring_shares(
        fan[NORMAL_Z], fan[NORMAL_T], fan[LAST_THETA], rings, nodes, light, into
    )
    scale = weight / total
    first = min(first, count)
    energy, squares = tallies.energy[1, 0, sector], tallies.squares[1, sector]
    for ring in range(first):
        part = into[ring] * scale
        energy[ring] += part
        squares[ring] += part * part
    arrived = sum_of(into, first)
    tallies.batches[batch, 0, 1] += arrived * scale
    blocked = total - arrived
    ring = first
    left = chance * blocked
    if ring == count:
        ring = -1
        blocked = 0.0
    else:
        while ring < count - 1 and left >= into[ring]:
            left -= into[ring]
            ring += 1
    return ring, blocked * scale
