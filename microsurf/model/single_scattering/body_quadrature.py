"""The body integral over facets, in the slope plane.

With s = (−p, −q, 1), so m = s/|s|, and P22 the density of slopes,

    I(i, o) = ∫ T(i·m) T(o·m) ⟨i·m⟩⟨o·m⟩ G D(m) dm
            = ∫∫ T T (i·s)₊ (o·s)₊ / |s| · G · P22(p, q) dp dq.

In slopes scaled by the roughness, p = σ_x ρ cosα and q = σ_y ρ sinα, a direction
w is a line: w·s = w_z − ρ a cos(α − α_w) with a = (σ_x w_x, σ_y w_y). All the
places where the integrand is not smooth are lines:

- L_i and L_o, where i·s or o·s vanish and the domain ends;
- for V-cavities their mirror images through the origin, where i·s = 2 i_z or
  o·s = 2 o_z and the minimum in G switches, and the line through the origin
  where it switches between its two terms. That line goes through L_i ∩ L_o.

So the circle of α is cut where the nearest line changes, or goes to infinity,
and each radius is cut at the lines it meets. On an arc, Gauss–Legendre nodes are
drawn towards both ends (there the radius grows like 1/δ, and heavy tails leave
powers δ^(2γ−2)); on a radius ρ = ρ₀ sinh(L sinh(τ/L)) puts nodes evenly over the
decades between the core of the slopes and the slope 1, ever thinner beyond. The
integrand beyond the last node is a power of ρ, −(2γ−2), and added in closed form.
"""

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...physics import fresnel, student_t

Array = NDArray[np.float64]
_Ray = tuple[Array, ...]  # i_z, o_z, a_i, a_o and the slope at ρ = 1 along each ray

_TAIL = 1e-10  # part of the integral on which the power law beyond the last node may be wrong
_STRETCH = 4.0  # L of the radial map: e-foldings of even spacing before it widens
_CHUNK = 250  # arcs evaluated at a time: the temporaries stay in the cache

# Numbers of nodes, found by doubling them: a relative error of 1e−6 in I over γ from
# 1.505 to ∞, σ from 1e−3 to 5 and θ to 89.9°; 4e−6 where n is 1.001 and σ is 5, or
# where one σ is 100 times the other. At n = 100, where T falls to 0 within 1/n of grazing,
# and beyond 89.9° against doubled nodes: up to 1.5e−4, median 1e−9.
_DRAWN = 2.0  # least c of the map of an arc, see `_arcs`
_NODES_OF_ARC = 26.0  # at that c …
_NODES_PER_C = 12.0  # … and more for each unit above it
_NODES_OF_RADIUS = 8.0
_NODES_PER_TAU = 4.0  # for each unit of τ …
_TAU_STEP = 1.0  # … of the radius, in steps of


@cache
def gauss(nodes: int) -> tuple[Array, Array]:
    """Gauss–Legendre nodes and weights on [−1, 1], kept: making them costs more than their use."""
    return np.polynomial.legendre.leggauss(nodes)


def body_integral(
    i: Array,
    o: Array,
    gamma: float,
    sigma_x: float,
    sigma_y: float,
    n: float,
    *,
    vcavity: bool = False,
    refinement: float = 1.0,
) -> Array:
    """I(i, o) of the module's text for pairs of directions; G is 1, or the V-cavity's.

    Parameters
    ----------
    i, o : array, shape (pairs, 3)
        Unit directions with positive z.
    gamma, sigma_x, sigma_y, n : float
        STD shape in (3/2, ∞], roughness > 0, relative index ≥ 1.
    vcavity : bool
        Whether G of Torrance and Sparrow belongs to the integrand. (Smith's G2
        does not depend on m.)
    refinement : float
        Factor on all numbers of nodes: two of them tell the error of the quadrature.

    """
    plane = _Plane(gamma, sigma_x, sigma_y, n, vcavity)
    scale = np.array([sigma_x, sigma_y])
    pairs = max(1, int(_CHUNK / (refinement**2 * plane.cuts)))
    total = np.zeros(len(i))
    for start in range(0, len(i), pairs):
        part = slice(start, start + pairs)
        lines = _Lines(i[part, 2], o[part, 2], i[part, :2] * scale, o[part, :2] * scale)
        total[part] = _chunk(plane, lines, refinement)
    return total


