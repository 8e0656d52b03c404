import numpy as np
import pytest
from judge import rate

from microsurf.results import detector
from microsurf.stats.intervals import CONFIDENCE
from validation.bench import efficiency

PATHS = 2**17
RUNS = 300


def batches(rng, count, deviation, *bins):
    """Normal batches of bright figures."""
    return 0.5 + deviation * rng.standard_normal((count, *bins))


@pytest.mark.parametrize(("truth", "honest"), [(6.0, True), (9.0, False)])
def test_interval_of_a_figure_holds_the_true_ratio(truth, honest, judge):
    """Three times the variance at twice the speed is an efficiency of 6, and not of 9."""
    rng = np.random.default_rng(judge.seed(1))
    inside = 0
    for _ in range(RUNS):
        ours, theirs = batches(rng, 48, 1e-3), batches(rng, 128, 3**0.5 * 1e-3)
        ratio = efficiency.figure_ratio(ours, theirs, 2.0, PATHS)
        inside += ratio.low <= truth <= ratio.high
    (judge.keeps if honest else judge.catches)(rate(inside, RUNS, CONFIDENCE, 1.0))


@pytest.mark.parametrize(("truth", "honest"), [(6.0, True), (6.6, False)])
def test_interval_of_a_lobes_median_holds_the_true_ratio(truth, honest, monkeypatch, judge):
    """Mirrored bins are equal, as folding makes them: only half of the bins say anything."""
    monkeypatch.setattr(efficiency, "RESAMPLES", 60)
    rng = np.random.default_rng(judge.seed(2))
    inside = 0
    for _ in range(RUNS):
        ours = np.tile(batches(rng, 48, 1e-3, 150), 2)
        theirs = batches(rng, 128, 3**0.5 * 1e-3, 300)
        ratio = efficiency.lobe_ratio(ours, theirs, 2.0, PATHS, rng)
        inside += ratio.low <= truth <= ratio.high
        assert ratio.bins == 300
    (judge.keeps if honest else judge.catches)(rate(inside, RUNS, CONFIDENCE, 1.0))


def test_what_hardly_any_path_reaches_is_not_judged():
    rng = np.random.default_rng(3)
    few = 1e-9 * rng.standard_normal((32, 1))
    for reached, judged in ((0.9, False), (1.1, True)):
        figure = (few + reached * efficiency.BRIGHT / PATHS)[:, 0]
        assert (efficiency.figure_ratio(figure, figure, 1.0, PATHS) is not None) == judged
        bins = few + reached * efficiency.BRIGHT_BIN / PATHS
        assert (efficiency.lobe_ratio(bins, bins, 1.0, PATHS, rng) is not None) == judged


def test_figures_and_lobes_of_a_flux():
    rng = np.random.default_rng(4)
    shape = (3, len(detector.ORDERS), len(detector.KINDS), detector.RINGS, detector.SECTORS)
    flux = rng.random(shape)
    named = dict(zip(efficiency.FIGURES, efficiency.figures(flux).T, strict=True))
    np.testing.assert_allclose(named["total albedo"], flux.sum((1, 2, 3, 4)))
    np.testing.assert_allclose(named["albedo of order 4+"], flux[:, 3].sum((1, 2, 3)))
    np.testing.assert_allclose(named["specular albedo of order 2"], flux[:, 1, 0].sum((1, 2)))
    np.testing.assert_allclose(named["body albedo of order 1"], flux[:, 0, 1].sum((1, 2)))
    body = dict(zip(efficiency.LOBES, efficiency.lobes(flux), strict=True))[efficiency.LOBES[1]]
    assert np.array_equal(body, flux[:, 0, 1].reshape(3, -1))
