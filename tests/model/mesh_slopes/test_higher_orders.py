"""Weighted walks against quadrature, other walks and rejection, none of which weighs anything."""

import numpy as np
import pytest
from mesh_slope_walk import Facets, walk_realised

from microsurf import model
from microsurf.errors import InputError
from microsurf.model.mesh_slopes.higher_orders import BATCHES, order_change
from microsurf.model.mesh_slopes.slope_bins import slope_bins
from microsurf.model.mesh_slopes.slopes import Slopes
from microsurf.physics import smith, student_t
from microsurf.results import datasets
from microsurf.scene import Effects, Layers, Light, Material, Roughness, Scene, Substrate

FACETS = 200_000
LEVELS = (np.arange(FACETS) + 0.5) / FACETS


def scene(gamma, sigma, theta=(20.0, 75.0), **more):
    return Scene(
        material=Material(1.5, (0.8,)), roughness=Roughness(gamma, sigma),
        light=Light(theta), **more,
    )  # fmt: skip


def slopes(gamma, sigma, factor=1.0):
    return Slopes(student_t.slope_quantile(LEVELS, gamma) * factor, sigma, sigma)


def mean_and_error(values):
    return values.mean("batch").values, values.std("batch", ddof=1).values / np.sqrt(BATCHES)


@pytest.mark.parametrize(
    ("gamma", "sigma", "other_gamma", "other_sigma"),
    [(2.0, 0.5, 2.0, 0.51), (8.0, 0.7, 8.0, 0.686), (20.0, 0.7, 1e8, 0.7)],
)
def test_order_1_is_the_quadrature_of_the_other_parameters(
    judge, gamma, sigma, other_gamma, other_sigma
):
    asked, other = scene(gamma, (sigma,)), scene(other_gamma, (other_sigma,))
    given = slopes(other_gamma, sigma, other_sigma / sigma)
    found = order_change(asked, given, walks=50_000, seed=judge.seed(3))
    kinds = datasets.by_kind(found.change, 1.5, 0.8).isel(phi_i=0).sel(order=1)
    mean, error = mean_and_error(kinds.transpose("batch", "theta_i", "kind"))
    albedos = [
        model.predict(s).microsurf.albedo_by_order(n=1.5, kd=0.8).isel(realisation=0, phi_i=0)
        .sel(order=1).transpose("theta_i", "kind").values
        for s in (asked, other)
    ]  # fmt: skip
    expected = albedos[1] - albedos[0]
    # Steps of the ratios, and the tail beyond the last facet: a few percent of the effect.
    width = 0.04 * np.abs(expected).max() + error
    judge.near(mean, expected, width)
    judge.tells(mean, 0 * expected, width)
    judge.near(*mean_and_error(found.balance)[:1], 0.0, mean_and_error(found.balance)[1])


def test_later_orders_are_those_of_two_walks(judge):
    """σ up by a tenth, by weights and by walks of the other σ. Control: half the effect."""
    asked, other = (scene(2.5, (s,), (60.0,)) for s in (0.5, 0.55))
    found = order_change(asked, slopes(2.5, 0.5, 1.1), walks=100_000, seed=judge.seed(4))
    kinds = datasets.by_kind(found.change, 1.5, 0.8).sum("kind").isel(theta_i=0, phi_i=0)
    mean, error = mean_and_error(kinds)
    walks = [
        model.walk(s, walks=1_000_000, seed=judge.seed(k)) for k, s in enumerate((asked, other))
    ]
    albedos = [w.microsurf.albedo_by_order(n=1.5, kd=0.8).sum("kind").values.ravel() for w in walks]
    expected = albedos[1] - albedos[0]
    sampled = np.sqrt((albedos[0] + albedos[1]) / 1_000_000)  # a walk brings 1 at most
    width = np.hypot(error, sampled)
    judge.near(mean, expected, width + 0.02 * np.abs(expected))
    judge.tells(mean, expected / 2, width)


@pytest.mark.long
def test_a_cut_tail_is_that_of_walks_by_rejection(judge):
    """γ = 1.75, all facets beyond the steepest 1 % brought down to it."""
    asked = scene(1.75, (0.5,), (60.0,))
    rho = np.minimum(slopes(1.75, 0.5).rho, student_t.slope_quantile(0.99, 1.75))
    given = Facets(rho, 0.5, 0.5)
    found = order_change(asked, given, walks=400_000, seed=judge.seed(5))
    kinds = datasets.by_kind(found.change, 1.5, 0.8).sum("kind").isel(theta_i=0, phi_i=0)
    mean, error = mean_and_error(kinds)
    own = walk_realised(asked, given, walks=2_000_000, seed=judge.seed(6))
    ideal = model.walk(asked, walks=8_000_000, seed=judge.seed(7))
    a, b = (
        w.microsurf.albedo_by_order(n=1.5, kd=0.8).sum("kind").values.ravel() for w in (own, ideal)
    )
    width = np.hypot(error, np.sqrt(a / 2_000_000 + b / 8_000_000))
    judge.near(mean, a - b, width + 0.02 * np.abs(a - b))
    judge.tells(mean[0], 0.0, width[0])


def test_excess_is_that_of_smith():
    """The table against Λ in closed form, at another σ: E[(ρ cosφ − c)₊] = c Λ."""
    gamma, factor = 2.0, 1.05
    table = slope_bins(student_t.slope_quantile(LEVELS, gamma) * factor, gamma).table
    u = np.linspace(0, 1, len(table))[100:900]
    c = u / (1 - u)
    w = np.stack([1 / np.hypot(1, c), 0 * c, c / np.hypot(1, c)], axis=-1)
    expected = c * (smith.smith_lambda(w, gamma, factor) - smith.smith_lambda(w, gamma, 1.0))
    # Beyond the last of 2e5 facets the mean slope lacks a part that falls as 1/√facets.
    beyond = 3 * factor / np.sqrt(FACETS)
    np.testing.assert_allclose(table[100:900], expected, atol=beyond)
    assert np.abs(expected).max() > 3 * beyond


def test_two_layers_are_refused():
    layered = scene(2.0, (0.5,), layers=Layers(20.0, Substrate(2.0, (0.5,))))
    with pytest.raises(InputError, match=r"\[layers\]: the theory on a mesh's slopes knows one"):
        order_change(layered, slopes(2.0, 0.5), walks=10)


def test_stds_own_slopes_change_nothing_but_the_tail():
    """Beyond the last facet lies 1e-6 of STD: 6 of 20 000 walks there have p < 1e-6."""
    found = order_change(scene(8.0, (0.5,)), slopes(8.0, 0.5), walks=20_000)
    assert np.abs(found.change.sum("body_events").mean("batch")).max() < 3e-4


def test_one_order_alone_and_the_same_bits_whatever_the_workers():
    asked = scene(2.0, (0.5, 0.3), (30.0,), effects=Effects(multiple_scattering=False))
    given = Slopes(student_t.slope_quantile(LEVELS, 2.0) * 1.02, 0.5, 0.3)
    one, two = (order_change(asked, given, walks=4096, seed=7, workers=n) for n in (1, 3))
    assert one.equals(two)
    assert not one.change.sel(order=[2, 3, 4]).any()
    assert one.change.sel(order=1).any()
