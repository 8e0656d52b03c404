"""Smith's theory of given slopes: of STD's own it is STD's, and facets are those visible."""

from dataclasses import replace

import numpy as np
import pytest
from mesh_slope_walk import Facets, walk_realised

from microsurf import model
from microsurf.errors import InputError
from microsurf.model.mesh_slopes.order_one import first_order_change
from microsurf.physics import smith, student_t, visible_normals
from microsurf.scene import Effects, Layers, Light, Material, Roughness, Scene, Substrate

COUNT = 2**20


def of_std(gamma, sigma_x, sigma_y):
    u = (np.arange(COUNT) + 0.5) / COUNT
    return Facets(student_t.slope_quantile(u, gamma), sigma_x, sigma_y)


def towards(theta, phi=0.3):
    t = np.radians(theta)
    return np.array([np.sin(t) * np.cos(phi), np.sin(t) * np.sin(phi), np.cos(t)])


def test_two_layers_are_refused():
    scene = Scene(layers=Layers(20.0, Substrate(2.0, (0.5,))))
    with pytest.raises(InputError, match=r"\[layers\]: the theory on a mesh's slopes knows one"):
        first_order_change(scene, of_std(2.0, 0.5, 0.5), 60.0, 0.0)


@pytest.mark.parametrize("gamma", [3.0, 8.0, np.inf])
def test_lambda_is_smiths(gamma):
    """A million quantiles leave out the tail beyond 1e-6: it shows where Λ is of steep facets."""
    slopes = of_std(gamma, 0.7, 0.4)
    w = np.stack([towards(theta) for theta in (20.0, 45.0, 70.0, 85.0, 89.0)])
    np.testing.assert_allclose(
        slopes.smith_lambda(w), smith.smith_lambda(w, gamma, 0.7, 0.4), rtol=1e-4, atol=2e-6
    )


@pytest.mark.parametrize("w", [towards(0.0), towards(60.0), -towards(80.0), -towards(60.0)])
def test_facets_are_drawn_as_they_are_seen(w, judge):
    """Means of m against quadrature-free draws of `physics.visible_normals`.

    Negative control: facets drawn for a direction 6° away.
    """
    slopes = of_std(4.0, 0.6, 0.6)
    rng = np.random.default_rng(judge.seed(5))
    many = 100_000
    ours = slopes.visible(np.repeat(w[None], many, axis=0), rng)
    exact = visible_normals.sample(np.repeat(w[None], many, axis=0), 4.0, 0.6, 0.6, rng)
    assert np.all(ours @ w > 0)

    def means(a, b):
        spread = np.hypot(a.std(axis=0), b.std(axis=0)) / np.sqrt(many)
        return a.mean(axis=0), b.mean(axis=0), spread

    judge.near(*means(ours, exact))
    turned = np.repeat(towards(np.degrees(np.arccos(abs(w[2]))) + 6)[None], many, axis=0)
    turned = turned if w[2] > 0 else -turned
    judge.tells(*means(slopes.visible(turned, rng), exact))


def scene(theta, **more):
    return Scene(
        roughness=Roughness(4.0, (0.6,)), material=Material(1.5, (0.8,)),
        light=Light((theta,)), **more,
    )  # fmt: skip


@pytest.mark.parametrize("theta", [0.0, 75.0])
def test_the_walk_of_std_slopes_is_smiths_walk(theta, judge):
    """Four orders against the compiled walk. Control: σ off by 15 %."""
    asked = scene(theta)
    exact = model.walk(asked, walks=2_000_000, seed=judge.seed(3))
    orders = {}
    for name, sigma in (("right", 0.6), ("wrong", 0.69)):
        ours = walk_realised(asked, of_std(4.0, sigma, sigma), walks=100_000, seed=judge.seed(4))
        assert float(ours.ended.isel(cause=2).sum()) == 0
        orders[name] = ours.microsurf.albedo_by_order(n=1.5, kd=0.8).sum("kind").values.ravel()
    theirs = exact.microsurf.albedo_by_order(n=1.5, kd=0.8).sum("kind").values.ravel()
    error = np.sqrt(theirs * (1 / 100_000 + 1 / 2_000_000))
    judge.near(orders["right"], theirs, error)
    judge.tells(orders["wrong"], theirs, error)


def test_one_order_alone():
    asked = scene(60.0, effects=Effects(multiple_scattering=False))
    found = walk_realised(asked, of_std(4.0, 0.6, 0.6), walks=5000)
    assert float(found.flux.sel(order=[2, 3, 4]).sum()) == 0
    assert float(found.ended.isel(cause=1).sum()) > 0


def test_no_substrate_ends_light_and_a_conductor_absorbs(judge):
    for material in (Material(1.5, (0.0,)), Material(0.4, (), 2.5)):
        asked = replace(scene(60.0), material=material)
        ours = walk_realised(asked, of_std(4.0, 0.6, 0.6), walks=50_000, seed=judge.seed(1))
        exact = model.walk(asked, walks=500_000, seed=judge.seed(2))
        a, b = (float(d.flux.sum()) for d in (ours, exact))
        error = np.sqrt(b * (1 - b) * 1.1 / 50_000)
        judge.near(a, b, error)
        judge.tells(a, 1.2 * b, error)  # negative control


@pytest.mark.parametrize("theta", [0.0, 60.0, 85.0])
def test_std_changes_nothing_and_two_per_cent_change_what_the_quadrature_says(theta):
    asked = scene(theta)
    none, flux, _ = first_order_change(asked, of_std(4.0, 0.6, 0.6), theta, 0.0)
    exact = model.predict(asked).flux.values[0, 0, 0, 0]
    size = exact.sum((1, 2))
    np.testing.assert_allclose(none.sum((1, 2)) / size, 0, atol=2e-5)
    # The nodes' own noise: one azimuth in 24, one body direction a facet.
    np.testing.assert_allclose(flux.sum((1, 2)) / size, 1, atol=8e-3)
    change, _, mirrored = first_order_change(asked, of_std(4.0, 0.612, 0.612), theta, 0.0)
    rougher = replace(asked, roughness=Roughness(4.0, (0.612,)))
    wanted = model.predict(rougher).flux.values[0, 0, 0, 0].sum((1, 2)) - size
    np.testing.assert_allclose(change.sum((1, 2)) / size, wanted / size, atol=2e-4)
    assert mirrored[0] != mirrored[1]
