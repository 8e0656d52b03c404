"""Fits of made-up BRDFs, whose parameters are known."""

from dataclasses import replace

import numpy as np
import pytest
from made import closed_form, directions, measured

from microsurf.analysis.brdf_fit import aperture, later_orders, verdict
from microsurf.analysis.brdf_fit.fit import fit_brdf
from microsurf.analysis.brdf_fit.held_out import held_out
from microsurf.analysis.brdf_fit.inside import best_indices, best_weights
from microsurf.analysis.brdf_fit.materials import MATERIALS, lobes
from microsurf.analysis.brdf_fit.nearby import derivatives, follow
from microsurf.analysis.brdf_fit.parameters import Layout
from microsurf.analysis.brdf_fit.problem import problem_of
from microsurf.analysis.brdf_fit.scene_of import scene_of
from microsurf.analysis.brdf_fit.solve import Question, evaluate, refine, solve
from microsurf.analysis.brdf_fit.summary import figures, parameters
from microsurf.errors import InputError
from microsurf.physics.facet import body_weight
from microsurf.scene import Scene

PAINT = "interfaced-lambertian"
GAMMA, SIGMA, N, KD = 2.5, 0.3, 1.5, (0.1, 0.4, 0.8)
WEIGHTS = [float(body_weight(N, kd)) for kd in KD]


@pytest.fixture(scope="module")
def paint():
    """Without noise, of the closed form: what a fit of order 1 must give back."""
    return closed_form(PAINT, [np.log(SIGMA), 1 / (GAMMA - 1), N], WEIGHTS, directions())


@pytest.fixture(scope="module")
def fitted(paint):
    """The fit of it with order 1."""
    return fit_brdf(paint, orders="1")


def test_a_paint_gives_its_parameters_back(fitted):
    found = parameters(fitted.one_order)
    assert found["gamma"] == pytest.approx(GAMMA, rel=1e-3)
    assert found["sigma"] == pytest.approx(SIGMA, rel=1e-3)
    assert found["n"] == pytest.approx(N, rel=1e-3)
    assert found["kd"] == pytest.approx(KD, rel=1e-3)
    assert fitted.verdict == "fits"
    assert fitted.measured.remarks == ()


def test_std_wins_at_held_out_angles_over_what_it_is_not(fitted):
    values = figures(fitted)
    assert values["held_out_log_rms"]["std"] < 1e-5
    assert min(values["held_out_log_rms"][name] for name in ("beckmann", "ggx")) > 1e-4
    assert values["held_out_theta_i"] == pytest.approx([32.14, 64.29], abs=0.01)
    assert values["evidence"]["ggx"]["better"] == values["evidence"]["ggx"]["of"] == 8


