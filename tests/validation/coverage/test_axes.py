import numpy as np
import pytest

from microsurf.surface.heightfield import slopes_of_both_splits
from validation.coverage import axes


def test_counts_of_a_table():
    """Either axis may be the one nearer to x; a lay that is not noticed is not held."""
    drawn = [
        {"azimuth": 45.0, "fitted": [-44.0, -46.0, -42.0], "ratio": 2.0},
        {"azimuth": 45.0, "fitted": [42.0, 41.0, 43.0], "ratio": 2.0},
        {"azimuth": 45.0, "fitted": None, "ratio": 1.0},
    ]
    drawn += [{"azimuth": a, "fitted": [a, a - 1, a + 1], "ratio": 2.0} for a in (0.0, 17.0)] * 2
    table = {row["azimuth"]: row for row in axes.rows(drawn)}
    row = table[45.0]
    assert (row["surfaces"], row["lay_noticed"], row["held"]) == (3, 2, 1)
    assert row["bias"] == pytest.approx(-1)
    assert table[17.0]["held"] == 2


def test_axes_of_small_cut_outs():
    fitted = axes.fits(0, 96)
    assert len(fitted) == axes.ACROSS**2 * len(axes.AZIMUTHS)
    off = [(row["fitted"][0] - row["azimuth"] + 45) % 90 - 45 for row in fitted if row["fitted"]]
    assert len(off) == len(fitted)
    assert np.abs(off).max() < 20  # five times the interval of such a map


def test_facets_lean_towards_the_grid():
    """Against the mean squares of many facets; without effect along an axis or between two."""
    for azimuth in (0.0, 45.0):
        assert axes.facet_azimuth((3.0, 6.0), azimuth) == pytest.approx(azimuth, abs=1e-9)
    expected = axes.facet_azimuth((3.0, 6.0), 17.0)
    rng = np.random.default_rng(5)
    values = []
    for _ in range(12):
        p, q, _ = slopes_of_both_splits(axes.turned(192, (3.0, 6.0), 17.0, rng))
        double = np.arctan2(2 * np.mean(p * q), np.mean(p * p) - np.mean(q * q))
        values.append(np.degrees(double) / 2)
    error = np.std(values, ddof=1) / np.sqrt(len(values))
    assert abs(np.mean(values) - expected) < 4.4 * error  # t of 11: 1 in 1000
    assert error < abs(expected - 17) / 4  # negative control: 17° itself is told apart
