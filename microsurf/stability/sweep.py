"""All formulas at random places and corners of the box: what is no finite number, or negative."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..physics import facet, fresnel, smith, student_t, vcavity, visible_normals

Array = NDArray[np.float64]

_STEEPEST = float(np.nextafter(1.5, 2))


@dataclass(frozen=True)
class Count:
    """Of one formula: values asked, and how many were NaN, infinite or negative."""

    function: str
    values: int
    nan: int
    infinite: int
    negative: int


def sweep(batches: int, size: int, rng: np.random.Generator) -> list[Count]:
    """Count over ``batches`` of ``size`` values, each batch at one γ, σ, n and k."""
    total: dict[str, list[int]] = {}
    for batch in range(batches):
        for name, values in _values(batch, size, rng):
            row = np.array([values.size, *_wrong(values)])
            total[name] = (np.array(total.get(name, [0] * 4)) + row).tolist()
    return [Count(name, *counts) for name, counts in total.items()]


def _wrong(values: Array) -> tuple[int, int, int]:
    return (
        int(np.isnan(values).sum()), int(np.isinf(values).sum()), int((values < 0).sum())
    )  # fmt: skip


def _values(batch: int, size: int, rng: np.random.Generator) -> Iterator[tuple[str, Array]]:
    """Every formula's values in one batch; the first batches are the corners of γ and σ."""
    gamma = 1.5 + 10 ** rng.uniform(-15.6, 9)
    sigma = 10 ** rng.uniform(-6, 1)
    if batch < 9:
        gamma = (_STEEPEST, 1e9, np.inf)[batch % 3]
        sigma = (1e-6, 0.5, 10.0)[batch // 3]
    yield from _of_slopes(gamma, sigma, size, rng)
    yield from _of_facets(size, rng)


def _of_slopes(
    gamma: float, sigma: float, size: int, rng: np.random.Generator
) -> Iterator[tuple[str, Array]]:
    sigma_y = sigma * 10 ** rng.uniform(-1, 0)
    w, o, m = (_directions(size, rng) for _ in range(3))
    u = np.where(rng.random(size) < 0.5, rng.random(size), 1 - 2.0 ** -rng.uniform(1, 53, size))
    slope = sigma * 10 ** rng.uniform(-12, 12, size)
    yield "D", student_t.distribution(m, gamma, sigma, sigma_y)
    yield "density of slopes", student_t.slope_density(slope, -slope, gamma, sigma, sigma_y)
    yield "CDF of |slope|", student_t.slope_cdf(slope, gamma, sigma)
    yield "quantile of |slope|", student_t.slope_quantile(u, gamma, sigma)
    yield "share of area", np.array([student_t.area_beyond(float(slope[0]), gamma, sigma)])
    yield "mean area", np.array([student_t.mean_area(gamma, sigma)])
    for name, rough in (("", (sigma, sigma_y)), (", σ = 0", (0.0, 0.0))):
        yield f"Λ{name}", smith.smith_lambda(w, gamma, *rough)
        yield f"G1, Smith{name}", smith.g1(w, gamma, *rough)
        yield f"G2, separable{name}", smith.g2_separable(w, o, gamma, *rough)
        yield f"G2, height-correlated{name}", smith.g2_height_correlated(w, o, gamma, *rough)
    yield "G1, V-cavity", vcavity.g1(w, m)
    yield "G2, V-cavity", vcavity.g2(w, o, m)
    for name, directions in (("from above", w), ("from below", w * [1, 1, -1])):
        yield (
            f"projected area, {name}",
            visible_normals.projected_area(directions, gamma, sigma, sigma_y),
        )
        normals = visible_normals.sample(directions, gamma, sigma, sigma_y, rng)
        yield f"visible normals, {name}: m_z", normals[:, 2]
        yield f"visible normals, {name}: |m|", np.linalg.norm(normals, axis=1)
    yield "density of visible normals", visible_normals.density(w, m, gamma, sigma, sigma_y)


def _of_facets(size: int, rng: np.random.Generator) -> Iterator[tuple[str, Array]]:
    mu, mu_o = _directions(size, rng)[:, 2], _directions(size, rng)[:, 2]
    n = np.where(rng.random(size) < 0.1, 1.0, 1 + 10 ** rng.uniform(-15.6, 1.99, size))
    kd = np.where(rng.random(size) < 0.5, rng.random(size), rng.integers(0, 2, size))
    few = slice(0, min(size, 32))  # averages over many angles each
    metal, k = 10 ** rng.uniform(-3, 2), 10 ** rng.uniform(-9, 2)
    yield "F", fresnel.reflectance(mu, n)
    yield "T = 1 − F", fresnel.transmittance(mu, n)
    yield "F of a conductor", fresnel.reflectance(mu, metal, k)
    yield "T of a conductor", fresnel.transmittance(mu, metal, k)
    yield "r_e", fresnel.external_diffuse_reflectance(n[few])
    yield "1 − r_e", fresnel.external_diffuse_transmittance(n[few])
    yield "r_i", fresnel.internal_diffuse_reflectance(n[few])
    yield "body weight", facet.body_weight(n[few], kd[few])
    yield "f_b of a facet", facet.body(mu, mu_o, float(n[0]), kd)
    yield "albedo of a facet", facet.albedo(mu, float(n[0]), kd)


def _directions(size: int, rng: np.random.Generator) -> Array:
    """Unit vectors above the horizon: anywhere, and crowding at the normal and at 89.99999°."""
    kind = rng.integers(0, 3, size)
    near = 10 ** rng.uniform(-5, 1.9, size)
    theta = np.radians(np.choose(kind, [90 * rng.random(size), near, 90 - near]))
    theta = np.minimum(theta, np.radians(89.99999))
    phi = 2 * np.pi * rng.random(size)
    return np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1
    )