def test_a_conductor_has_an_index_for_each_channel():
    truth = [[0.2, 3.5], [1.1, 2.6]]
    made = closed_form("conductor", [np.log(0.25), 0.5], truth, directions())
    found = parameters(fit_brdf(made, "conductor", orders="1", hold_out=()).one_order)
    assert found["gamma"] == pytest.approx(3.0, rel=2e-3)
    assert found["sigma"] == pytest.approx(0.25, rel=2e-3)
    # F at normal incidence is known far better than n and k are.
    f0 = [((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2) for n, k in truth]
    got = [
        ((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2)
        for n, k in zip(found["n"], found["k"], strict=True)
    ]
    assert got == pytest.approx(f0, rel=2e-3)


def test_lambertian_plus_conductor():
    name = "lambertian+conductor"
    made = closed_form(name, [np.log(0.4), 0.3, 0.8, 2.0], [0.2, 0.5], directions())
    fit = fit_brdf(made, name, hold_out=())
    assert fit.all_orders is None  # no light walks there
    found = parameters(fit.one_order)
    assert found["sigma"] == pytest.approx(0.4, rel=5e-3)
    assert found["kd"] == pytest.approx([0.2, 0.5], rel=5e-3)


def test_anisotropy_and_the_azimuth_of_its_axes():
    along, turn = 0.4, np.radians(17.0)
    stretch = along * np.cos(2 * turn), along * np.sin(2 * turn)
    angles = directions(5, 16, azimuths=(0.0, 0.6, 1.2, 1.9, 2.6))
    made = closed_form(PAINT, [np.log(0.25), *stretch, 0.5, 1.5], [0.3], angles, isotropic=False)
    found = parameters(fit_brdf(made, isotropic=False, orders="1", hold_out=()).one_order)
    assert found["azimuth"] == pytest.approx(17.0, abs=0.1)
    assert found["sigma_x"] == pytest.approx(0.25 * np.exp(along), rel=2e-3)
    assert found["sigma_y"] == pytest.approx(0.25 * np.exp(-along), rel=2e-3)
    assert found["azimuth_ci"][0] <= found["azimuth"] <= found["azimuth_ci"][1]
    # An isotropic fit may be right in the mean over azimuths: that is for people to compare.
    isotropic = fit_brdf(made, orders="1", hold_out=())
    assert "is there a lay" in isotropic.measured.remarks[-1]
    assert isotropic.one_order.solution.rms > 0.01


def test_all_orders_add_light_and_move_the_fit(paint):
    """Data of order 1 alone, fitted with all orders: another γ; the same seed, the same bits."""
    fit = fit_brdf(paint, hold_out=(), walks=100)
    assert fit.rounds < later_orders.ROUNDS
    assert fit.all_orders.question.later.mean() > 0
    assert abs(parameters(fit.all_orders)["gamma"] / GAMMA - 1) > 0.01
    again = fit_brdf(paint, hold_out=(), walks=100)
    assert np.array_equal(again.all_orders.solution.vector, fit.all_orders.solution.vector)


def test_scenes_of_fits_read_back(fitted):
    scene = scene_of(fitted)
    assert Scene.from_toml(scene.to_toml()) == scene
    assert scene.material.n == pytest.approx(N, rel=1e-3)
    assert len(scene.material.kd) == 3


def test_a_peak_between_the_pairs_is_narrow():
    angles = directions()
    values = closed_form(PAINT, [np.log(0.2), 0.0, 1.0], [0.3], angles).values
    problem = problem_of(measured(angles, values))
    off = verdict.from_mirror(problem)
    for group in range(3, 7):  # one pair at four incidences sees the gloss
        mine = np.flatnonzero(problem.groups == group)
        values[mine[np.argmin(off[mine])]] = 50.0
    fit = fit_brdf(measured(angles, values), orders="1", hold_out=())
    assert fit.verdict == "narrow"
    assert figures(fit)["gamma"] is None
    assert figures(fit)["sigma_ci"] is None
    with pytest.raises(InputError, match="narrower than the instrument"):
        scene_of(fit)


def test_what_no_single_interface_sends_does_not_fit():
    """A sharp gloss over a broad one, as metallic paints have."""
    angles = directions(8, 60)
    sharp = closed_form("conductor", [np.log(0.04), 0.0], [[1.5, 0.1]], angles).values
    broad = closed_form("conductor", [np.log(0.35), 0.0], [[0.5, 3.0]], angles).values
    fit = fit_brdf(measured(angles, sharp + broad / 2), orders="1", hold_out=())
    assert fit.verdict == "does not fit"
    assert "zone measures" in fit.reason
    assert any(zone.verdict == "departs" for zone in fit.zones)
    with pytest.raises(InputError, match="does not fit: at θ_i"):
        scene_of(fit)


def test_gamma_at_the_border_is_said():
    made = closed_form(PAINT, [np.log(0.1), 1.96, 1.5], [0.3], directions(8, 40))
    fit = fit_brdf(made, orders="1", hold_out=())
    assert fit.verdict == "border"
    assert "γ → 1.51" in fit.reason
    # All refits stop there, so that their scatter is no interval.
    assert figures(fit)["gamma_ci"] is None


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"material": "wood"}, "must be one of"),
        ({"orders": "2"}, "must be 1 or all"),
        ({"margin": 1.5}, "between 0 and 1"),
        ({"aperture": 0.0}, "aperture = 0.0"),
        ({"aperture": 90.0}, "aperture = 90.0"),
        ({"hold_out": (95.0,)}, "--hold-out 95"),
        ({"isotropic": False}, "needs several"),
    ],
)
def test_bad_options_are_refused(paint, change, words):
    with pytest.raises(InputError, match=words):
        fit_brdf(paint, **{"orders": "1", **change})


def test_pairs_all_at_one_angle_are_refused():
    with pytest.raises(InputError, match="1 incidence only"):
        fit_brdf(measured(directions(1, 50), np.ones((50, 1))))


def test_pairs_all_seen_at_one_angle_are_refused():
    theta_i, phi_i, theta_o, phi_o = directions(8, 50)
    angles = theta_i, phi_i, np.full_like(theta_o, 0.5), phi_o
    with pytest.raises(InputError, match="seen at θ_o = 28"):
        fit_brdf(measured(angles, np.ones((len(theta_i), 1))))


def test_angles_in_radians_and_no_light_are_refused():
    angles = directions(8, 50)
    values = np.ones((len(angles[0]), 1))
    with pytest.raises(InputError, match="look like radians"):
        fit_brdf(measured([np.radians(a) for a in angles], values))
    with pytest.raises(InputError, match="no light to fit"):
        fit_brdf(measured(angles, -values))


def test_weights_inside_are_the_minimum(paint):
    problem = problem_of(paint)
    rng = np.random.default_rng(2)
    body, fixed = rng.random(len(problem.i)), rng.random((len(problem.i), 3))
    weights = best_weights(problem, fixed, body, None)

    def squares(w):
        return np.sum(problem.residuals(fixed + body[:, None] * w) ** 2, axis=0)

    for move in (-1e-4, 1e-4):
        trial = np.clip(weights + move, 0, 1)
        assert np.all(squares(trial) >= squares(weights) - 1e-12)


