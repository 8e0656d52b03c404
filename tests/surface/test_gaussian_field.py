import numpy as np
import pytest

from microsurf.surface.gaussian_field import gaussian_field, inverse_lengths


@pytest.mark.parametrize("ratio", [1.0, 3.0])
@pytest.mark.parametrize("correlation", [1.5, 8.0])
def test_initial_field_has_isotropic_facets(ratio, correlation):
    """The autocorrelation's three conditions, written out, not expanded: var p, var q, cov."""
    rx, ry = np.sqrt(ratio), 1 / np.sqrt(ratio)
    xx, yy, xy = inverse_lengths(correlation, rx, ry)
    a, b, c = np.exp(-xx), np.exp(-yy), np.exp(-xx - yy - 2 * xy)
    # Rounding of brentq and of terms of order 1; at 1.5 and 3 a + b < 1 has no solution.
    assert (1 - a) / rx**2 == pytest.approx((1 - b) / ry**2, rel=1e-9)
    if a + b > 1 and xy < 0.89 * np.sqrt(xx * yy):
        assert 1 + c - a - b == pytest.approx(0, abs=1e-12)
    assert (xx * yy) ** -0.25 == pytest.approx(correlation, rel=1e-9)


def test_autocorrelation_of_the_initial_field(judge):
    """Mean over 200 fields at lags along x, y and a diagonal. Control: 3 % of a length more."""
    rng = np.random.default_rng(judge.seed(8))
    lags = [(0, 1), (0, 3), (0, 5), (1, 0), (3, 0), (5, 0), (2, 2), (2, -2), (4, 3)]
    xx, yy, xy = inverse_lengths(3.0, 1.0, 1.0)
    found = []
    for _ in range(200):
        f = gaussian_field(rng.standard_normal((48, 64)), 3.0, 1.0, 1.0)
        found.append([np.mean(f * np.roll(f, lag, (0, 1))) for lag in [(0, 0), *lags]])
    found = np.array(found)
    variance = found[:, 0].mean()
    plain = np.array([np.exp(-xx * x**2 - yy * y**2 - 2 * xy * x * y) for y, x in lags])
    # The mean is taken out of the field: covariance lower by the power at zero frequency.
    lost = np.pi * 9 / (48 * 64)
    expected = (plain - lost) / (1 - lost)
    ratio = found[:, 1:] / variance
    # The common variance is of these fields as well: what a lag is off by follows it.
    error = (found[:, 1:] - expected * found[:, :1]).std(axis=0, ddof=1) / variance / np.sqrt(200)
    judge.near(ratio.mean(axis=0), expected, error, dof=199)
    longer = (plain ** (1 / 1.03**2) - lost) / (1 - lost)
    judge.tells(ratio.mean(axis=0), longer, error, dof=199)
