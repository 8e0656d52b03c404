"""Verdicts: a 95 % interval must hold the truth in 95 of 100 experiments."""

from dataclasses import replace

import numpy as np
import pytest
from judge import rate
from scipy import stats

from microsurf.analysis.comparison import ComparisonTable, compare, decide
from microsurf.errors import InputError
from microsurf.model import UserBrdf, predict_user_brdf
from microsurf.results import datasets, detector
from microsurf.scene import Light, Material, Roughness, Scene
from microsurf.scene.expectation import Expectation

MARGIN = 0.05
EXPERIMENTS = 400
WITH_LIGHT = {"theta_o": [0, 3], "phi_o": [0, 4]}
"""The bins of `experiments`: all others hold nothing, and to add it up is most of the work."""


@pytest.mark.parametrize(
    ("low", "high", "verdict"),
    [
        (-0.01, 0.02, "holds"),
        (-MARGIN, MARGIN, "holds"),
        (0.0, 0.0, "holds"),
        (MARGIN, MARGIN, "holds"),
        (-MARGIN, np.nextafter(MARGIN, 1), "undecided"),
        (np.nextafter(-MARGIN, -1), MARGIN, "undecided"),
        (MARGIN, 0.2, "undecided"),
        (np.nextafter(MARGIN, 1), 0.2, "departs"),
        (-0.2, -MARGIN, "undecided"),
        (-0.2, np.nextafter(-MARGIN, -1), "departs"),
        (-0.2, 0.2, "undecided"),
        (-np.inf, np.inf, "undecided"),
        (np.nan, np.nan, "undecided"),
    ],
)
def test_edges_of_a_verdict(low, high, verdict):
    assert decide(low, high, MARGIN) == verdict


def experiments(effect, realisations, between, rng, predicted=0.4, paths=100_000):
    """Return a measurement and its prediction: each θ_i is an experiment of its own.

    White Lambertian facets (n = 1, Kd = 1), so a path weighs 1: the albedo of a
    surface is normal about ``predicted (1 + effect)`` with the relative spread
    ``between`` surfaces, its estimate binomial in ``paths``.
    """
    theta = tuple(np.linspace(0, 89, EXPERIMENTS))
    truth = predicted * (1 + effect + between * rng.standard_normal((realisations, EXPERIMENTS)))
    seen = rng.binomial(paths, truth) / paths
    flux = np.zeros((realisations, EXPERIMENTS, 1, 1, 2, detector.RINGS, detector.SECTORS))
    flux[:, :, 0, 0, 1, 3, 4] = seen
    measured = datasets.build(flux, theta, (0.0,), orders=(1,)).isel(WITH_LIGHT)
    dims = ("realisation", "theta_i", "phi_i")
    measured["paths"] = (dims, np.full((realisations, EXPERIMENTS, 1), float(paths)))
    flux = np.zeros((1, *flux.shape[1:]))
    flux[0, :, 0, 0, 1, 0, 0] = predicted
    theory = datasets.build(flux, theta, (0.0,), orders=(1,)).isel(WITH_LIGHT)
    scene = Scene(
        material=Material(1.0, (1.0,)),
        light=Light(theta),
        expect={"body": Expectation(margin=MARGIN), "total": Expectation(margin=MARGIN)},
    )
    return [row for row in compare(measured, theory, scene) if row.quantity == "body"]


def covered(rows, effect):
    return sum(row.low <= effect <= row.high for row in rows)


@pytest.mark.parametrize("realisations", [2, 4, 16])
@pytest.mark.parametrize("effect", [0.0, 0.08])
def test_intervals_over_surfaces_hold_the_truth(realisations, effect, judge):
    rng = np.random.default_rng(judge.seed(realisations))
    rows = experiments(effect, realisations, 0.02, rng)
    assert len(rows) == EXPERIMENTS
    assert {row.basis for row in rows} == {f"{realisations} surfaces"}
    judge.keeps(rate(covered(rows, effect), EXPERIMENTS, 0.95))


def test_intervals_of_rays_hold_the_truth_of_one_surface(judge):
    rows = experiments(0.03, 1, 0.0, np.random.default_rng(judge.seed(1)))
    assert {row.basis for row in rows} == {"rays on one surface"}
    judge.keeps(rate(covered(rows, 0.03), EXPERIMENTS, 0.95))