@pytest.mark.parametrize("truth", [[0.2, 3.5], [1.3, 0.02]])
def test_indices_inside_are_the_minimum(truth):
    """Also where k stops at its bound, and n has to find its own way."""
    vector = np.array([np.log(0.25), 0.5])
    brdf = closed_form("conductor", vector, [truth, [1.1, 2.6]], directions())
    noise = 1 + 0.05 * np.random.default_rng(4).standard_normal(brdf.values.shape)
    problem = problem_of(replace(brdf, values=brdf.values * noise))
    material = MATERIALS["conductor"]
    modelled = lobes(problem, material, Layout(material.optics, None, True), vector)
    found = best_indices(problem, modelled, 0.0, None)
    again = best_indices(problem, modelled, 0.0, found * 1.2)
    assert again == pytest.approx(found, rel=1e-6)

    def squares(indices):
        mirrored = np.stack([modelled.mirrored(n, k) for n, k in indices], axis=1)
        return np.sum(problem.residuals(mirrored) ** 2, axis=0)

    for move in np.array([[1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [-1, -1]]) * 1e-4:
        trial = np.clip(found * np.exp(move), 0.02, 20.0)
        assert np.all(squares(trial) >= squares(found) - 1e-12)


def test_the_cone_is_a_mean_over_solid_angle():
    o = np.array([[0.0, 0, 1], [0.6, 0, 0.8]])
    cone = aperture.cone(o, 20.0)
    assert np.allclose(np.linalg.norm(cone, axis=-1), 1)
    cosine = np.einsum("pkc,pc->pk", cone, o)
    assert cosine.min() >= np.cos(np.radians(10.0))
    assert cosine.mean() == pytest.approx((1 + np.cos(np.radians(10.0))) / 2, abs=1e-6)
    assert np.allclose(np.cross(cone.mean(axis=1), o), 0, atol=2e-3)


def test_an_aperture_explains_a_lobe_that_it_widens():
    """A lobe of σ 0.05 seen through a cone of 12° looks rougher; with the cone it does not."""
    angles = directions(8, 60)
    vector, weights = [np.log(0.05), 0.0, 1.5], [0.3]
    axis = closed_form(PAINT, vector, weights, angles, eta=0.0).detector
    x = np.cross(axis, np.where(np.abs(axis[:, :1]) < 0.9, [[1.0, 0, 0]], [[0, 1.0, 0]]))
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    # Gauss and Legendre by rings, not the points of the fit.
    low, total = np.cos(np.radians(6.0)), 0.0
    for node, weight in zip(*np.polynomial.legendre.leggauss(6), strict=True):
        z = low + (1 - low) * (node + 1) / 2
        for turn in 2 * np.pi * np.arange(16) / 16:
            beside = np.cos(turn) * x + np.sin(turn) * np.cross(axis, x)
            o = z * axis + np.sqrt(1 - z**2) * beside
            moved = (*angles[:2], np.arccos(o[:, 2]), np.arctan2(o[:, 1], o[:, 0]))
            one = closed_form(PAINT, vector, weights, moved, eta=0.0).values
            total = total + weight / 32 * one * (o[:, 2:] / axis[:, 2:])
    seen = measured(angles, total)
    wide = parameters(fit_brdf(seen, orders="1", hold_out=()).others["beckmann"])
    true = parameters(fit_brdf(seen, orders="1", hold_out=(), aperture=12.0).others["beckmann"])
    assert wide["sigma"] > 0.06
    assert true["sigma"] == pytest.approx(0.05, rel=0.02)


def test_following_reaches_what_a_search_reaches(paint):
    """From a solution of all pairs to that of some, also where a parameter is at its bound."""
    material = MATERIALS[PAINT]
    rng = np.random.default_rng(8)
    flat = closed_form(PAINT, [np.log(0.3), 0.0, 1.0], [0.3], directions(seed=3))
    for brdf in (paint, flat):
        noise = 1 + 0.05 * rng.standard_normal(brdf.values.shape)
        problem = problem_of(replace(brdf, values=brdf.values * noise))
        question = Question(problem, material, Layout(material.optics, None, True))
        whole = solve(question)
        some = question.select(problem.groups != 5)
        near, searched = follow(some, whole), refine(some, whole.vector)
        assert near.rms == pytest.approx(searched.rms, rel=1e-4)
        assert near.rms < evaluated(some, whole)
        slopes = derivatives(question, whole)[:, problem.groups != 5]
        straight = follow(some, whole, slopes.reshape(len(slopes), -1))
        moved = np.abs(near.vector - whole.vector).max()
        np.testing.assert_allclose(straight.vector, near.vector, atol=0.03 * moved)


def evaluated(question, solution):
    return question.problem.rms(evaluate(question, solution.vector, solution.channel))


def test_held_out_incidences_are_the_nearest(paint):
    mask, angles = held_out(problem_of(paint), (30.0, 60.0))
    assert np.allclose(np.unique(np.degrees(paint.theta_i[mask]).round(2)), angles)
    assert held_out(problem_of(paint), (89.0,))[1] == []
