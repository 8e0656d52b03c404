"""`sample` against `pdf`, weights against albedos, and both together (multiple importance)."""

import numpy as np
import pytest
from brute import direction
from scipy import stats

from microsurf import model
from microsurf.errors import InputError
from microsurf.model import Brdf, all_orders, order_one
from microsurf.model.single_scattering import importance
from microsurf.physics import facet
from microsurf.results import datasets, detector
from microsurf.scene import Effects, Light, Material, Roughness, Scene
from microsurf.stats import hypothesis_tests

THETAS = (0.0, 45.0, 80.0, 89.0)
GAMMAS = (1.6, 2.0, 8.0, 1e4)
SIGMAS = {"isotropic": (0.5,), "ten to one": (0.5, 0.05)}
PHI = 25.0
NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)


def scene(gamma=2.0, sigma=(0.5,), n=1.5, kd=0.8, **more):
    return Scene(material=Material(n, (kd,)), roughness=Roughness(gamma, sigma), **more)


# Directions drawn against the density stated


def panels(edges):
    """Gauss–Legendre nodes and weights over panels between edges, and the panel of each node."""
    half = np.diff(edges)[:, None] / 2
    nodes = (edges[:-1, None] + half * (1 + NODES)).ravel()
    return nodes, (half * WEIGHTS).ravel()


def refined(edges, at, finest):
    """Edges with further ones around a point, in steps that double from ``finest``."""
    around = at + np.outer([-1, 1], np.geomspace(finest, 4, 60)).ravel()
    around = around[(around > edges[0]) & (around < edges[-1])]
    return np.unique(np.concatenate([edges, around, [at]])).clip(edges[0], edges[-1])


def expected(brdf, i, thetas, phis):
    """∫ pdf dω over bins between angles in radians, by quadrature alone, shape (θ, φ)."""
    theta_i, phi_i = np.arccos(i[2]), np.arctan2(i[1], i[0])
    fine_t = refined(refined(thetas, theta_i, 1e-3), np.pi / 2, 1e-6)
    fine_p = refined(phis, (phi_i + np.pi) % (2 * np.pi), 1e-6)
    t, wt = panels(fine_t)
    p, wp = panels(fine_p)
    o = np.stack(
        [np.outer(np.sin(t), np.cos(p)), np.outer(np.sin(t), np.sin(p)),
         np.outer(np.cos(t), np.ones_like(p))], axis=-1,
    )  # fmt: skip
    mass = brdf.pdf(i, o) * np.outer(np.sin(t) * wt, wp)
    rows = np.searchsorted(thetas, t, side="right") - 1
    columns = np.searchsorted(phis, p, side="right") - 1
    bins = np.zeros((len(thetas) - 1, len(phis) - 1))
    np.add.at(bins, (rows[:, None], columns[None, :]), mass)
    return bins


def edges(i):
    """Bins of a hemisphere, finer towards grazing and about the mirror direction's azimuth."""
    thetas = np.radians([0, 3, 8, 15, 25, 35, 45, 55, 65, 72, 78, 83, 87, 89, 90])
    mirror = (np.arctan2(i[1], i[0]) + np.pi) % (2 * np.pi)
    offsets = np.radians([-60, -25, -10, -3, -1, 0, 1, 3, 10, 25, 60])
    phis = np.unique(np.concatenate([[0, 2 * np.pi], (mirror + offsets) % (2 * np.pi)]))
    return thetas, phis


def chi_square(brdf, stated, i, count, seed):
    """p-value of ``count`` draws of one Brdf against the density of another; bins below 10 pooled.

    The last bin is what leaves below the horizon.
    """
    thetas, phis = edges(i)
    mass = expected(stated, i, thetas, phis)
    rng = np.random.default_rng(seed)
    drawn = importance.sample(
        brdf._proposed, np.tile(i, (count, 1)), rng, several=brdf.stochastic
    ).o
    up = drawn[drawn[:, 2] > 0]
    azimuth = np.arctan2(up[:, 1], up[:, 0]) % (2 * np.pi)
    seen, *_ = np.histogram2d(np.arccos(np.minimum(up[:, 2], 1)), azimuth, (thetas, phis))
    seen = np.append(seen.ravel(), count - len(up))
    wanted = np.append(mass.ravel(), 1 - mass.sum()) * count
    return hypothesis_tests.chi_square(seen, wanted, total_fixed=True)


@pytest.mark.parametrize("sigma", SIGMAS)
@pytest.mark.parametrize(
    "gamma", [pytest.param(g, marks=pytest.mark.long) if g == 8 else g for g in GAMMAS]
)
@pytest.mark.parametrize("theta", THETAS)
def test_samples_have_the_density_stated(theta, gamma, sigma, judge):
    brdf = Brdf(scene(gamma, SIGMAS[sigma]))
    judge.keeps(chi_square(brdf, brdf, direction(theta, PHI), 100_000, judge.seed(1)))


