"""What given slopes change about the first order of Smith's theory: a paired difference.

The same nodes, azimuths and body directions are taken through the given slopes and through
STD's, so that what both share drops out: differences are known to a hundredth of themselves,
where two walks would have to be a thousand times longer. Nodes are spread over the tail's
probability s = v^6, v even in 0 … 1: heavy tails carry light down to s = 1e−20.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy import integrate

from ...physics import facet, fresnel, smith
from ...results import detector
from ...scene import Scene
from ...scene.layers import refuse
from ..directions import direction
from .slopes import Slopes

Array = NDArray[np.float64]

_NODES = 4096
_AZIMUTHS = 24
_POWER = 6


def first_order_change(
    scene: Scene, slopes: Slopes, theta: float, phi: float, seed: int = 0
) -> tuple[Array, Array, tuple[float, float]]:
    """Order 1 of these slopes, and less that of the scene's STD.

    Parameters
    ----------
    scene : Scene
        With σ > 0; its n and k.
    slopes : Slopes
        What is there instead of STD.
    theta, phi : float
        Incidence in degrees.
    seed : int
        Of azimuths and body directions.

    Returns
    -------
    change : ndarray, shape (2, rings, sectors)
        Flux of order 1 with these slopes less that with STD, specular and at unit body
        weight, by bins of the detector.
    flux : ndarray, shape (2, rings, sectors)
        The first of these alone, with the noise of its nodes.
    mirrored : (float, float)
        Mean F of the facets seen, with these slopes and with STD.

    Raises
    ------
    InputError
        If the scene has layers.

    """
    refuse(scene.layers, "the theory on a mesh's slopes")
    v = (np.arange(_NODES) + 0.5) / _NODES
    s, weight = v**_POWER, _POWER * v ** (_POWER - 1) / _NODES
    weight /= weight.sum()
    rough = scene.roughness
    i = direction(np.radians(theta), np.radians(phi))
    ideal = Slopes(np.sqrt(_std_square(s, rough.gamma)), rough.sigma_x, rough.sigma_y)
    nodes = (
        (slopes.normals, _nodes(slopes.rho, s), slopes.smith_lambda),
        (ideal.normals, ideal.rho, lambda w: smith.smith_lambda(w, *_std(scene))),
    )
    sums = [
        _flux(scene, normals, rho, weight, i, phi, of, np.random.default_rng(seed))
        for normals, rho, of in nodes
    ]
    (flux, hits), (other, hits_other) = sums
    return flux - other, flux, (hits, hits_other)


def _std(scene: Scene) -> tuple[float, float, float]:
    rough = scene.roughness
    return rough.gamma, rough.sigma_x, rough.sigma_y


def _nodes(rho: Array, s: Array) -> Array:
    """Of a sorted list the values that a part s of it exceeds."""
    rank = rho.size * (1 - s) - 0.5
    return np.asarray(np.interp(rank, np.arange(rho.size), rho))


def _std_square(s: Array, gamma: float) -> Array:
    """Square of STD's ρ exceeded with probability s (see `std.slope_quantile`), small s kept."""
    if np.isinf(gamma):
        return np.asarray(-np.log(s))
    return np.asarray((gamma - 1) * np.expm1(-np.log(s) / (gamma - 1)))


def _flux(
    scene: Scene,
    normals: Callable[[Array, Array], Array],
    rho: Array,
    weight: Array,
    i: Array,
    phi: float,
    smith_lambda: Callable[[Array], Array],
    rng: np.random.Generator,
) -> tuple[Array, float]:
    """Order 1 by kind and bin, and the mean F of what is seen."""
    material, needs = scene.material, scene.requires
    turn = (np.arange(_AZIMUTHS) + rng.random((rho.size, 1))) * 2 * np.pi / _AZIMUTHS
    m = normals(rho[:, None], turn)
    facing = m @ i
    light = np.where(facing > 0, facing, 0.0) / (m[..., 2] * i[2])
    lambda_i = float(smith_lambda(i[None])[0]) if i[2] < 1 else 0.0
    light *= weight[:, None] / _AZIMUTHS / (1 + lambda_i)
    mu = np.clip(facing, 1e-300, 1.0)
    mirrored = np.zeros_like(mu)
    flux = np.zeros((2, detector.RINGS, detector.SECTORS))
    if needs.interface:
        mirrored = fresnel.reflectance(mu, material.n, material.k)
        o = facet.mirror(i, m)
        flux[0] = _binned(o, light * mirrored, phi, lambda_i, smith_lambda)
    if needs.substrate:
        o = _body_directions(m, material.n, rng)
        flux[1] = _binned(o, light * (1 - mirrored), phi, lambda_i, smith_lambda)
    return flux, float((light * mirrored).sum() / light.sum())


def _body_directions(m: Array, n: float, rng: np.random.Generator) -> Array:
    """One direction ∝ T(μ) μ about each normal, the same one in each normal's own frame."""
    mu = np.linspace(0, 1, 2049)
    density = mu * (fresnel.transmittance(mu, n) if n > 1 else 1.0)
    below = integrate.cumulative_trapezoid(density, mu, initial=0)
    z = np.interp(rng.random(m.shape[:-1]), below / below[-1], mu)
    around = 2 * np.pi * rng.random(m.shape[:-1])
    x, y = np.sqrt(1 - z**2) * np.array([np.cos(around), np.sin(around)])
    # Tangents that turn with m without a jump: facets of a heightfield look up.
    mx, my, mz = np.moveaxis(m, -1, 0)
    a, b = 1 / (1 + mz), -mx * my / (1 + mz)
    first = np.stack([1 - mx**2 * a, b, -mx], axis=-1)
    second = np.stack([b, 1 - my**2 * a, -my], axis=-1)
    return np.asarray(x[..., None] * first + y[..., None] * second + z[..., None] * m)


def _binned(
    o: Array, light: Array, phi: float, lambda_i: float, smith_lambda: Callable[[Array], Array]
) -> Array:
    """Light that leaves, G2/G1(i) of it, by bins."""
    o, light = o.reshape(-1, 3), light.ravel()
    leaves = (o[:, 2] > 1e-12) & (light > 0)
    o, light = o[leaves], light[leaves]
    o = o / np.linalg.norm(o, axis=-1, keepdims=True)
    light = light * (1 + lambda_i) / (1 + lambda_i + smith_lambda(o))
    lobe = detector.RINGS * detector.SECTORS
    counts = np.bincount(detector.bins_of(o, phi), light, minlength=lobe)
    return np.asarray(counts.reshape(detector.RINGS, detector.SECTORS), float)
