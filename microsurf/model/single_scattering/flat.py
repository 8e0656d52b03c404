"""σ = 0: one flat interfaced-Lambertian interface (Simonot, Applied Optics 48(30), 5793, 2009)."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...physics import facet, fresnel
from ...results import detector
from ...scene import Scene

Array = NDArray[np.float64]

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)


def body(cos_i: ArrayLike, cos_o: ArrayLike, n: float) -> Array:
    """Body BRDF T(i) T(o)/(π (1 − r_e)) in sr⁻¹ at unit body weight; 0 below the horizon."""
    return facet.body(cos_i, cos_o, n, 1.0)


def lobes(scene: Scene, theta: float) -> Array:
    """Both energies in each bin at unit body weight, shape (2, rings, sectors); θ in radians.

    What the scene does not have is 0.
    """
    n, needs = scene.material.n, scene.requires
    bins = np.zeros((2, detector.RINGS, detector.SECTORS))
    if needs.interface:
        bins[0] = specular_bins(np.cos(theta), n, scene.material.k)
    if needs.substrate:
        bins[1] = body_bins(np.cos(theta), n)
    return bins


def specular_bins(cos_i: float, n: float, k: float) -> Array:
    """Specular energy in each bin, shape (rings, sectors): F in the bin of the mirror direction."""
    energy = np.zeros((detector.RINGS, detector.SECTORS))
    ring = detector.ring_of(float(np.degrees(np.arccos(cos_i))))
    energy[ring, detector.SECTORS // 2] = fresnel.reflectance(cos_i, n, k)
    return energy


def body_bins(cos_i: float, n: float) -> Array:
    """Body energy ∫ f_b cosθ_o dω in each bin at unit body weight, shape (rings, sectors).

    Relative error below 1e−12: μ = √(n²−1) sinh t makes T smooth for every n.
    """
    edges = np.cos(np.radians(detector.RING_EDGES))
    edges[-1] = 0.0
    if n == 1:
        rings = -np.diff(edges**2) / 2
    else:
        root = np.sqrt((n - 1) * (n + 1))
        t = np.arcsinh(edges / root)
        half = -np.diff(t)[:, None] / 2
        nodes = (t[:-1, None] + t[1:, None]) / 2 + half * _NODES
        mu = root * np.sinh(nodes)
        values = fresnel.transmittance(mu, n) * mu * root * np.cosh(nodes)
        rings = (values * half) @ _WEIGHTS
    factor = body(cos_i, 1.0, n) / fresnel.transmittance(1.0, n)
    sector = 2 * np.pi / detector.SECTORS
    return np.repeat((factor * rings * sector)[:, None], detector.SECTORS, axis=1)