def test_intervals_of_rays_miss_where_surfaces_differ(judge):
    """Negative control: rays on one surface know nothing of the others.

    2 % between surfaces against 0.4 % of the rays: an interval of ±1.96 · 0.4 %
    holds the truth in 30 % of cases.
    """
    rows = experiments(0.0, 1, 0.02, np.random.default_rng(judge.seed(2)))
    expected = 2 * stats.norm.cdf(1.96 * 0.00387 / np.hypot(0.02, 0.00387)) - 1
    judge.keeps(rate(covered(rows, 0.0), EXPERIMENTS, expected))
    judge.catches(rate(covered(rows, 0.0), EXPERIMENTS, 0.95))


@pytest.mark.parametrize("effect", [MARGIN, -MARGIN])
def test_at_the_margin_either_verdict_is_wrong_in_one_of_40(effect, judge):
    """All of an interval lies on one side of the truth in 2.5 % of cases.

    Negative control: beyond the margin by two standard errors of the mean they are more.
    """
    rng = np.random.default_rng(judge.seed(3))

    def p_values(effect):
        rows = experiments(effect, 8, 0.01, rng)
        found = [sum(row.verdict == verdict for row in rows) for verdict in ("holds", "departs")]
        return rate(found, EXPERIMENTS, 0.0, 0.025)

    judge.keeps(p_values(effect))
    judge.catches(p_values(effect + 0.02 / np.sqrt(8)))


def test_clear_effects_are_decided():
    """Fourteen standard errors from the margin, and more: any seed does."""
    for effect, verdict in ((0.0, "holds"), (0.2, "departs"), (-0.2, "departs")):
        rows = experiments(effect, 8, 0.01, np.random.default_rng(4))
        assert sum(row.verdict == verdict for row in rows) > 0.99 * EXPERIMENTS


def small(n=1.5, kd=(0.8,), theta=(0.0, 60.0), measured=(0.1, 0.2), predicted=(0.1, 0.2), **rest):
    """Two bins of light, specular and body, the same for every angle."""
    rows = []
    for specular, body in (measured, predicted):
        flux = np.zeros((3, len(theta), 1, 1, 2, detector.RINGS, detector.SECTORS))
        flux[..., 0, 5, 5], flux[..., 1, 5, 5] = specular, body
        rows.append(datasets.build(flux, theta, (0.0,), orders=(1,)))
    dims = ("realisation", "theta_i", "phi_i")
    rows[0]["paths"] = (dims, np.full((3, len(theta), 1), 1e4))
    return compare(rows[0], rows[1].isel(realisation=[0]), Scene(
        material=Material(n, kd), light=Light(theta), **rest
    ))  # fmt: skip


def test_only_what_the_scene_has_is_compared():
    def names(**scene):
        return [row.quantity for row in small(**scene)]

    assert names(theta=(0.0,)) == ["specular", "body", "total"]
    assert names(theta=(0.0,), n=1.0, measured=(0, 0.2), predicted=(0, 0.2)) == ["body", "total"]
    assert names(theta=(0.0,), kd=(0.0,)) == ["specular", "total"]
    assert names(theta=(0.0,), kd=(0.0, 0.5)) == ["specular"] * 2 + ["body"] + ["total"] * 2
    assert names(n=1.0, kd=(0.0,)) == []


@pytest.mark.parametrize(
    ("value", "names"),
    [
        (lambda i, o: (0 * i[:, 2] + 0.01, 0 * o[:, 2] + 0.2), ["specular", "body"]),
        (lambda i, _: 0 * i[:, 2] + 0.2, ["total"]),
    ],
)
def test_a_user_brdf_of_all_orders_is_compared_in_total_alone(value, names):
    scene = Scene(roughness=Roughness(2.0, (0.3,)), light=Light((0.0,)))
    predicted = predict_user_brdf(UserBrdf("toy", value), scene)
    flux = np.full((2, 1, 1, 4, 2, detector.RINGS, detector.SECTORS), 1e-5)
    measured = datasets.build(flux, (0.0,), (0.0,))
    measured["paths"] = (("realisation", "theta_i", "phi_i"), np.full((2, 1, 1), 1e4))
    assert [row.quantity for row in compare(measured, predicted, scene)] == names


def test_effect_and_interval_by_hand():
    """No spread over three surfaces: the interval is the effect itself."""
    (row,) = (r for r in small(theta=(60.0,), measured=(0.11, 0.2)) if r.quantity == "specular")
    assert row.effect == pytest.approx(0.1, rel=1e-12)
    assert row.low == pytest.approx(row.effect, abs=1e-12)
    assert row.high == pytest.approx(row.effect, abs=1e-12)
    assert (row.measured, row.predicted) == pytest.approx((0.11, 0.1))
    assert row.verdict == "departs"


