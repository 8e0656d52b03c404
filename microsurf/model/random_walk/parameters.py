"""What the kernels of the walks are given: slopes and masking, the facet, random numbers."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...physics import fresnel, smith, visible_normals
from ...physics.facet import body_weight
from ...scene import Scene
from ...scene.layers import required

_NODES = 2049  # of the table of Λ


class SlopeParameters(NamedTuple):
    """Distribution of slopes and its masking, see `slope_parameters`."""

    nu: float  # 2γ − 2
    excess: float  # E = K ν/(ν−1)
    scale_x: float  # σ_x/√2
    scale_y: float
    table: Any  # part of A left in Λ and its step derivative at even x/(1+x), shape (nodes, 2)


class WalkFacet(NamedTuple):
    """One facet: what its events need; which effects run is the scene's to say."""

    n: float
    k: float  # > 0: a conductor
    bound: float  # of T, like all of the substrate only where there is one
    interface: bool
    substrate: bool
    survival: float  # weight of a body event: of long paths only so many are followed
    escape: float  # 1 − r_e


class LayeredSlopes(NamedTuple):
    """Slopes of an interface and of the substrate under it; a plane has scales of 0."""

    interface: SlopeParameters
    substrate: SlopeParameters


class LayeredFacets(NamedTuple):
    """Facets of an interface, which absorbs nothing, of a Lambertian substrate, and the gap."""

    interface: WalkFacet
    substrate: WalkFacet
    thickness: float  # absorption times gap


def slope_parameters(gamma: float, sigma_x: float, sigma_y: float) -> SlopeParameters:
    """Slopes and masking for the kernels, γ > 3/2 and σ > 0.

    Λ = A R (see `physics.smith`) is tabulated by R, the smooth part, over
    u = x/(1+x): values and derivatives for a cubic between nodes.
    """
    nu = 2 * gamma - 2
    excess = visible_normals.mean_excess(nu)
    u = np.linspace(0, 1, _NODES)
    x = u[1:-1] / (1 - u[1:-1])
    if np.isinf(nu):
        log_power, slope = -(x**2) / 2, x
    else:
        log_power, slope = -(nu - 1) / 2 * np.log1p(x**2 / nu), (nu - 1) / (nu / x + x)
    with np.errstate(under="ignore"):
        leading = excess / x * np.exp(log_power)
    matters = leading > 1e-290  # beyond, Λ is 0 and R does not matter
    table = np.zeros((_NODES, 2))
    table[0] = 1, -0.5 / excess
    ratio = smith.lambda_of_x(x[matters], nu) / leading[matters]
    table[1:-1, 0][matters] = ratio
    table[1:-1, 1][matters] = ((ratio - 1) / x[matters] + ratio * slope[matters]) * (
        1 + x[matters]
    ) ** 2
    table[-1, 0] = 0 if np.isinf(nu) else 1 / nu
    table[:, 1] /= _NODES - 1
    return SlopeParameters(nu, excess, sigma_x / np.sqrt(2), sigma_y / np.sqrt(2), table)


def walk_facet(scene: Scene, kd: float) -> WalkFacet:
    """Return what the kernels need of a facet; long paths are thinned as Kd would do."""
    n, substrate = scene.material.n, scene.requires.substrate
    weight = float(body_weight(n, kd))
    return WalkFacet(
        n,
        scene.material.k,
        fresnel.transmittance_bound(n) if substrate else 1.0,
        scene.requires.interface,
        substrate,
        weight,
        float(fresnel.external_diffuse_transmittance(n)) if substrate else 1.0,
    )


def layered_slopes(scene: Scene) -> LayeredSlopes:
    """Slopes of both layers of a scene that has two.

    Raises
    ------
    InputError
        If those of the substrate are not known.

    """
    rough = scene.roughness
    return LayeredSlopes(
        slope_parameters(rough.gamma, rough.sigma_x, rough.sigma_y),
        slope_parameters(*_substrate_slopes(scene)),
    )


def _substrate_slopes(scene: Scene) -> tuple[float, float, float]:
    """γ, σ_x and σ_y of the substrate; heights that are scaled have slopes that are."""
    rough, substrate = scene.roughness, required(scene.layers, "the substrate's slopes").substrate
    if substrate.file is not None:
        raise InputError(
            f"layers.substrate.file = {substrate.file}: is of unknown roughness; give its gamma "
            "and sigma instead"
        )
    if substrate.shape == "flat":
        return rough.gamma, 0.0, 0.0
    if substrate.gamma is not None and substrate.sigma is not None:
        return substrate.gamma, substrate.sigma[0], substrate.sigma[-1]
    if substrate.sigma is None:
        return rough.gamma, rough.sigma_x, rough.sigma_y
    factor = substrate.sigma[0] / rough.sigma_x if rough.sigma_x > 0 else 0.0
    return rough.gamma, factor * rough.sigma_x, factor * rough.sigma_y


def layered_facets(scene: Scene) -> LayeredFacets:
    """Facets of both layers; long paths are thinned as the greatest Kd would do."""
    n, kd = scene.material.n, max(scene.material.kd)
    layers = required(scene.layers, "the gap")
    return LayeredFacets(
        WalkFacet(n, 0.0, 1.0, scene.requires.interface, False, 1.0, 1.0),
        WalkFacet(1.0, 0.0, 1.0, False, scene.requires.substrate, kd, 1.0),
        layers.absorption * layers.gap,
    )


def stream(rng: np.random.Generator) -> NDArray[np.uint64]:
    """State of an SFC64 for the kernels, seeded by numbers of ``rng``."""
    words = rng.integers(0, 2**64, 4, dtype=np.uint64)
    words[3] = 1  # its counter
    return words
