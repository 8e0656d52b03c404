"""The tabulated body term against the integral it stands for."""

import numpy as np

from microsurf.model import direction
from microsurf.model.lookup import body_ratio
from microsurf.model.lookup.pair_table import tabulate
from microsurf.model.single_scattering.brdf import body
from microsurf.model.single_scattering.facets import Facets


def pairs(count, seed=0):
    rng = np.random.default_rng(seed)
    theta = np.arcsin(np.sqrt(rng.uniform(0, 0.99, (2, count))))
    return direction(theta, rng.uniform(0, 2 * np.pi, (2, count)))


def test_it_is_the_integral_to_a_thousandth():
    facets = Facets(1.5, 2.0, 0.5, 0.5)
    i, o = pairs(300)
    off = np.abs(body_ratio.tabulated_body(facets).evaluate(i, o) / body(facets, i, o) - 1)
    assert np.median(off) < 5e-4  # 2e-4 and 1.1e-3 on 3000 pairs
    assert np.quantile(off, 0.99) < 3e-3


def test_a_table_folds_directions_as_its_facets_do():
    """A function of both mirrors' symmetry, smooth between its nodes."""

    def seen(i, o):
        return np.stack([(i[:, 0] * o[:, 0]) ** 2, i[:, 1] * o[:, 1]], axis=1)

    i, o = pairs(500)
    o[:, :2] = np.abs(o[:, :2]) * np.where(i[:, :2] < 0, -1, 1)
    table = tabulate(seen, isotropic=False, polar=24, turns=25, azimuths=13)
    assert np.allclose(table.at(i, o), seen(i, o), atol=0.02)
    isotropic = tabulate(lambda i, o: np.sum(i * o, axis=1), isotropic=True, polar=24, turns=25)
    i, o = pairs(500, 1)
    assert np.allclose(isotropic.at(i, o), np.sum(i * o, axis=1), atol=0.01)
