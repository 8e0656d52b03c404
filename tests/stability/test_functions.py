"""The map: enough digits everywhere, and worse laws are caught by it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import gammaln, stdtr

from microsurf.physics import fresnel
from microsurf.stability import domain
from microsurf.stability.case import ENOUGH, points
from microsurf.stability.functions import FUNCTIONS
from microsurf.stability.map import summarise
from microsurf.stability.samplers import SAMPLERS
from microsurf.stability.sweep import sweep

# Two or three values of each coordinate, the ends among them.
SMALL = {
    "gamma": (domain.QUICK["gamma"][0], 1.75, 8.0, 1e3, 1e9, np.inf),
    "sigma": (1e-6, 0.5, 10.0),
    "wide": (1e-6, 10.0),
    "theta": (0.0, 5.0, 75.0, 89.99999),
    "below": (90.00001, 120.0, 179.9),
    "tilt": (0.0, 60.0, 89.99999),
    "rho": (1e-8, 1.0, 1e8),
    "u": (1e-300, 0.5, 1 - 2.0**-53),
    "s": (1e-9, 1.0, 36.0),
    "n": (1.0, 1 + 2.0**-52, 1.5, 100.0),
    "k": (1e-6, 1.0, 100.0),
    "metal": (1e-3, 0.9999, 100.0),
    "kd": (0.0, 0.5, 1 - 2.0**-53, 1.0),
}


def found(function, values=SMALL):
    return summarise(function, list(points(function, values)))


def named(name):
    return next(function for function in FUNCTIONS if function.name == name)


@pytest.mark.parametrize("function", [*FUNCTIONS, *SAMPLERS], ids=lambda function: function.name)
def test_twelve_digits_beyond_conditioning(function):
    summary = found(function)
    assert summary.worst.kept >= ENOUGH, summary.worst
    assert summary.verdict == "ok"


@pytest.mark.long
@pytest.mark.parametrize("function", [*FUNCTIONS, *SAMPLERS], ids=lambda function: function.name)
def test_twelve_digits_beyond_conditioning_on_the_fine_map(function):
    """Or a note says where not, and why."""
    summary = found(function, domain.FULL)
    assert summary.verdict != "short", summary.worst


def test_lambda_keeps_relative_digits_where_it_is_tiny():
    tiny = [point for point in points(named("Λ"), domain.QUICK) if 0 < point.exact < 1e-8]
    assert len(tiny) > 30
    assert min(point.right for point in tiny) > ENOUGH


def naive_lambda(gamma, sigma, wx, wz):
    """A − SF as it stands: loses the digits of a difference."""
    nu = 2 * gamma - 2
    x = np.sqrt(2) * wz / (sigma * wx)
    log_constant = gammaln((nu + 1) / 2) - gammaln(nu / 2) - np.log(nu * np.pi) / 2
    leading = np.exp(log_constant - (nu - 1) / 2 * np.log1p(x**2 / nu)) * nu / ((nu - 1) * x)
    return leading - stdtr(nu, -x)


FINITE = SMALL | {"gamma": (1.75, 8.0, 1e3, 1e9), "theta": (5.0, 75.0, 89.99999), "sigma": (0.5,)}


def test_a_naive_lambda_is_caught():
    """The negative control: where Λ is tiny, and where gamma functions are subtracted."""
    summary = found(replace(named("Λ"), value=naive_lambda), FINITE)
    assert summary.verdict == "short"
    assert summary.worst.kept < 9
    # Where nothing cancels but ln Γ at γ = 1e9: ε ln Γ ~ ε 2e10.
    one = FINITE | {"gamma": (1e9,), "theta": (75.0,)}
    assert found(replace(named("Λ"), value=naive_lambda), one).worst.kept < ENOUGH
    assert found(named("Λ"), FINITE).verdict == "ok"


def test_a_transmittance_of_one_minus_f_is_caught():
    """The negative control of facets: at grazing 1 − F has the absolute error of F."""
    naive = replace(named("T = 1 − F"), value=lambda mu, n: 1 - fresnel.reflectance(mu, n))
    summary = found(naive, SMALL | {"n": (1.5,)})
    assert summary.verdict == "short"
    assert summary.worst.coordinates["theta"] == 89.99999


def test_what_is_no_number_has_no_digits():
    summary = found(replace(named("r_e"), value=lambda _: np.nan))
    assert summary.worst.right == summary.worst.kept == 0
    assert summary.verdict == "short"
    noted = found(replace(named("r_e"), value=lambda _: np.nan, note="never"))
    assert noted.verdict == "stated"


def test_no_nan_no_infinity_nothing_negative():
    counts = sweep(12, 500, np.random.default_rng(7))
    assert {row.function for row in counts} >= {
        "D",
        "Λ",
        "Λ, σ = 0",
        "F",
        "r_i",
        "albedo of a facet",
    }
    for row in counts:
        assert row.values > 0
        assert (row.nan, row.infinite, row.negative) == (0, 0, 0), row


def test_what_is_no_number_is_counted(monkeypatch):
    monkeypatch.setattr("microsurf.physics.vcavity.g1", lambda *_: np.array([np.nan, np.inf, -1]))
    counts = {row.function: row for row in sweep(2, 10, np.random.default_rng(7))}
    row = counts["G1, V-cavity"]
    assert (row.values, row.nan, row.infinite, row.negative) == (6, 2, 2, 2)
