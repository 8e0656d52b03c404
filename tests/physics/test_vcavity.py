"""V-cavity masking against Torrance and Sparrow's form and the area it must conserve."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from microsurf.physics import student_t, vcavity

EPS = np.finfo(float).eps


def direction(theta, phi=0.0):
    """Return the unit vectors at θ and φ in degrees."""
    theta, phi = np.radians(theta), np.radians(phi)
    return np.stack(
        np.broadcast_arrays(
            np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)
        ),
        axis=-1,
    )


directions = st.tuples(st.floats(0, 89.99999), st.floats(0, 360)).map(lambda a: direction(*a))


@given(directions, directions)
def test_half_vector_gives_torrance_and_sparrow(i, o):
    """With m halfway, i·m = o·m and G = min(1, 2(n·m)(n·o)/(o·m), 2(n·m)(n·i)/(o·m))."""
    m = (i + o) / np.linalg.norm(i + o)
    cosine = np.sum(o * m)
    expected = min(1, 2 * m[2] * o[2] / cosine, 2 * m[2] * i[2] / cosine)
    # o·m carries 4 roundings of numbers up to 1.
    assert float(vcavity.g2(i, o, m)) == pytest.approx(expected, rel=16 * EPS / cosine)
    assert vcavity.g2(i, o, m) == vcavity.g2(o, i, m)


def test_symmetric_vcavity():
    """One wall of a V-cavity at slope tanα, seen from θ in its plane: what the other leaves free.

    Nothing is hidden up to tanθ = cotα; beyond, the visible part of the wall
    ends where the ray over the opposite rim meets it.
    """
    for alpha in (20.0, 45.0, 70.0):
        slope = np.tan(np.radians(alpha))
        m = direction(alpha)
        for theta in (0.0, 15.0, 40.0, 65.0, 85.0):
            tangent = np.tan(np.radians(theta))
            # Groove |x| ≤ 1, z = slope (|x| − 1); the wall x < 0 has its normal towards +x.
            # The ray over the rim (1, 0) meets z = −slope (x + 1) at x = −visible:
            # (1 − x) / tanθ = slope (1 + x)
            if tangent * slope <= 1:
                visible = 1.0
            else:
                x = (1 - slope * tangent) / (1 + slope * tangent)
                visible = x + 1
            value = float(vcavity.g1(direction(theta), m))
            assert value == pytest.approx(visible, rel=1e-13), (alpha, theta)


def test_facets_that_turn_away_are_dark():
    w = direction(60)
    assert vcavity.g1(w, direction(40, 180)) == 0  # w·m < 0
    assert vcavity.g1(-w, direction(10)) == 0
    assert vcavity.g1(w, -direction(10)) == 0
    assert vcavity.g1([1.0, 0.0, 0.0], direction(10)) == 0
    assert vcavity.g2(w, direction(60, 180), direction(40, 180)) == 0


@given(directions, directions)
def test_is_a_fraction(w, m):
    assert 0 <= vcavity.g1(w, m) <= 1


@pytest.mark.parametrize("gamma", [1.75, 2.0, 8.0, np.inf])
@pytest.mark.parametrize("theta", [0.0, 30.0, 75.0])
def test_masking_conserves_projected_area(gamma, theta):
    """∫ G1 ⟨w, m⟩ D dm = cosθ (Heitz 2014), which this structure obeys cavity by cavity.

    Over half the azimuths (the other half is its mirror image) and panels in ln
    slope. The kinks where masking begins cost some 1e−5.
    """
    w = direction(theta)
    phi = np.pi * (np.arange(720) + 0.5) / 720
    x, weights = np.polynomial.legendre.leggauss(6)
    edges = np.linspace(-12, 45, 121)
    half = np.diff(edges)[:, None] / 2
    r = np.exp(edges[:-1, None] + half * (1 + x)).ravel()[:, None]
    m = student_t.normals(r * np.cos(phi), r * np.sin(phi))
    facing = np.maximum(m @ w, 0) / m[..., 2]
    ring = np.mean(vcavity.g1(w, m) * facing, axis=1) * 2 * np.pi
    density = student_t.slope_density(r[:, 0], 0.0, gamma, 0.5)
    total = np.sum((half * weights).ravel() * r[:, 0] ** 2 * density * ring)
    assert total == pytest.approx(w[2], rel=5e-5)


def test_arrays_broadcast():
    m = direction(np.linspace(0, 80, 5))
    assert vcavity.g1(direction(30), m).shape == (5,)
    assert vcavity.g2(direction(30), direction(10)[None, None], m).shape == (1, 5)
