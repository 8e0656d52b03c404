"""Directions to continue in, with an explicit density: what importance sampling needs.

A share q of the directions is mirrored at normals visible from i (Heitz, JCGT 3(2),
2014), whose density is G1(i) D(h)/(4 i_z); the rest is spread as cosθ/π, for the
substrate and for light that meets several facets. Mirrored directions may point below
the horizon, where the BRDF is 0, so over the hemisphere the density integrates to less
than 1: what is missing is the chance of that.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...physics import facet, fresnel, smith, student_t, visible_normals
from ...scene import Scene

Array = NDArray[np.float64]

_LEAST = 0.1
"""Each part that the material has gets at least this share: what bounds the weights."""


class Drawn(NamedTuple):
    """Directions o, shape (..., 3), and whether each is a flat mirror's: of a Dirac delta."""

    o: Array
    delta: NDArray[np.bool_]


def mirrored_share(scene: Scene, i: Array, *, several: bool) -> Array:
    """Part q of the directions from i that is mirrored, shape (...).

    Near what the interface reflects of all it sends back, at the mean normal; the
    choice changes the variance only. ``several`` is for models in which light meets
    several facets: it leaves a part to them even where there is no substrate.
    """
    material, needs = scene.material, scene.requires
    if not needs.interface:
        return np.zeros(i.shape[:-1])
    if not (needs.substrate or several):
        return np.ones(i.shape[:-1])
    mirrored = fresnel.reflectance(np.clip(i[..., 2], 0, 1), material.n, material.k)
    rest = (1 - mirrored) * facet.body_weight(material.n, max(material.kd))
    share = mirrored / (mirrored + rest)
    return np.asarray(_LEAST + (1 - 2 * _LEAST) * share)


def sample(scene: Scene, i: Array, rng: np.random.Generator, *, several: bool) -> Drawn:
    """Draw one direction for each i, shape (..., 3), i_z > 0."""
    flat_i = i.reshape(-1, 3)
    mirrors = rng.random(len(flat_i)) < mirrored_share(scene, flat_i, several=several)
    o = np.empty_like(flat_i)
    if scene.requires.roughness:
        rough = scene.roughness
        m = visible_normals.sample(flat_i[mirrors], rough.gamma, rough.sigma_x, rough.sigma_y, rng)
        o[mirrors] = facet.mirror(flat_i[mirrors], m)
    else:
        o[mirrors] = flat_i[mirrors] * [-1, -1, 1]
    spread = len(o) - int(mirrors.sum())
    radius, azimuth = np.sqrt(rng.random(spread)), 2 * np.pi * rng.random(spread)
    rise = np.sqrt(np.maximum(0, 1 - radius**2))
    o[~mirrors] = np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), rise], axis=-1)
    delta = mirrors & (not scene.requires.roughness)
    return Drawn(o.reshape(i.shape), delta.reshape(i.shape[:-1]))


def density(scene: Scene, i: Array, o: Array, *, several: bool) -> Array:
    """Density of `sample` at o in sr⁻¹, 0 below the horizon; a Dirac delta is left out."""
    share = mirrored_share(scene, i, several=several)
    up = (i[..., 2] > 0) & (o[..., 2] > 0)
    spread = (1 - share) * np.maximum(o[..., 2], 0) / np.pi
    if scene.requires.roughness and scene.requires.interface:
        rough = scene.roughness
        parameters = rough.gamma, rough.sigma_x, rough.sigma_y
        above = np.where(up[..., None], i, [0.0, 0.0, 1.0])
        h = above + np.where(up[..., None], o, [0.0, 0.0, 1.0])
        h = h / np.linalg.norm(h, axis=-1, keepdims=True)
        mirrored = (
            smith.g1(above, *parameters)
            * student_t.distribution(h, *parameters)
            / (4 * above[..., 2])
        )
        spread = spread + share * mirrored
    return np.where(up, spread, 0.0)
