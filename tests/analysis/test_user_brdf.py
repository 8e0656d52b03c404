"""What is expected of a user BRDF, and what is said of it."""

from dataclasses import replace

import numpy as np
import pytest

from microsurf.analysis import user_brdf
from microsurf.analysis.comparison import Comparison, decide
from microsurf.analysis.user_brdf import Lobes
from microsurf.results import datasets, detector
from microsurf.scene import Light, Material, Scene


def row(effect, half=0.01, model="own", predicted=0.5, margin=0.05):
    low, high = effect - half, effect + half
    return Comparison(
        quantity="body", theta_i=30.0, phi_i=0.0, kd=0.5, measured=predicted * (1 + effect),
        standard_error=0.001, model=model, predicted=predicted, predicted_error=0.0,
        effect=effect, low=low, high=high, basis="4 surfaces", surfaces=4, margin=margin,
        verdict=decide(low, high, margin),
        expected="holds", why="",
    )  # fmt: skip


@pytest.mark.parametrize(
    ("own", "theory", "unexpected"),
    [
        (0.0, 0.0, False),
        (0.2, 0.0, True),  # the theory holds: it must
        (0.045, 0.0, True),  # undecided where the theory holds
        (0.2, 0.2, False),  # the theory stops here
        (0.0, 0.2, False),  # better than the theory
        (0.24, 0.2, False),  # as near as the theory, within the margin
        (0.3, 0.2, True),  # farther than the theory by more than the margin
        (-0.3, 0.2, True),
        (0.04, 0.045, False),  # both undecided
    ],
)
def test_it_must_hold_unless_the_theory_does_not_and_it_comes_as_near(own, theory, unexpected):
    assert user_brdf.expected_of(row(own), row(theory)).unexpected is unexpected


@pytest.mark.parametrize(
    ("own", "own_predicted", "theory", "words"),
    [
        (0.0, 0.5, 0.0, "as the theory"),
        (0.2, 0.5, 0.2, "as the theory, which departs here"),
        (0.2, 0.4, 0.0, "the user BRDF's own: the theory holds here"),
        (0.01, 0.6, 0.2, "not the theory, and holds; it does not"),
        (0.01, 0.495, 0.0, "not the theory, and holds"),
        (0.3, 0.45, 0.2, "not the theory, which departs here too"),
    ],
)
def test_a_bug_is_told_from_where_theory_stops(own, own_predicted, theory, words):
    found = user_brdf.beside_theory(row(own, predicted=own_predicted), row(theory, model="smith"))
    assert found.finding == words
    assert found.effect == pytest.approx(own_predicted / 0.5 - 1)


def test_errors_of_both_are_in_the_interval():
    theory = replace(row(0.0, model="smith-walk"), predicted_error=0.01)
    own = user_brdf.widened(row(0.0, predicted=0.52), 0.02)
    found = user_brdf.beside_theory(own, theory)
    assert found.high - found.effect == pytest.approx(1.04 * (0.02 + 1.959964 * 0.02))
    assert found.finding.startswith("as the theory")


def test_a_bound_on_its_error_widens_the_interval_and_can_undo_a_verdict():
    plain = row(0.0)
    wide = user_brdf.widened(plain, 0.045)
    assert (wide.low, wide.high) == pytest.approx((-0.055, 0.055))
    assert (plain.verdict, wide.verdict) == ("holds", "undecided")
    assert user_brdf.widened(plain, 0.0) == plain


SCENE = Scene(material=Material(1.5, (0.5,)), light=Light((30.0,)))


def lobe(shape):
    """A result whose order-1 body lobe is ``shape`` by ring, all else dark."""
    flux = np.zeros((1, 1, 1, 1, 2, detector.RINGS, detector.SECTORS))
    bins = np.repeat(np.asarray(shape, float)[:, None], detector.SECTORS, axis=1)
    flux[0, 0, 0, 0, 1] = bins / bins.sum()
    return datasets.build(flux, [30.0], [0.0], orders=(1,))


def test_lobes_of_the_same_albedo_are_told_apart_with_the_place():
    rings = np.arange(detector.RINGS)
    measured = lobe(np.exp(-((rings - 20) ** 2) / 50))
    shifted = lobe(np.exp(-((rings - 26) ** 2) / 50))
    (same,) = user_brdf.lobes(Lobes(measured, measured, measured), SCENE, "body", 0.05)
    assert (same.to_theory, same.to_measured, same.theory_to_measured) == (0, 0, 0)
    (found,) = user_brdf.lobes(Lobes(measured, measured, shifted), SCENE, "body", 0.05)
    # Two normal densities 6/5 of σ apart: ∫|p − q| = 2 (2 Φ(0.6) − 1).
    assert found.to_theory == pytest.approx(2 * (2 * 0.725747 - 1), abs=0.01)
    assert found.to_measured > found.allowed == 0.05
    # p − q is largest 5.25 rings from the middle: (x − 3)/(x + 3) = exp(−0.24 x).
    assert found.theta_o in (2.0 * 18, 2.0 * 28)


def test_dark_lobes_are_left_out():
    dark = lobe(np.ones(detector.RINGS))
    assert user_brdf.lobes(Lobes(dark, dark, dark), SCENE, "specular", 0.05) == []