class _Plane(NamedTuple):
    """The slope plane: STD shape, roughness, relative index, masking in the integrand."""

    gamma: float
    sigma_x: float
    sigma_y: float
    n: float
    vcavity: bool

    @property
    def core(self) -> float:
        """ρ₀: the smallest distance of a complex singularity from ρ = 0."""
        spread = 1.0 if np.isinf(self.gamma) else min(1.0, float(np.sqrt(self.gamma - 1)))
        return min(spread, 1 / max(self.sigma_x, self.sigma_y))

    @property
    def end(self) -> float:
        """ρ from which on the integrand is a power of ρ, or nothing."""
        decades = -np.log(_TAIL * min(1.0, self.sigma_x, self.sigma_y))
        if np.isinf(self.gamma):
            return float(np.sqrt(decades))
        return float(np.sqrt((self.gamma - 1) * np.expm1(decades / (self.gamma - 1))))

    @property
    def cuts(self) -> int:
        """Number of arcs of the circle."""
        return (6 if self.vcavity else 3) + (0 if self.sigma_x == self.sigma_y else 2)

    def tau(self, rho: Array) -> Array:
        """τ of ρ = ρ₀ sinh(L sinh(τ/L))."""
        return np.asarray(_STRETCH * np.arcsinh(np.arcsinh(rho / self.core) / _STRETCH))


class _Lines(NamedTuple):
    """L_i and L_o of some pairs: w_z, and (a_x, a_y) of the module's text."""

    i_z: Array
    o_z: Array
    i: Array
    o: Array


def _chunk(plane: _Plane, lines: _Lines, refinement: float) -> Array:
    """Integrate over the whole plane for the pairs of one chunk."""
    alpha, weight = _arcs(plane, lines, refinement)
    cosine, sine = np.cos(alpha), np.sin(alpha)
    a_i = lines.i[:, :1] * cosine + lines.i[:, 1:] * sine
    a_o = lines.o[:, :1] * cosine + lines.o[:, 1:] * sine
    i_z, o_z = lines.i_z[:, None], lines.o_z[:, None]
    ray = (i_z, o_z, a_i, a_o, np.hypot(plane.sigma_x * cosine, plane.sigma_y * sine))
    end = np.minimum(_crossing(i_z, a_i), _crossing(o_z, a_o))
    last = np.minimum(end, plane.end)
    first = np.zeros_like(last)
    if plane.vcavity:
        switch = np.minimum(np.minimum(_crossing(i_z, -a_i), _crossing(o_z, -a_o)), last)
        radial = _radius(plane, ray, first, switch, refinement)
        radial += _radius(plane, ray, switch, last, refinement)
    else:
        radial = _radius(plane, ray, first, last, refinement)
    radial += np.where(end > plane.end, _tail(plane, ray), 0.0)
    return np.asarray(np.sum(radial * weight, axis=1) / np.pi)


def _crossing(w_z: Array, a: Array) -> Array:
    """ρ at which a ray with slope a along it meets the line w_z = ρ a; ∞ if never."""
    with np.errstate(over="ignore"):
        return np.where(a > 0, w_z / np.where(a > 0, a, 1.0), np.inf)


def _breaks(plane: _Plane, lines: _Lines) -> Array:
    """Azimuths that cut the circle, unsorted, shape (pairs, cuts)."""
    i, o = lines.i, lines.o
    side = np.where(i[:, 0] * o[:, 1] - i[:, 1] * o[:, 0] < 0, -1.0, 1.0)
    i_end = np.arctan2(i[:, 1], i[:, 0]) - side * np.pi / 2
    o_end = np.arctan2(o[:, 1], o[:, 0]) + side * np.pi / 2

    def crossings(o_z: Array) -> Array:
        """Azimuth of the point where a_i·x = i_z and a_o·x = o_z."""
        y = side * (o_z * i[:, 0] - lines.i_z * o[:, 0])
        return np.asarray(np.arctan2(y, side * (lines.i_z * o[:, 1] - o_z * i[:, 1])))

    corner = crossings(lines.o_z)
    breaks = [i_end, o_end, corner]
    if plane.vcavity:
        mirrored = crossings(-lines.o_z)
        breaks += [corner + np.pi, mirrored, mirrored + np.pi]
    if plane.sigma_x != plane.sigma_y:
        # Across the direction of the small σ, |s| changes within its ratio to the other.
        smooth = np.full_like(side, 0.0 if plane.sigma_x < plane.sigma_y else np.pi / 2)
        breaks += [smooth, smooth + np.pi]
    return np.stack(breaks, axis=1)


