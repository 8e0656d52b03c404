"""What spares a fit work must not change it: the table of masking, and light computed before."""

from dataclasses import replace

import numpy as np
import pytest
from made import directions, measured

from microsurf.analysis.brdf_fit import aperture, masking_table
from microsurf.analysis.brdf_fit.materials import MATERIALS, lobes
from microsurf.analysis.brdf_fit.parameters import Layout
from microsurf.analysis.brdf_fit.problem import problem_of
from microsurf.analysis.brdf_fit.recent import Recent
from microsurf.physics import smith


def cones(steepest):
    theta = np.linspace(0, steepest, 160)
    o = np.stack([np.sin(theta), np.zeros(160), np.cos(theta)], axis=1)
    cone = aperture.cone(o, 8.0)
    cone = np.concatenate([cone.reshape(-1, 3), [[0.0, 0, 1], [1e-7, 0, 1], [1, 0, 1e-9]]])
    return cone[cone[:, 2] > 0]


@pytest.mark.parametrize("sigmas", [(1e-3, 1e-3), (0.3, 0.3), (0.1, 0.7), (5.0, 5.0)])
@pytest.mark.parametrize("gamma", [1.51, 2.5, 40.0, np.inf])
def test_the_table_of_masking_is_the_formula(gamma, sigmas):
    o = cones(np.radians(89))
    table = masking_table.g1(o, gamma, *sigmas)
    np.testing.assert_allclose(table, smith.g1(o, gamma, *sigmas), rtol=3e-9)


def test_many_directions_take_the_table_and_few_the_formula():
    o, i = cones(1.5), np.array([[0.6, 0.0, 0.8]])
    exact = smith.g2_height_correlated(i, o, 2.5, 0.3, 0.3)
    table = masking_table.g2(i, o, 2.5, 0.3, 0.3)
    np.testing.assert_allclose(table, exact, rtol=3e-9)
    assert not np.array_equal(table, exact)
    assert np.array_equal(masking_table.g2(i, o[:100], 2.5, 0.3, 0.3), exact[:100])


@pytest.mark.parametrize("isotropic", [True, False])
@pytest.mark.parametrize("material", MATERIALS.values(), ids=MATERIALS)
def test_light_computed_before_is_that_of_the_pairs_and_parameters_asked(material, isotropic):
    """After other slopes, other indices and a choice of pairs, the bits of a new problem."""
    angles = directions(5, 8, azimuths=(0.0, 0.7))
    brdf = measured(angles, np.ones((80, 1)))
    problem = problem_of(brdf, isotropic=isotropic, cone=aperture.cone(brdf.detector, 3.0))
    layout = Layout(material.optics, None, isotropic)
    start = np.clip(0.4, *layout.bounds) * np.ones(len(layout.names))
    start[0] = np.log(0.3)
    moved = [start + 0.01 * row for row in np.eye(len(start))]
    rows = np.arange(80) % 3 > 0

    def computed(problem, vector):
        return [part for part in lobes(problem, material, layout, vector) if part is not None]

    for vector in [start, *moved, start, *moved]:
        fresh = computed(replace(problem, recent=Recent()), vector)
        assert all(map(np.array_equal, computed(problem, vector), fresh))
        some = problem.select(rows)
        assert all(map(np.array_equal, computed(some, vector), [part[rows] for part in fresh]))


def test_only_the_last_values_are_kept():
    recent, counted = Recent(), []

    def computed(key):
        return recent.get(key, lambda: counted.append(key) or key)

    for key in (1, 2, 3, 4, 5, 6, 1, 7, 2, 1):
        computed(key)
    assert counted == [1, 2, 3, 4, 5, 6, 7, 2]
