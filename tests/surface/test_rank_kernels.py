"""The oracle is numpy's sort, and fixed points: slopes that are kept give the heights again."""

import numpy as np
import pytest
from scipy import stats

from microsurf.physics import student_t
from microsurf.surface import Heightfield, facet_slopes, rank_kernels, synthesis

SHAPES = [(2, 2), (2, 9), (7, 2), (5, 6), (64, 81)]


def standard(shape, seed=1):
    return np.random.default_rng(seed).standard_normal(shape)


def squares(heights, to_x, to_y):
    p, q = facet_slopes(Heightfield(heights))
    return (p * to_x) ** 2 + (q * to_y) ** 2


@pytest.mark.parametrize("shape", SHAPES)
def test_squares_are_those_of_the_facets(shape):
    heights, found = standard(shape), np.empty((2, *shape))
    rank_kernels.fill_squares(heights, 0.5, 3.0, found)
    np.testing.assert_allclose(found, squares(heights, 0.5, 3.0), rtol=1e-14)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("size", [1e-9, 1.0, 1e12])
def test_every_facet_is_in_the_bin_of_its_square(shape, size):
    heights = size * standard(shape)
    bins, ranks = synthesis._histogram(heights, 0.5, 3.0)
    # The kernel's own squares: one may lie on an edge.
    rho2 = np.empty((2, *shape))
    rank_kernels.fill_squares(heights, 0.5, 3.0, rho2)
    edges = rank_kernels.lower_edges(np.append(bins, bins[-1] + 1))
    assert np.all(np.diff(edges) > 0)
    below = np.searchsorted(np.sort(1 + rho2, axis=None), 1 + edges)
    np.testing.assert_array_equal(ranks, below)


def test_bins_are_as_wide_as_documented():
    edges = rank_kernels.lower_edges(np.arange(5 * 8192))
    assert edges[[0, 1, 8192, 16384]] == pytest.approx([0.0, 2.0**-13, 1.0, 3.0], abs=0)
    assert [rank_kernels.bins_up_to(e) for e in edges[[0, 1, 8192]]] == [1, 2, 8193]


def kept(heights, to_x, to_y, factor=1.0):
    """Targets that multiply every slope by the same factor."""
    bins = rank_kernels.bins_up_to(squares(heights, to_x, to_y).max()) + 1
    edges = factor**2 * rank_kernels.lower_edges(np.arange(bins + 1))
    return np.column_stack([edges[:-1], np.diff(edges) / rank_kernels.INSIDE])


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize(("to_x", "to_y"), [(1.0, 1.0), (0.2, 5.0)])
def test_slopes_that_are_kept_give_the_heights_again(shape, to_x, to_y):
    heights = standard(shape)
    expected = heights - heights.mean()
    # Rounding of 1 + ρ² is 1e-16, of factors of facets with ρ² of 1e-4 some 1e-12.
    found = synthesis._project(heights, to_x, to_y, kept(heights, to_x, to_y))
    np.testing.assert_allclose(found, expected, atol=1e-10)
    # Negative control, and their size: slopes twice as long.
    doubled = synthesis._project(heights, to_x, to_y, kept(heights, to_x, to_y, 2.0))
    assert np.abs(doubled - expected).max() > 0.1
    np.testing.assert_allclose(doubled, 2 * expected, atol=1e-10)


def test_projection_is_the_least_squares_solution():
    """Facet slopes are rescaled as they please; lstsq of all differences is the oracle."""
    rows, columns, to_x, to_y = 4, 5, 0.7, 1 / 0.7
    heights = standard((rows, columns))
    targets = np.zeros((rank_kernels.bins_up_to(squares(heights, to_x, to_y).max()), 2))
    targets[:, 0] = standard(len(targets), 2) ** 2  # another length in each bin
    p, q = facet_slopes(Heightfield(heights))
    rho2 = squares(heights, to_x, to_y)
    bins = [rank_kernels.bins_up_to(r) - 1 for r in rho2.ravel()]
    factor = np.sqrt(targets[bins, 0].reshape(rho2.shape) / rho2)
    wanted = np.concatenate([(p * to_x * factor).ravel(), (q * to_y * factor).ravel()])
    basis = []
    for unit in np.eye(heights.size):
        p, q = facet_slopes(Heightfield(unit.reshape(rows, columns)))
        basis.append(np.concatenate([(p * to_x).ravel(), (q * to_y).ravel()]))
    expected = np.linalg.lstsq(np.transpose(basis), wanted)[0].reshape(rows, columns)
    found = synthesis._project(heights, to_x, to_y, targets)
    np.testing.assert_allclose(found, expected - expected.mean(), atol=1e-12)


@pytest.mark.parametrize("gamma", [1.6, 2.0, np.inf])
def test_facets_get_the_quantiles_of_their_ranks(gamma):
    """Off by less than the facets of their bin, and nothing where a bin holds one alone."""
    heights = 0.7 * standard((96, 100))
    rho2 = np.sort(squares(heights, 1.0, 1.0), axis=None)
    bins, ranks = synthesis._histogram(heights, 1.0, 1.0)
    targets = synthesis._targets(bins, ranks, gamma)
    place = (1.0 + rho2).view(np.int64) - (1023 << 52)
    k, inside = place // rank_kernels.INSIDE, place % rank_kernels.INSIDE
    found = targets[k, 0] + targets[k, 1] * inside
    exact = student_t.slope_quantile((np.arange(rho2.size) + 0.5) / rho2.size, gamma) ** 2
    held = np.diff(ranks)[np.searchsorted(bins, k)]
    assert np.count_nonzero(held == 1) > 100
    np.testing.assert_allclose(found[held == 1], exact[held == 1], rtol=1e-12)
    got = student_t.slope_cdf(np.sqrt(found), gamma) * rho2.size
    assert np.all(np.abs(got - np.arange(rho2.size) - 0.5) < held)
    assert np.all(np.diff(found) >= 0)
    law = stats.expon() if np.isinf(gamma) else stats.f(2, 2 * gamma - 2)
    assert stats.kstest(found, law.cdf).statistic < 4 * held.max() / rho2.size
    # Negative control: before.
    assert stats.kstest(rho2, law.cdf).statistic > 0.05


def test_a_level_facet_stays_as_it_is():
    heights = np.zeros((6, 8))
    heights[3, 4] = 1.0
    bins, ranks = synthesis._histogram(heights, 1.0, 1.0)
    found = synthesis._project(heights, 1.0, 1.0, synthesis._targets(bins, ranks, 2.0))
    assert np.isfinite(found).all()
    assert found.argmax() == 3 * 8 + 4
