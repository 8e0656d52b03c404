import pytest
from scipy import stats

from microsurf.report.figures import masking


def row(theta, low, high, g1=0.5, g2=0.25):
    numbers = {"g1": g1, "g2": g2, "g1_se": 0.01, "g2_se": 0.02, "g1_smith": 0.6, "g2_smith": 0.3}
    return {"theta_i": theta, "rho_low": low, "rho_high": high} | numbers


def found(*thetas):
    return [row(t, *ends) for t in thetas for ends in ((0.0, 1.0), (1.0, 2.0), (2.0, None))]


@pytest.mark.parametrize(
    ("surfaces", "factor"), [(8, stats.t.ppf(0.975, 7)), (1, stats.norm.ppf(0.975))]
)
def test_rows_have_their_intervals(surfaces, factor):
    made = masking.rows(found(60.0), surfaces)[0]
    assert made["g1_high"] - made["g1"] == pytest.approx(0.01 * factor)
    assert made["g2"] - made["g2_low"] == pytest.approx(0.02 * factor)


@pytest.mark.parametrize("thetas", [(0.0,), (0.0, 60.0, 80.0)])
def test_figure_has_a_panel_for_each_angle_and_both_of_both(thetas):
    made = masking.figure(masking.rows(found(*thetas), 8))
    panels = [axes for axes in made.axes if axes.get_visible()]
    assert [axes.get_title() for axes in panels] == [rf"$\theta_i$ = {t:g}°" for t in thetas]
    for axes in panels:
        assert [list(c.lines[0].get_ydata()) for c in axes.containers] == [[0.5] * 3, [0.25] * 3]
        assert [list(p.get_data().values) for p in axes.patches] == [[0.6] * 3, [0.3] * 3]
        assert axes.get_xlabel() if axes is panels[-1] else True
    made.draw_without_rendering()