@pytest.mark.parametrize("sigma", SIGMAS)
@pytest.mark.parametrize("theta", THETAS)
def test_another_density_is_rejected(theta, sigma, judge):
    """The negative controls: σ 3 % off, and the azimuth of the roughness turned."""
    drawn = Brdf(scene(2.0, SIGMAS[sigma], kd=0.0))
    off = Brdf(scene(2.0, tuple(1.03 * s for s in SIGMAS[sigma]), kd=0.0))
    i = direction(theta, PHI)
    judge.catches(chi_square(drawn, off, i, 400_000, judge.seed(2)))
    if sigma == "ten to one":
        turned = Brdf(scene(2.0, SIGMAS[sigma][::-1], kd=0.0))
        judge.catches(chi_square(drawn, turned, i, 10_000, judge.seed(2)))


def test_the_density_loses_only_what_leaves_below_the_horizon(judge):
    """Mirrors alone, γ = 2: ∫ pdf is the chance to stay above it, by drawing normals."""
    brdf, i = Brdf(scene(kd=0.0)), direction(60, 0)
    mass = expected(brdf, i, *edges(i)).sum()
    rng = np.random.default_rng(judge.seed(3))
    drawn = importance.sample(brdf.scene, np.tile(i, (200_000, 1)), rng, several=False).o
    above = np.mean(drawn[:, 2] > 0)
    judge.near(above, mass, np.sqrt(mass * (1 - mass) / 200_000))
    assert mass < 0.99


# Weights


def albedo(brdf, theta, phi=0.0, seed=9):
    """What the model itself says of the albedo, and its standard error."""
    asked = Scene(material=brdf.scene.material, roughness=brdf.scene.roughness,
                  light=Light((theta,), (phi,)), effects=brdf.scene.effects)  # fmt: skip
    if brdf.model in all_orders():
        found = model.walk(asked, brdf.model, walks=100_000, seed=seed)
    else:
        found = model.predict(asked, brdf.model)
    material = asked.material
    value = found.microsurf.albedo(n=material.n, kd=material.kd[0]).item()
    return value, found.microsurf.ray_error(n=material.n, kd=material.kd[0]).item()


CASES = {
    "IL": scene(kd=0.6),
    "Lambertian": scene(8.0, (0.7,), n=1.0, kd=0.6),
    "mirror": scene(1.75, (0.5, 0.2), kd=0.0),
    "flat": scene(sigma=(0.0,), kd=0.6),
    "gold": Scene(material=Material(0.43, k=2.455), roughness=Roughness(2.0, (0.4,))),
}


@pytest.mark.parametrize("name", [*order_one(), *all_orders()])
@pytest.mark.parametrize("case", CASES)
def test_weights_add_up_to_the_albedo(case, name, judge):
    """And not to one 30 % higher; at a lower level than others, for there are 30 of them."""
    brdf = Brdf(CASES[case], name)
    count = 40_000 if brdf.stochastic else 3000
    rng = np.random.default_rng(judge.seed(4))
    weight = brdf.sample(np.tile(direction(60, 0), (count, 1)), rng).weight
    value, error = albedo(brdf, 60.0, seed=judge.seed(9))
    spread = np.hypot(weight.std() / np.sqrt(len(weight)), error)
    judge.near(weight.mean(), value, spread, within=1e-6 * value, level=1e-6)
    judge.tells(weight.mean(), 1.3 * value, spread, within=1e-6 * value, level=1e-6)
    assert (weight >= 0).all()


@pytest.mark.long
@pytest.mark.parametrize("name", all_orders())
@pytest.mark.parametrize("roughness", [(1.6, (1.0,)), (2.0, (0.5, 0.05)), (1e4, (0.3,))])
def test_a_walks_weights_are_unbiased(name, roughness, judge):
    """Lobe by lobe: weights by sector and ring of the exit against `walk` with its bins."""
    brdf = Brdf(scene(*roughness, kd=0.6), name)
    count = 400_000
    drawn = brdf.sample(np.tile(direction(50, 0), (count, 1)), np.random.default_rng(judge.seed(5)))
    found = model.walk(
        Scene(material=brdf.scene.material, roughness=brdf.scene.roughness, light=Light((50.0,))),
        name, walks=4_000_000, seed=judge.seed(6),
    )  # fmt: skip
    energy = datasets.by_kind(found.flux, 1.5, 0.6).sum(("kind", "order")).values[0, 0, 0]
    theta = np.degrees(np.arccos(np.minimum(drawn.o[:, 2], 1)))
    turn = np.degrees(np.arctan2(drawn.o[:, 1], drawn.o[:, 0]))
    sector = np.floor(turn / 360 * detector.SECTORS + 0.5).astype(int) % detector.SECTORS
    ring = np.clip(np.searchsorted(detector.RING_EDGES, theta, "right") - 1, 0, detector.RINGS - 1)
    total, square = np.zeros((2, detector.RINGS, detector.SECTORS))
    np.add.at(total, (ring, sector), drawn.weight / count)
    np.add.at(square, (ring, sector), drawn.weight**2 / count**2)
    used = energy * count > 50
    # 1.1: a tenth as many walks in the other estimate.
    off, error = (total - energy)[used], np.sqrt(1.1 * square[used])
    judge.keeps(stats.chi2.sf(np.sum((off / error) ** 2), used.sum()))
    wrong = off + 0.1 * energy[used]  # the negative control
    judge.catches(stats.chi2.sf(np.sum((wrong / error) ** 2), used.sum()))


