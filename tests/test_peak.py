"""The specular peak: known shapes give known figures."""

import numpy as np
import pytest

from microsurf import model, peak
from microsurf.rungs import draws_of
from microsurf.scene import Light, Roughness, Scene


def gaussian(centre, sd):
    return np.exp(-(((peak.angles() - centre) / sd) ** 2) / 2)


@pytest.mark.parametrize("centre", [-20.0, 0.0, 41.3, 60.0])
@pytest.mark.parametrize("sd", [4.0, 12.0])
def test_a_gaussian_keeps_its_figures(centre, sd):
    """Smoothing by a tenth of the width, 2.355 sd, lowers it by √(1+0.2355²) and widens it so."""
    values = 3 * gaussian(centre, sd)
    smooth = peak.smoothing(values)
    # Found on a cut smoothed by one ring, 2°.
    assert smooth == pytest.approx(0.1 * 2.3548 * np.hypot(sd, 2) / 2, rel=0.03)
    height, position, width = peak.figures(values, smooth)
    wider = np.hypot(1, 2 * smooth / sd)
    if abs(centre) + 3 * sd < 90:
        assert height == pytest.approx(3 / wider, rel=0.01)
        assert width == pytest.approx(2.3548 * sd * wider, rel=0.02)
        assert position == pytest.approx(centre, abs=0.1)


def test_nothing_and_the_border_give_numbers():
    assert np.isfinite(peak.figures(np.zeros(len(peak.angles())), 1.0)).all()
    height, position, width = peak.figures(peak.angles() + 90, 0.0)
    assert (height, position) == (179.5, 89.5)
    assert width == pytest.approx(89.75, abs=0.1)


def test_a_mirror_s_lobe_peaks_where_it_should():
    """σ = 0.05 at 40°: the lobe's maximum lies within 1° of the mirror direction."""
    scene = Scene(roughness=Roughness(8.0, (0.05,)), light=Light((40.0,)))
    draws = draws_of(model.predict(scene), scene)[40.0, 0.0, 0.8]
    figures = peak.figures(draws.cut[0], peak.smoothing(draws.cut[0]))
    assert figures[1] == pytest.approx(40, abs=1)
    assert draws.albedo.shape == (1, 1)
