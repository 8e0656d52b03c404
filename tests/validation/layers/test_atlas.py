"""What the atlas of the IL assumption makes of traces, with differences planted in them."""

import numpy as np
import pytest

from microsurf.results import detector
from validation.layers import atlas, cases, figures, limits, measures, text
from validation.layers.independent import parts

BINS = len(cases.projected_solid_angles())


def test_coarse_bins_hold_all_light_and_both_sides_of_the_plane():
    rng = np.random.default_rng(1)
    bins = rng.random((2, detector.RINGS, detector.SECTORS))
    coarse = cases.coarse(bins)
    assert coarse.shape == (2, 6, 6)
    np.testing.assert_allclose(coarse.sum((1, 2)), bins.sum((1, 2)), rtol=1e-12)
    # The same light turned over in the plane of incidence.
    mirrored = np.roll(bins[..., ::-1], 1, axis=-1)
    np.testing.assert_allclose(cases.coarse(mirrored), coarse, rtol=1e-12)
    assert not np.allclose(cases.coarse(np.roll(bins, 6, axis=-1)), coarse)
    assert cases.projected_solid_angles().sum() == pytest.approx(np.pi)


def test_paired_differences_lose_what_both_share(judge):
    """Interfaces scatter by 20 %, the planted 2 % is known to a tenth of that."""
    rng = np.random.default_rng(judge.seed(1))
    others = 1 + 0.2 * rng.standard_normal(8)
    ones = 1.02 * others + 0.004 * rng.standard_normal(8)
    percent, error = measures.relative(ones, others)
    assert error < 0.4
    judge.near(percent, 2.0, error, dof=7)
    judge.tells(percent, 0.0, error, dof=7)


def lobes(change, noise, rng):
    """Lambertian light in eight realisations, and the same changed along θ_o."""
    flat = cases.projected_solid_angles() / np.pi
    tilt = np.repeat([1, 1, 1, -1, -1, -1], 6) * change
    scatter = noise * flat * rng.standard_normal((2, 8, BINS))
    return flat * (1 + tilt) + scatter[0], flat + scatter[1]


def test_a_lobe_that_differs_is_told_from_noise(judge):
    """Planted: 5 % up and down. Noise alone, as large as that in each realisation, is none."""
    rng = np.random.default_rng(judge.seed(2))
    value, low, high = measures.lobe_distance(*lobes(0.05, 0.02, rng))
    assert low < 5 < high
    assert value == pytest.approx(5, abs=1)
    assert low > 2.5
    value, low, high = measures.lobe_distance(*lobes(0.0, 0.02, rng))
    assert low == 0
    assert high < 3


def test_a_theory_is_not_paired_with_surfaces(judge):
    """The scatter of both counts; surfaces that scatter alike are no help."""
    others = np.array([0.9, 1.0, 1.1])
    percent, error = measures.relative(1.1 * others, others, paired=False)
    assert percent == pytest.approx(10)
    assert error == pytest.approx(100 * 1.1 * np.sqrt(2 * 0.01 / 3))
    assert measures.relative(1.1 * others, others)[1] < 1e-10
    rng = np.random.default_rng(judge.seed(5))
    value, low, high = measures.lobe_distance(*lobes(0.05, 0.02, rng), paired=False)
    assert (value, low > 2.5, high < 8) == (pytest.approx(5, abs=1), True, True)
    _, low, high = measures.lobe_distance(*lobes(0.0, 0.02, rng), paired=False)
    assert low == 0
    assert high < 3


def rows(total=1.0, se=0.1, lobe=4.0):
    base = {
        "gamma": 8.0, "sigma": 0.5, "n": 1.5, "substrate_over_interface": 1.0,
        "correlation": 1.0, "gap_over_length": 0.1, "kd": 0.8,
    }  # fmt: skip
    return [
        base | {"theta_i": 0.0, "total_percent": 0.2, "total_se": 0.1, "lobe_percent": 1.0,
                "lobe_low": 0.0, "lobe_high": 2.0},
        base | {"theta_i": 80.0, "total_percent": -total, "total_se": se, "lobe_percent": lobe,
                "lobe_low": lobe - 1, "lobe_high": lobe + 1},
    ]  # fmt: skip