def _arcs(plane: _Plane, lines: _Lines, refinement: float) -> tuple[Array, Array]:
    """Nodes and weights in α, shape (pairs, cuts·nodes), drawn towards the ends of each arc.

    The fraction of the arc is tanh(c x)/tanh(c), c the larger the smaller the scale
    on which the integrand changes near the ends: w_z/a, at which the line of a
    grazing direction passes the origin, and the ratio of the roughnesses.
    """
    start = np.sort(np.mod(_breaks(plane, lines), 2 * np.pi), axis=1)
    length = np.diff(start, axis=1, append=start[:, :1] + 2 * np.pi)
    middle = start + length / 2
    i_z, o_z = lines.i_z[:, None], lines.o_z[:, None]
    near_i = i_z / np.maximum(np.hypot(lines.i[:, :1], lines.i[:, 1:]), i_z)
    near_o = o_z / np.maximum(np.hypot(lines.o[:, :1], lines.o[:, 1:]), o_z)
    if plane.vcavity:
        near = np.minimum(near_i, near_o) * np.ones_like(middle)
    else:
        cosine, sine = np.cos(middle), np.sin(middle)
        toward_i = (lines.i[:, :1] * cosine + lines.i[:, 1:] * sine) / i_z
        toward_o = (lines.o[:, :1] * cosine + lines.o[:, 1:] * sine) / o_z
        near = np.where(toward_i > toward_o, near_i, near_o)
        near = np.where(np.maximum(toward_i, toward_o) > 0, near, 1.0)
    ratio = max(plane.sigma_x, plane.sigma_y) / min(plane.sigma_x, plane.sigma_y)
    c = (_DRAWN + 0.5 * np.log(ratio / near))[..., None]
    nodes = _NODES_OF_ARC + _NODES_PER_C * (float(c.max()) - _DRAWN)
    x, w = gauss(int(np.ceil(refinement * nodes)))
    fraction = (1 + np.tanh(c * x) / np.tanh(c)) / 2
    density = c / (2 * np.cosh(c * x) ** 2 * np.tanh(c))
    alpha = start[..., None] + length[..., None] * fraction
    weight = length[..., None] * density * w
    return alpha.reshape(len(start), -1), weight.reshape(len(start), -1)


def _radius(plane: _Plane, ray: _Ray, low: Array, high: Array, refinement: float) -> Array:
    """Integrate along each ray from ρ = low to high, shorter ones with fewer nodes."""
    shape = low.shape
    start = plane.tau(low).ravel()
    length = plane.tau(high).ravel() - start
    flat = tuple(np.broadcast_to(part, shape).ravel() for part in ray)
    total = np.zeros(start.size)
    steps = np.ceil(length / _TAU_STEP).astype(int)
    for step in np.unique(steps[steps > 0]):
        nodes = int(np.ceil(refinement * (_NODES_OF_RADIUS + _NODES_PER_TAU * _TAU_STEP * step)))
        x, w = gauss(nodes)
        rays = np.flatnonzero(steps == step)
        half = length[rays, None] / 2
        xi = _STRETCH * np.sinh((start[rays, None] + half * (1 + x)) / _STRETCH)
        rho = plane.core * np.sinh(xi)
        jacobian = np.sqrt((plane.core**2 + rho**2) * (1 + (xi / _STRETCH) ** 2))
        values = _integrand(plane, tuple(part[rays, None] for part in flat), rho)
        total[rays] = ((values * jacobian) @ w) * half[:, 0]
    return total.reshape(shape)


def _tail(plane: _Plane, ray: _Ray) -> Array:
    """Integral beyond the last node, where the integrand falls as a power of ρ."""
    i_z, o_z, a_i, a_o, _ = ray
    if np.isinf(plane.gamma):
        return np.zeros_like(a_i)
    rho = np.full_like(a_i, plane.end)
    power = np.full_like(a_i, 2 * plane.gamma - 3)
    if plane.vcavity:
        masking = _vcavity(i_z, o_z, i_z - rho * a_i, o_z - rho * a_o)
        power += np.where(masking < 1, 1 - masking / 2, 0.0)
    return np.asarray(_integrand(plane, ray, rho) * rho / power)


def _vcavity(i_z: Array, o_z: Array, i_s: Array, o_s: Array) -> Array:
    """G of Torrance and Sparrow; 2 (n·m)(n·w)/(w·m) = 2 w_z/(w·s)."""
    return np.asarray(2 / np.maximum(2, np.maximum(i_s / i_z, o_s / o_z)))


def _integrand(plane: _Plane, ray: _Ray, rho: Array) -> Array:
    """T T (i·s)₊(o·s)₊/|s| G K(ρ) ρ, K = π σ_x σ_y P22."""
    i_z, o_z, a_i, a_o, slope = ray
    i_s = np.maximum(i_z - rho * a_i, 0.0)
    o_s = np.maximum(o_z - rho * a_o, 0.0)
    length = np.sqrt(1 + (rho * slope) ** 2)
    value = np.exp(student_t.log_kernel(rho**2, plane.gamma)) * (rho / length) * i_s * o_s
    if plane.n > 1:
        value *= fresnel.transmittance(i_s / length, plane.n)
        value *= fresnel.transmittance(o_s / length, plane.n)
    if plane.vcavity:
        value *= _vcavity(i_z, o_z, i_s, o_s)
    return np.asarray(value)
