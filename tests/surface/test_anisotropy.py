"""Slopes with a direction are distinguished from isotropic ones, along the axes or not."""

import numpy as np
import pytest
from judge import rate
from scipy import ndimage

from microsurf.surface import Heightfield, facet_slopes, fit_std, generate_surface
from microsurf.surface.anisotropy import anisotropy_of


def of(h, gamma=2.0):
    return anisotropy_of(*facet_slopes(h), 1 / (gamma - 1))


@pytest.mark.parametrize("gamma", [1.75, 2.0, 8.0, np.inf])
@pytest.mark.parametrize("ratio", [1.5, 5.0])
def test_ratio_and_azimuth_of_what_was_generated(gamma, ratio):
    """Both σ within 2 % of their targets on 256²; steep along y."""
    found = of(generate_surface(gamma, 0.1, 0.1 * ratio, cells=256, seed=4), gamma)
    assert found.directed
    assert found.ratio == pytest.approx(ratio, rel=0.04)
    assert found.azimuth == pytest.approx(90, abs=3)


@pytest.mark.parametrize("turned", [30.0, 135.0])
def test_a_lay_between_the_axes(turned):
    """A relief turned by an angle has its steep axis turned by it: x′ = x cos − y sin."""
    h = generate_surface(2.0, 0.5, 0.1, cells=256, seed=4)
    heights = ndimage.rotate(h.heights, -turned, reshape=False, mode="grid-wrap")[64:192, 64:192]
    found = of(Heightfield(heights, boundary="mirror"))
    assert found.directed
    assert found.azimuth == pytest.approx(turned, abs=5)
    assert found.ratio > 3


def test_a_fit_of_a_lay_says_so():
    """The fit's own γ is wrong then; the ratio holds within a tenth."""
    fit = fit_std(generate_surface(2.0, 0.1, 0.5, cells=128, seed=4))
    assert fit.anisotropy.directed
    assert fit.anisotropy.ratio == pytest.approx(5, rel=0.1)


def test_slopes_in_one_line_have_a_direction():
    heights = np.sin(np.arange(64) * np.pi / 8) + np.zeros((64, 1))
    found = of(Heightfield(heights))
    assert found.directed
    assert found.ratio > 1e3
    assert found.azimuth == pytest.approx(0, abs=1e-6)


def test_isotropic_slopes_are_not_said_to_have_a_direction(judge):
    """p < 0.05 as often as it says or less often: the larger of two p-values counts."""
    found = [
        of(generate_surface(2.0, 0.5, cells=128, correlation=5, seed=judge.seed(s), iterations=3))
        for s in range(100)
    ]
    low = sum(f.p_value < 0.05 for f in found)
    judge.keeps(rate(100 - low, 100, 0.9))
    assert sum(f.directed for f in found) <= 2
    lays = [
        of(generate_surface(2.0, 0.4, 0.6, cells=128, correlation=5, seed=s, iterations=3))
        for s in range(20)
    ]
    assert sum(f.directed for f in lays) >= 18  # negative control


def test_rotation_by_a_right_angle_turns_the_azimuth():
    h = generate_surface(2.0, 0.3, 0.5, cells=128, seed=7)
    turned = Heightfield(h.heights.T)
    assert of(turned).ratio == pytest.approx(of(h).ratio, rel=1e-6)
    assert (of(turned).azimuth + of(h).azimuth) % 180 == pytest.approx(90, abs=1e-4)
