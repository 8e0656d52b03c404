"""Well-known models, each a limit of interfaced-Lambertian STD facets.

All return a `Brdf`; its ``scene`` can be measured and predicted like any other.

========================  ===========================================================
`lambert`                 n = 1, σ = 0
`flat_il`                 σ = 0 (Simonot, Applied Optics 48(30), 5793, 2009)
`rough_lambertian`        n = 1, Beckmann, V-cavities (as Oren and Nayar, SIGGRAPH 1994)
`torrance_sparrow`        Kd = 0, V-cavities, any γ (JOSA 57, 1967)
`cook_torrance`           Kd = 0, V-cavities, Beckmann (ACM TOG 1(1), 1982)
`walter_ggx`              Kd = 0, separable Smith, γ = 2 (Walter et al., EGSR 2007)
`walter_beckmann`         Kd = 0, separable Smith, Beckmann (the same)
`std`                     any γ, with a substrate (Ribardière et al. 2017, 2018)
========================  ===========================================================

Torrance and Sparrow's own facets are normal in the *angle*; for small σ that is
Beckmann. Cook and Torrance print π where the Jacobian of the half vector is 4.
"""

from ..scene import BECKMANN, Material, Roughness, Scene
from .brdf import Brdf


def _brdf(material: Material, roughness: Roughness, model: str) -> Brdf:
    return Brdf(Scene(material=material, roughness=roughness), model)


def lambert(kd: float) -> Brdf:
    """Lambert's Kd/π."""
    return _brdf(Material(1.0, (kd,)), Roughness(sigma=(0.0,)), "flat")


def flat_il(n: float, kd: float) -> Brdf:
    """One flat Fresnel interface over a Lambertian substrate: a mirror's delta and T T Kd/…."""
    return _brdf(Material(n, (kd,)), Roughness(sigma=(0.0,)), "flat")


def rough_lambertian(kd: float, sigma: float) -> Brdf:
    """Lambertian facets in V-cavities, with their backscatter; order 1, no interreflection.

    σ is Beckmann's; the standard deviation of Oren and Nayar's tilts is about σ/√2.
    """
    return _brdf(Material(1.0, (kd,)), Roughness(BECKMANN, (sigma,)), "vcavity")


def torrance_sparrow(n: float, sigma: float, gamma: float = BECKMANN, k: float = 0.0) -> Brdf:
    """Mirrors F D G/(4 i_z o_z) in V-cavities; k > 0 makes them a conductor."""
    return _brdf(Material(n, (0.0,), k), Roughness(gamma, (sigma,)), "vcavity")


def cook_torrance(n: float, m: float, k: float = 0.0) -> Brdf:
    """Mirrors in V-cavities, Beckmann's slopes of rms m."""
    return torrance_sparrow(n, m, BECKMANN, k)


def walter_ggx(n: float, alpha: float, k: float = 0.0) -> Brdf:
    """GGX mirrors with separable Smith masking."""
    return _brdf(Material(n, (0.0,), k), Roughness(2.0, (alpha,)), "smith-separable")


def walter_beckmann(n: float, alpha: float, k: float = 0.0) -> Brdf:
    """Beckmann mirrors with separable Smith masking, exact where Walter's is a rational fit."""
    return _brdf(Material(n, (0.0,), k), Roughness(BECKMANN, (alpha,)), "smith-separable")


def std(n: float, kd: float, gamma: float, sigma: float, model: str = "smith") -> Brdf:
    """Interfaced-Lambertian facets with Student-t slopes, by any model."""
    return _brdf(Material(n, (kd,)), Roughness(gamma, (sigma,)), model)
