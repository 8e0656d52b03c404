"""The compiled Fresnel terms are those of `physics.fresnel`, which are tested against mpmath."""

from typing import NamedTuple

import numpy as np
import pytest

from microsurf.physics import fresnel, fresnel_kernels


class Facet(NamedTuple):
    """What a kernel asks of a facet."""

    n: float
    k: float


MU = np.geomspace(1e-9, 1, 200)


@pytest.mark.parametrize("n", [1 + 1e-9, 1.33, 1.5, 2.4, 4.0, 100.0])
def test_dielectrics(n):
    # Brewster's zero of r_p is where rounding shows most, but there r_s is larger.
    kernel = [fresnel_kernels.reflected(mu, Facet(n, 0.0)) for mu in MU]
    np.testing.assert_allclose(kernel, fresnel.reflectance(MU, n), rtol=1e-13)
    expected = fresnel.transmittance(MU, n)
    for kernel in (
        [fresnel_kernels.transmittance(mu, n) for mu in MU],
        [fresnel_kernels.passed(mu, Facet(n, 0.0)) for mu in MU],
    ):
        np.testing.assert_allclose(kernel, expected, rtol=1e-14)


@pytest.mark.parametrize(
    ("n", "k"), [(0.21, 3.272), (1.02, 2.577), (1.366, 7.4052), (0.5, 1e-3), (100.0, 100.0)]
)
def test_conductors(n, k):
    kernel = [fresnel_kernels.reflected(mu, Facet(n, k)) for mu in MU]
    np.testing.assert_allclose(kernel, fresnel.reflectance(MU, n, k), rtol=1e-12)
    kernel = [fresnel_kernels.passed(mu, Facet(n, k)) for mu in MU]
    np.testing.assert_allclose(kernel, fresnel.transmittance(MU, n, k), rtol=1e-13)
