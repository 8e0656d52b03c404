import numpy as np
import pytest
from scipy import stats

from microsurf.trace.beam import light_direction, stratified_points


@pytest.mark.parametrize("paths", [1, 2, 3, 1000, 4096, 50_001])
def test_one_point_in_each_stratum_of_a_coherent_curve(paths):
    points = stratified_points(paths, np.random.default_rng(1))
    assert points.shape == (paths, 2)
    assert ((points >= 0) & (points < 1)).all()
    if paths == 4096:  # a power of four: the strata are squares of side 1/64
        cells = (points * 64).astype(int)
        assert len({tuple(c) for c in cells}) == paths
    if paths >= 1000:
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        assert np.median(steps) < 2 / np.sqrt(paths)


def test_uniform(judge):
    """Every point alone is uniform: pooled over seeds."""
    points = np.concatenate(
        [stratified_points(7, np.random.default_rng(judge.seed(s))) for s in range(9000)]
    )
    judge.keeps([stats.kstest(points[:, axis], "uniform").pvalue for axis in range(2)])
    judge.catches(stats.kstest(points[:, 0] ** 1.05, "uniform").pvalue)  # negative control


def test_azimuth_is_counted_from_x():
    np.testing.assert_allclose(light_direction(90, 0), [1, 0, 0], atol=1e-15)
    np.testing.assert_allclose(light_direction(90, 90), [0, 1, 0], atol=1e-15)
    np.testing.assert_allclose(light_direction(0, 33), [0, 0, 1], atol=1e-15)