def test_the_worst_angle_stands_with_its_interval():
    (worst,) = atlas.worst_rows(rows())
    assert worst["total"] == 1.0
    assert worst["total_high"] == pytest.approx(1 + 2.3646 * 0.1, rel=1e-4)
    assert worst["total_low"] == pytest.approx(1 - 2.3646 * 0.1, rel=1e-4)
    assert (worst["lobe"], worst["lobe_high"]) == (4.0, 5.0)
    # An angle of which less is known is worse than one that is farther off.
    (worst,) = atlas.worst_rows(rows(total=0.1, se=1.0))
    assert worst["total"] == 0.1
    assert worst["total_low"] == 0.0


def test_surfaces_that_would_cross_are_left_out(tmp_path, monkeypatch):
    monkeypatch.setattr(cases, "KEPT", tmp_path)
    monkeypatch.setattr(cases, "REALISATIONS", 2)
    same, flat = cases.Pair(8.0, 0.5, 1.0, 1.0), cases.Pair(8.0, 0.5, 0.0, 0.0)
    assert all(cases.possible(same, gap) for gap in cases.GAPS)
    assert not cases.possible(flat, 0.1)
    assert cases.possible(flat, 10.0)
    (tmp_path / "pair-8-0.5-0-0.json").write_text('{"needed_gap": [0.1, 11.0]}')
    assert not cases.possible(flat, 10.0)  # of one realisation


def test_a_power_fit_is_fitted_with_an_interval_that_holds_it(judge):
    """Planted: 0.3 x; negative control: the order 2."""
    rng = np.random.default_rng(judge.seed(3))
    gaps = np.array(limits.THIN_GAPS)[:, None]
    facets = 0.2 * (1 + 0.1 * rng.standard_normal(8))
    layers = facets * (1 + 0.3 * gaps) * (1 + 0.001 * rng.standard_normal((len(gaps), 8)))
    law = limits.power_fit(layers, facets)
    exponent = law["exponent"], law["exponent_half"] / 2.3646
    judge.near(exponent[0], 1.0, exponent[1], dof=7)
    judge.tells(exponent[0], 2.0, exponent[1], dof=7)
    judge.near(law["coefficient"], 0.3, law["coefficient_half"] / 2.3646, dof=7)
    assert not limits.power_fit(np.broadcast_to(facets, layers.shape), facets)["fitted"]


def test_figures_and_pages_are_made_of_rows(tmp_path, monkeypatch):
    monkeypatch.setattr(cases, "KEPT", tmp_path)
    monkeypatch.setattr(cases, "PAIRS", ())
    worst = list(atlas.worst_rows(rows()))
    figure = figures.atlas(worst, 1.5, 0.8, 0.5, (8.0,))
    drawn = [t.get_text() for panel in figure.axes for t in panel.texts]
    assert drawn == ["1.0", "4.0"]
    table = list(text._table(worst, "lobe"))
    assert table[-1].startswith("| equal, ρ = 1 | – | – | 4.0 ± 1.0 |")


def test_both_theories_stand_beside_each_other():
    far = {"correlation": 0.0, "gap_over_length": 30.0}
    worst = [
        {"theory": theory} | row
        for theory, total in (("il", 5.0), ("layered-walk", 0.4))
        for row in atlas.worst_rows([row | far for row in rows(total=total)])
    ]
    figure = figures.layering(worst, 0.8, 0.5)
    titles = [panel.get_title() for panel in figure.axes[:4]]
    assert [title.split(",")[0] for title in titles] == ["IL", "layered walk"] * 2
    drawn = [[t.get_text() for t in panel.texts] for panel in figure.axes[:4]]
    assert drawn == [["5.0"], ["0.4"], [], []]
    lines = text.layering(worst, 0.8).splitlines()
    assert "| equal | 1.5 | IL | – | – | – | – | 5.0 ± 0.2 |" in lines
    assert "| equal | 1.5 | layered walk | – | – | – | – | 0.4 ± 0.2 |" in lines


def test_a_part_of_the_limit_that_is_walked_is_worth_its_change():
    """Planted: K 1 % less, by its derivative; parts that agree are worth nothing."""
    shape = (4, 3)
    traced = parts.Parts(
        np.full(shape, 0.05), np.full((4, 1), 0.06), np.full((4, 1), 0.8), np.full(shape, 0.6)
    )
    walked = traced._replace(substrate=0.99 * traced.substrate[:1])
    worth = parts.off_by_part(traced, walked)
    assert worth["reflected"] == pytest.approx(np.zeros(3), abs=1e-12)
    assert worth["diffuse"] == pytest.approx(np.zeros(3), abs=1e-12)
    expected = walked.limit[0] / traced.limit[0] - 1
    assert worth["substrate"] == pytest.approx(100 * expected)
    assert (worth["substrate"] < -1).all()
