"""What a renderer's kernels compute, by NumPy: against exact densities and Fresnel's formula."""

from types import SimpleNamespace

import numpy as np
import pytest

from microsurf import model
from microsurf.model.lookup import shader_facets, shader_tables
from microsurf.model.lookup.shader_facets import ShaderFacets
from microsurf.model.single_scattering.brdf import body
from microsurf.model.single_scattering.facets import Facets
from microsurf.physics import fresnel, smith, student_t, visible_normals

DR = SimpleNamespace(
    sqrt=np.sqrt, exp=np.exp, log=np.log, cos=np.cos, sin=np.sin, abs=np.abs, select=np.where,
    maximum=np.maximum, minimum=np.minimum,
)  # fmt: skip
GAMMAS = (1.7, 2.0, 8.0, 1e4)
SIGMAS = ((0.4, 0.4), (0.5, 0.05))
COUNT = 100_000


def vector(w):
    return SimpleNamespace(x=w[..., 0], y=w[..., 1], z=w[..., 2])


def facets(gamma, sigma):
    return ShaderFacets(gamma, sigma, float(visible_normals.mean_excess(2 * gamma - 2)))


def drawn(mine, w, rng):
    """Normals seen from w."""
    three = rng.random((3, COUNT))
    p, q = mine.draw(DR, vector(w), three[0], SimpleNamespace(x=three[1], y=three[2]))
    m = np.stack([-p, -q, np.ones_like(p)], axis=-1)
    return m / np.linalg.norm(m, axis=-1, keepdims=True)


def weights(mine, w, m):
    """Visible density over drawn density."""
    density = mine.distribution(DR, vector(m)) * mine.density(DR, vector(w), vector(m), m @ w)
    return visible_normals.density(w, m, mine.gamma, *mine.sigma) / density


def gaps(m, weight, known):
    """Differences of weighted means, and their errors: of 1 and of the normal's components."""
    columns = [(weight, np.ones(COUNT))] + [(weight * m[:, k], known[:, k]) for k in range(3)]
    gap = [a.mean() - b.mean() for a, b in columns]
    return gap, [np.hypot(a.std(), b.std()) / np.sqrt(COUNT) + 1e-6 for a, b in columns]


@pytest.mark.parametrize("gamma", GAMMAS)
@pytest.mark.parametrize("sigma", SIGMAS)
def test_drawn_normals_weighed_by_their_density_are_the_visible_ones(gamma, sigma, judge):
    rng = np.random.default_rng(judge.seed(11))
    mine = facets(gamma, sigma)
    found = []
    for theta, phi in ((0.0, 0.0), (30.0, 40.0), (60.0, 100.0), (80.0, 200.0)):
        w = model.direction(np.radians(theta), np.radians(phi))
        m = drawn(mine, w, rng)
        weight = weights(mine, w, m)
        assert weight.max() < 1.25
        known = visible_normals.sample(np.broadcast_to(w, m.shape), gamma, *sigma, rng)
        found.append(gaps(m, weight, known))
    gap, error = np.array(found).swapaxes(0, 1)
    judge.near(gap, 0, error)
    steeper = drawn(facets(gamma, tuple(1.1 * s for s in sigma)), w, rng)
    gap, error = gaps(steeper, weights(mine, w, steeper), known)
    judge.tells(gap, 0, error)


def test_a_distribution_and_its_masking_are_those_of_the_physics():
    rng = np.random.default_rng(3)
    m = rng.standard_normal((1000, 3))
    m[:, 2] = np.abs(m[:, 2]) + 0.01
    m /= np.linalg.norm(m, axis=1, keepdims=True)
    for gamma in GAMMAS:
        for sigma in SIGMAS:
            found = facets(gamma, sigma).distribution(DR, vector(m))
            known = student_t.distribution(m, gamma, *sigma)
            np.testing.assert_allclose(found, known, rtol=1e-5, atol=1e-30)
        table = shader_tables.masking_table(gamma)
        a = np.logspace(-3, 5, 2000)
        u = a / (1 + a)
        steps = np.linspace(0, 1, len(table))
        looked_up = np.interp(u, steps, table) * (1 + a)
        exact = smith.lambda_of_x(np.sqrt(2) / a, 2 * gamma - 2)
        np.testing.assert_allclose(1 + looked_up, 1 + exact, rtol=1e-4)


def test_a_conductor_reflects_as_fresnel_says():
    cosine = np.linspace(0.01, 1, 50)
    for n, k in ((0.21, 3.27), (1.5, 0.0), (3.0, 3.0)):
        found = shader_facets.conductor(DR, cosine, n, k)
        np.testing.assert_allclose(found, fresnel.reflectance(cosine, n, k), rtol=1e-10)


def test_small_numbers_keep_their_digits():
    x = np.logspace(-12, 1, 200)
    np.testing.assert_allclose(shader_facets.log1p(DR, x), np.log1p(x), rtol=2e-8)
    np.testing.assert_allclose(shader_facets.expm1(DR, x), np.expm1(x), rtol=2e-8)


def test_the_table_of_the_body_is_its_integral():
    of = Facets(1.5, 2.0, 0.4, 0.4)
    rng = np.random.default_rng(5)
    theta = np.arcsin(np.sqrt(rng.uniform(0, 0.99, (2, 1000))))
    i, o = model.direction(theta, rng.uniform(0, 2 * np.pi, (2, 1000)))
    found = shader_tables.body_table(of).at(i, o) * of.g2(i, o) / (i[:, 2] * o[:, 2])
    off = np.abs(found / body(of, i, o) - 1)
    assert np.median(off) < 1e-3
    assert np.quantile(off, 0.99) < 0.03
