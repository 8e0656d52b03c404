"""References for the model, written from the papers and sharing no code with it."""

import math
from itertools import pairwise

import numpy as np
from scipy.integrate import quad


def direction(theta, phi):
    """Unit direction from degrees."""
    t, p = math.radians(theta), math.radians(phi)
    return np.array([math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), math.cos(t)])


def transmittance(mu, n):
    """1 − F from the textbook's amplitudes."""
    if n == 1:
        return 1.0
    inside = math.sqrt(1 - (1 - mu * mu) / n**2)
    r_s = (mu - n * inside) / (mu + n * inside)
    r_p = (n * mu - inside) / (n * mu + inside)
    return 1 - (r_s**2 + r_p**2) / 2


def density(p, q, gamma, sigma_x, sigma_y):
    """Student's t density of slopes, or the normal one at γ = ∞."""
    rho2 = (p / sigma_x) ** 2 + (q / sigma_y) ** 2
    if math.isinf(gamma):
        return math.exp(-rho2) / (math.pi * sigma_x * sigma_y)
    return (1 + rho2 / (gamma - 1)) ** -gamma / (math.pi * sigma_x * sigma_y)


def body_integral(i, o, gamma, sigma_x, sigma_y, n, *, vcavity=False, tolerance=1e-9):
    """∫ T T ⟨i·m⟩⟨o·m⟩ G D dm by adaptive quadrature (QUADPACK) in Cartesian slopes.

    x lies along the azimuth of i and y across, cut where G or the domain switches.
    """
    rise = math.hypot(i[0], i[1])
    c, s = (i[0] / rise, i[1] / rise) if rise > 0 else (1.0, 0.0)
    along, across = o[0] * c + o[1] * s, o[1] * c - o[0] * s

    def integrand(y, x):
        length = math.sqrt(1 + x * x + y * y)
        i_s, o_s = i[2] - x * rise, o[2] - x * along - y * across
        if i_s <= 0 or o_s <= 0:
            return 0.0
        value = i_s * o_s / length * density(x * c - y * s, x * s + y * c, gamma, sigma_x, sigma_y)
        value *= transmittance(i_s / length, n) * transmittance(o_s / length, n)
        if vcavity:
            value *= min(1, 2 * i[2] / i_s, 2 * o[2] / o_s)
        return value

    def inner(x):
        cuts = [-math.inf, 0.0, math.inf]
        if abs(across) > 1e-12:
            edge = (o[2] - x * along) / across
            cuts[0 if across < 0 else 2] = edge
            cuts[1] = edge - math.copysign(1, across) * max(sigma_x, sigma_y, abs(edge))
            cuts += [0.0]
            if vcavity:
                cuts += [(-o[2] - x * along) / across]  # o·s = 2 o_z
                cuts += [(o[2] - o[2] / i[2] * (i[2] - x * rise) - x * along) / across]
        return pieces(lambda y: integrand(y, x), cuts, tolerance / 10)

    outer = [-math.inf, -max(sigma_x, sigma_y), 0.0]
    outer += [i[2] / rise, -i[2] / rise] if rise > 1e-12 else [math.inf, 1.0]
    if abs(across) <= 1e-12 and abs(along) > 1e-12:
        outer += [o[2] / along, -o[2] / along]
    return pieces(inner, outer, tolerance)


def pieces(function, cuts, tolerance):
    """Sum of adaptive integrals between sorted cuts; beyond the smallest and largest nothing.

    With full_output QUADPACK keeps its doubts about heavy tails to itself: whether
    it was right is what the comparison at a stated tolerance says.
    """
    return sum(
        quad(function, low, high, epsabs=1e-14, epsrel=tolerance, limit=200, full_output=1)[0]
        for low, high in pairwise(sorted(set(cuts)))
    )