def test_a_sampled_prediction_adds_its_own_error_to_the_total():
    """No spread over surfaces: what is left is the binomial error of 1e4 white walks."""
    labelled = []
    for specular, orders in ((0.3, (1,)), (0.2, (1,)), (0.25, (1,))):
        flux = np.zeros((2, 1, 1, 1, 2, detector.RINGS, detector.SECTORS))
        flux[..., 0, 5, 5] = specular
        labelled.append(datasets.build(flux, (0.0,), (0.0,), orders=orders))
    measured, single, walked = labelled
    single, walked = single.isel(realisation=[0]), walked.isel(realisation=[0])
    dims = ("realisation", "theta_i", "phi_i")
    measured["paths"] = (dims, np.full((2, 1, 1), 1e4))
    walked["paths"] = (dims, np.full((1, 1, 1), 1e4))
    walked.attrs["model"] = "smith-walk"
    scene = Scene(material=Material(1.5, (0.0,)), light=Light((0.0,)))
    specular, total = compare(measured, single, scene, walked)
    assert specular.effect == pytest.approx(0.5)
    assert specular.predicted_error == 0
    assert (total.model, total.effect) == ("smith-walk", pytest.approx(0.2))
    error = np.sqrt(0.25 * 0.75 / 1e4)
    assert total.predicted_error == pytest.approx(error)
    # Of measured/predicted: the relative error of the prediction times the ratio.
    half = stats.norm.ppf(0.975) * 1.2 * error / 0.25
    assert (total.low, total.high) == pytest.approx((0.2 - half, 0.2 + half))


def test_expectations_are_by_angle_and_may_be_several():
    rows = small(
        measured=(0.11, 0.2),
        expect={"specular": Expectation(("holds", "departs|undecided"), 0.05, "because")},
    )
    first, second = (row for row in rows if row.quantity == "specular")
    assert (first.expected, second.expected) == ("holds", "departs|undecided")
    assert first.unexpected
    assert not second.unexpected
    assert first.why == "because"
    assert not any(row.unexpected for row in rows if row.quantity != "specular")


def test_one_expectation_serves_all_angles():
    rows = small(theta=(0.0, 30.0, 60.0), expect={"body": Expectation(("departs",))})
    assert [row.unexpected for row in rows if row.quantity == "body"] == [True] * 3


def test_expectations_of_another_number_of_angles_are_refused():
    with pytest.raises(InputError, match="2 entries"):
        Scene(light=Light((0.0,)), expect={"body": Expectation(("holds", "holds"))})


def two_orders(second, orders):
    """One surface's worth of mirrors: 0.2 after one bounce, ``second`` after two."""
    flux = np.zeros((3, 1, 1, len(orders), 1, detector.RINGS, detector.SECTORS))
    flux[..., 0, 0, 5, 5] = 0.2
    if len(orders) > 1:
        flux[..., 1, 0, 5, 5] = second
    found = datasets.build(flux, (0.0,), (0.0,), orders=orders)
    return found.assign(paths=(("realisation", "theta_i", "phi_i"), np.full((3, 1, 1), 1e4)))


def test_all_orders_are_never_judged_against_one_bounce():
    """A quarter of the light has met a second facet: order 1 is right and says nothing of it."""
    scene = Scene(material=Material(1.5, (0.0,)), light=Light((0.0,)))
    measured, single = two_orders(0.05, (1, 2)), two_orders(0.0, (1,)).isel(realisation=[0])
    assert [row.quantity for row in compare(measured, single, scene)] == ["specular"]
    walked = two_orders(0.05, (1, 2)).isel(realisation=[0])
    rows = compare(measured, walked, scene)
    assert [(row.quantity, round(row.effect, 9)) for row in rows] == [("specular", 0), ("total", 0)]
    assert [row.quantity for row in compare(measured, single, scene, walked)] == [
        "specular", "total"
    ]  # fmt: skip
    flat = replace(scene, roughness=Roughness(2.0, (0.0,)))
    assert [row.quantity for row in compare(two_orders(0.0, (1, 2)), single, flat)] == [
        "specular", "total"
    ]  # fmt: skip


def test_comparisons_are_a_table():
    found = small(theta=(60.0,), measured=(0.11, 0.2))
    assert isinstance(found, ComparisonTable)
    assert [row["quantity"] for row in found.rows] == ["specular", "body", "total"]
    assert found.rows[0]["unexpected"] == found[0].unexpected
    lines = repr(found[:1]).splitlines()
    assert len(lines) == 2
    assert "+10.00%" in lines[1]
    assert found._repr_html_().count("<tr>") == 4
    named = ComparisonTable([replace(found[0], model="<b>&")])
    assert "&lt;b&gt;&amp;" in named._repr_html_()
    assert "<b>" not in named._repr_html_()
