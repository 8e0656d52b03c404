"""The specular peak: known shapes give known figures."""

import numpy as np
import pytest
from scipy import stats

from microsurf import model
from microsurf.analysis.tradeoff.methods import draws_of
from microsurf.results import detector, peak
from microsurf.scene import Light, Roughness, Scene


def bump(centre, sd):
    """Energies of a Gaussian intensity about a direction in the plane, mirror side positive."""
    theta = np.radians(detector.ring_centres())[:, None]
    phi = np.radians(np.arange(detector.SECTORS) * 10.0 - 180)
    c = np.radians(centre)
    cosine = np.sin(theta) * np.cos(phi) * np.sin(c) + np.cos(theta) * np.cos(c)
    away = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    return (np.exp(-((away / sd) ** 2) / 2) * detector.solid_angles()).ravel()


@pytest.mark.parametrize("centre", [-20.0, 0.0, 41.3])
@pytest.mark.parametrize("sd", [8.0, 14.0])
def test_a_gaussian_keeps_its_figures(centre, sd):
    """Weights a tenth of the width wide, 0.2355 sd, lower a bump by 1/(1+0.2355²).

    Only along θ, by the root of that, where sectors are wider than the weights: 3 % less.
    """
    lobe = 3 * bump(centre, sd)
    smoothing = peak.weight_width(lobe)
    # The width is found with weights of 2°.
    assert smoothing == pytest.approx(0.1 * 2.3548 * np.hypot(sd, 2), rel=0.03)
    height, position, width = peak.figures(peak.cut(lobe, smoothing))
    wider2 = 1 + (smoothing / sd) ** 2
    assert height == pytest.approx(3 / wider2, rel=0.035)
    assert width == pytest.approx(2.3548 * sd * np.sqrt(wider2), rel=0.02)
    assert position == pytest.approx(centre, abs=0.3)


def test_an_even_hemisphere_has_the_same_intensity_everywhere():
    even = np.repeat(detector.solid_angles(), detector.SECTORS, axis=1).ravel()
    for smoothing in (1.0, 5.0):
        np.testing.assert_allclose(peak.cut(even, smoothing), 1, rtol=1e-12)


def test_nothing_and_the_border_give_numbers():
    assert np.isfinite(peak.figures(np.zeros(len(peak.angles())))).all()
    height, position, width = peak.figures(peak.angles() + 90)
    assert (height, position) == (179.5, 89.5)
    assert width == pytest.approx(89.75, abs=0.1)


def test_noise_moves_the_peak_less_than_that_of_its_bins(judge):
    """2000 paths about the normal: the height is known to 15 %; bin by bin it is 40 % high.

    Squares of 40 relative errors over 15 % follow χ², if that is their deviation or less.
    """
    rng = np.random.default_rng(judge.seed(3))
    mean = bump(0.0, 12.0)
    counts = rng.poisson(2000 * mean / mean.sum(), (40, len(mean))) * mean.sum() / 2000
    smoothing = peak.weight_width(mean)
    heights = np.array([peak.figures(peak.cut(c, smoothing))[0] for c in counts])
    truth = peak.figures(peak.cut(mean, smoothing))[0]
    rough = np.array([peak.figures(peak.cut(c, 0.5))[0] for c in counts])
    p_values = [stats.chi2.sf(np.sum((h / truth - 1) ** 2) / 0.15**2, 40) for h in (heights, rough)]
    judge.keeps(p_values[0])
    judge.catches(p_values[1])  # the control: a maximum of noise
    assert np.mean(rough) > np.mean(heights)


def test_a_mirror_s_lobe_peaks_where_it_should():
    """σ = 0.05 at 40°: the lobe's maximum lies within 1° of the mirror direction."""
    scene = Scene(roughness=Roughness(8.0, (0.05,)), light=Light((40.0,)))
    draws = draws_of(model.predict(scene), scene)[40.0, 0.0, 0.8]
    lobe = draws.specular[0]
    figures = peak.figures(peak.cut(lobe, peak.weight_width(lobe)))
    assert figures[1] == pytest.approx(40, abs=1)
    assert draws.albedo.shape == (1, 1)