def test_both_ways_of_sampling_a_walk_join_without_bias(judge):
    """A light of 20° about the mirror direction, by the balance heuristic of Veach and Guibas."""
    brdf, i, count = Brdf(scene(kd=0.6), "smith-walk", walks=2), direction(50, 0), 100_000
    rng, middle = np.random.default_rng(judge.seed(7)), direction(50, 180)
    cosine = np.cos(np.radians(20))
    solid = 2 * np.pi * (1 - cosine)

    def of_light(o):
        return (o @ middle > cosine) / solid

    drawn = brdf.sample(np.tile(i, (count, 1)), rng)
    illuminated = of_light(drawn.o) > 0
    ours = np.where(illuminated, drawn.weight, 0)
    density = brdf.pdf(i, np.where(drawn.o[:, 2:] > 0, drawn.o, [0, 0, 1.0]))
    joined = ours * density / (density + of_light(drawn.o))

    z, turn = 1 - (1 - cosine) * rng.random(count), 2 * np.pi * rng.random(count)
    ring = np.sqrt(1 - z**2)
    along = np.array([np.cos(np.radians(50)), 0, np.sin(np.radians(50))])
    o = np.outer(z, middle) + np.outer(ring * np.cos(turn), along)
    o += np.outer(ring * np.sin(turn), [0, 1.0, 0])
    o /= np.linalg.norm(o, axis=1)[:, None]
    few = slice(0, 4000)
    f = sum(brdf.evaluate(np.tile(i, (4000, 1)), o[few], rng)) * np.maximum(o[few, 2], 0)
    direct = f * solid
    weighed = direct * of_light(o[few]) / (brdf.pdf(i, o[few]) + of_light(o[few]))
    mean = joined.mean() + weighed.mean()
    error = np.hypot(joined.std() / np.sqrt(count), weighed.std() / np.sqrt(4000))
    judge.near(mean, ours.mean(), np.hypot(error, ours.std() / np.sqrt(count)))
    judge.near(mean, direct.mean(), np.hypot(error, direct.std() / np.sqrt(4000)))
    judge.tells(joined.mean(), ours.mean(), ours.std() / np.sqrt(count))  # one part alone


# What the class refuses, and what it hands on


def test_evaluate_is_that_of_the_models(judge):
    i, o, rng = direction(60, 0), direction(30, 170), np.random.default_rng(judge.seed(0))
    for name in order_one():
        assert Brdf(scene(), name).evaluate(i, o) == model.evaluate(scene(), i, o, name)
    mean, error = model.evaluate_walk(scene(), i, o, "smith-walk", 20_000, rng)
    specular, body = Brdf(scene(), "smith-walk", 20_000).evaluate(i, o, rng)
    judge.near(specular + body, mean.total, np.sqrt(2) * error.total)
    judge.tells(specular, mean.total, np.sqrt(2) * error.total)  # a part alone


def test_a_flat_mirror_is_a_delta(judge):
    brdf = Brdf(CASES["flat"])
    i = np.tile(direction(60, 10), (2000, 1))
    drawn = brdf.sample(i, np.random.default_rng(judge.seed(1)))
    assert 0 < drawn.delta.mean() < 1
    np.testing.assert_allclose(drawn.o[drawn.delta], i[drawn.delta] * [-1, -1, 1])
    expected_albedo = facet.albedo(0.5, 1.5, 0.6)
    judge.near(drawn.weight.mean(), expected_albedo, drawn.weight.std() / np.sqrt(2000))
    assert brdf.pdf(i[0], i[0] * [-1, -1, 1]) < 1


def test_one_order_of_a_walk_samples_one_order(judge):
    alone = scene(kd=0.6, effects=Effects(multiple_scattering=False))
    weight = Brdf(alone, "smith-walk").sample(
        np.tile(direction(60, 0), (40_000, 1)), np.random.default_rng(judge.seed(2))
    ).weight  # fmt: skip
    value, _ = albedo(Brdf(alone, "smith"), 60.0)
    judge.near(weight.mean(), value, weight.std() / 200)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: Brdf(scene(), "guess"), "model = 'guess': must be one of flat"),
        (lambda: Brdf(Scene(material=Material(1.5, (0.1, 0.2)))), "material.kd"),
        (lambda: Brdf(scene(), "smith-walk").evaluate(UP, UP), "give rng"),
        (lambda: Brdf(scene()).sample(-UP, np.random.default_rng(0)), "above the horizon"),
        (lambda: Brdf(scene()).pdf(2 * UP, UP), "i: must be unit vectors"),
    ],
)
def test_refuses_what_makes_no_sense(call, words):
    with pytest.raises(InputError, match=words):
        call()


UP = np.array([0.0, 0.0, 1.0])
