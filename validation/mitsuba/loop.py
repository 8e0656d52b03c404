"""Mitsuba's paths over the period, all in one symbolic loop: Dr.Jit makes it one kernel.

Import it when Mitsuba's variant is set, through `mitsuba.load`.
"""

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from microsurf.results import detector

from .period import MARGIN, Period

MOST_WRAPS = 1000
ROULETTE = 16
"""Events after which weak paths may end, without bias: as many as microsurf follows."""

OFFSET = 4 * 2.0**-23
"""Start of the next ray above its facet, in greatest coordinates, as in microsurf.

Mitsuba's own spawn_ray steps 1500 · 2^−24 of them: on a tile of 128 cells that skips 2 to
4 % of the light of order 4 and more, which lives in the bottoms of valleys.
"""

_BELOW, _BEHIND, _WRAPPED = range(3)
_KINDS = len(detector.KINDS)


def follow(
    scene: Any, sampler: Any, period: Period, theta: float, bits: int, *, ordered: bool
) -> tuple[NDArray[np.float64], list[int]]:
    """Follow 2^bits paths from (θ, φ = 0): weights by bin, and paths lost by cause.

    Energy is carried, not radiance: what passes an interface is not scaled by its index. Order
    is how often a path meets, from outside, a facet that mirrors; body is what has been below one.

    Returns
    -------
    bins : ndarray, shape (orders, kinds, rings, sectors)
        Sum of the weights of the paths that left into each bin.
    lost : list of int
        Paths lost, in the order of `mitsuba.LOST`.

    """
    tilt = np.radians(theta)
    incident = mi.Vector3f(float(-np.sin(tilt)), 0.0, float(-np.cos(tilt)))
    dr.make_opaque(incident)  # one kernel for all angles
    shape = (len(detector.ORDERS), _KINDS, detector.RINGS, detector.SECTORS)
    bins = dr.zeros(mi.Float, int(np.prod(shape)))
    lost = dr.zeros(mi.UInt32, 3)
    ring_edges = mi.Float(detector.RING_EDGES.astype(np.float32))
    x, y = _unit_square(sampler, bits, ordered=ordered)
    left, front = float(-(period.columns // 2)), float(-(period.rows // 2))
    # A little above the highest vertex: a start on it would be a matter of rounding.
    start = mi.Point3f(left + period.columns * x, front + period.rows * y, period.top + 1e-3)
    step = OFFSET * max(period.rows, period.columns, -2 * period.bottom, 2 * period.top) / 2
    count = 2**bits

    def go_on(active: Any, *_: Any) -> Any:
        return active

    def bounce(
        active: Any, ray: Any, weight: Any, order: Any, is_body: Any, wraps: Any, sampler: Any
    ) -> tuple[Any, ...]:
        found = scene.ray_intersect_preliminary(ray, coherent=False, active=active)
        at = found.compute_surface_interaction(ray, mi.RayFlags.All, active)
        hit, miss = active & at.is_valid(), active & ~at.is_valid()
        behind = hit & (at.wi.z <= 0) & ~mi.has_flag(at.bsdf().flags(), mi.BSDFFlags.BackSide)
        event = hit & ~behind
        outer, inner, factor, spawned = _scatter(at, sampler, event, step)
        order = dr.select(event & outer, order + 1, order)
        is_body |= event & inner
        weight = dr.select(event, weight * factor, weight)
        thinned = event & (order > ROULETTE)
        survival = dr.select(thinned, dr.minimum(weight, 0.95), 1.0)
        ended = event & (sampler.next_1d() >= survival)
        weight /= survival

        t = _to_side(ray, left, front, period)
        out = ray(t)
        escaped = miss & (ray.d.z > 0) & (out.z >= period.top)
        below = miss & (out.z < period.bottom)
        wrapped = miss & ~escaped & ~below
        wraps = dr.select(wrapped, wraps + 1, wraps)
        tired = wrapped & (wraps > MOST_WRAPS)
        out.x -= period.columns * dr.floor((out.x - left) / period.columns)
        out.y -= period.rows * dr.floor((out.y - front) / period.rows)
        ray = dr.select(event, spawned, ray)
        ray.o = dr.select(wrapped, out, ray.o)

        place = (dr.minimum(order, len(detector.ORDERS)) - 1) * _KINDS + dr.select(is_body, 1, 0)
        place = (place * detector.RINGS + _ring(ray.d, ring_edges)) * detector.SECTORS
        dr.scatter_add(bins, weight, place + _sector(ray.d), escaped & (order > 0))
        for cause, here in ((_BELOW, below), (_BEHIND, behind), (_WRAPPED, tired)):
            dr.scatter_add(lost, mi.UInt32(1), mi.UInt32(cause), here)
        active &= ~(escaped | below | behind | tired | ended)
        return active, ray, weight, order, is_body, wraps, sampler

    state = (
        dr.full(mi.Bool, True, count),
        mi.Ray3f(start, incident),
        dr.ones(mi.Float, count),
        dr.zeros(mi.UInt32, count),
        dr.zeros(mi.Bool, count),
        dr.zeros(mi.UInt32, count),
        sampler,
    )
    dr.while_loop(state, go_on, bounce, mode="symbolic")
    return np.asarray(bins.numpy(), np.float64).reshape(shape), lost.numpy().tolist()


def _scatter(at: Any, sampler: Any, event: Any, step: float) -> tuple[Any, Any, Any, Any]:
    """Whether a mirror is met from outside, whether light has been below, factor, and next ray."""
    bsdf, mirror = at.bsdf(), mi.BSDFFlags.DeltaReflection
    context = mi.BSDFContext(mi.TransportMode.Importance)
    sampled, factor = bsdf.sample(context, at, sampler.next_1d(), sampler.next_2d(), event)
    outer = (at.wi.z > 0) & mi.has_flag(bsdf.flags(), mirror)
    inner = ~mi.has_flag(sampled.sampled_type, mirror)
    away = dr.select(sampled.wo.z > 0, step, -step)
    return outer, inner, factor.x, mi.Ray3f(at.p + away * at.n, at.to_world(sampled.wo))


def _to_side(ray: Any, left: float, front: float, period: Period) -> Any:
    """Distance to the side through which the ray leaves the tile, margin included."""
    side_x = dr.select(ray.d.x > 0, left + period.columns + MARGIN, left - MARGIN)
    side_y = dr.select(ray.d.y > 0, front + period.rows + MARGIN, front - MARGIN)
    # Light from φ = 0 has d_y = 0: without these it would stand still, and be lost.
    t_x = dr.select(ray.d.x == 0, dr.inf, (side_x - ray.o.x) / ray.d.x)
    t_y = dr.select(ray.d.y == 0, dr.inf, (side_y - ray.o.y) / ray.d.y)
    return dr.maximum(dr.minimum(t_x, t_y), 0.0)


def _ring(direction: Any, edges: Any) -> Any:
    """Index of the ring of `microsurf.results.datasets` that the direction lies in."""
    theta = dr.rad2deg(dr.safe_acos(direction.z))
    last = detector.RINGS - 1
    above = dr.binary_search(0, last, lambda k: dr.gather(mi.Float, edges, k + 1) <= theta)
    return dr.minimum(above, last)


def _sector(direction: Any) -> Any:
    """Index of the sector, about φ_o − φ_i of whole multiples of 10°."""
    turn = dr.atan2(direction.y, direction.x) / dr.two_pi * detector.SECTORS
    whole = mi.Int32(dr.floor(turn + 0.5))
    return mi.UInt32(dr.select(whole < 0, whole + detector.SECTORS, whole))


def _even_bits(code: Any) -> Any:
    """Gather every second bit: one coordinate of a Morton code."""
    code = code & 0x55555555
    for shift, mask in ((1, 0x33333333), (2, 0x0F0F0F0F), (4, 0x00FF00FF), (8, 0x0000FFFF)):
        code = (code | (code >> shift)) & mask
    return mi.Float(code)


def _unit_square(sampler: Any, bits: int, *, ordered: bool) -> tuple[Any, Any]:
    """2^bits points, independent or one in each 2^−bits of a Morton curve and in its order."""
    if not ordered:
        point = sampler.next_2d()
        return point.x, point.y
    free = 32 - bits
    finer = mi.UInt32(sampler.next_1d() * float(2**free))
    code = (dr.arange(mi.UInt32, 2**bits) << free) | finer
    jitter = sampler.next_2d()
    return (
        (_even_bits(code) + jitter.x) * 2.0**-16,
        (_even_bits(code >> 1) + jitter.y) * 2.0**-16,
    )
