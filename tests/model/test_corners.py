"""All models over the whole box: finite, never negative, reciprocal where they are exact."""

import numpy as np
import pytest
from brute import direction
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from microsurf import model
from microsurf.scene import Material, Roughness, Scene


def logarithmic(low, high):
    return st.floats(np.log(low), np.log(high)).map(lambda x: float(np.clip(np.exp(x), low, high)))


gammas = st.one_of(logarithmic(1e-3, 1e9).map(lambda x: min(1.5 + x, 1e9)), st.just(2.0))
sigmas = logarithmic(1e-4, 10)
indices = st.one_of(logarithmic(1e-9, 99).map(lambda x: 1 + x), st.just(1.0))
thetas = st.one_of(logarithmic(1e-5, 90).map(lambda x: 90 - x), st.just(0.0))
materials = st.one_of(
    st.builds(lambda n, kd: Material(n, (kd,)), indices, st.floats(0, 1)),
    st.builds(lambda n, k: Material(n, k=k), logarithmic(1e-3, 100), logarithmic(1e-3, 100)),
)


@st.composite
def corners(draw):
    two = draw(st.booleans())
    sigma = (draw(sigmas), draw(sigmas)) if two else (draw(sigmas),)
    asked = Scene(material=draw(materials), roughness=Roughness(draw(gammas), sigma))
    i = direction(draw(thetas), draw(st.floats(0, 360)))
    o = direction(draw(thetas), draw(st.floats(0, 360)))
    return asked, i, o


SEARCH = settings(max_examples=100, suppress_health_check=[HealthCheck.too_slow])


@pytest.mark.parametrize("name", model.order_one())
@SEARCH
@given(corners())
def test_order_one(name, corner):
    asked, i, o = corner
    for part in (there := model.evaluate(asked, i, o, name)):
        assert np.isfinite(part)
        assert part >= 0
    back = model.evaluate(asked, o, i, name)
    # The mirror term has no quadrature: 1e−12 of it, and of what D's exponent makes of
    # a rounding in h, which is not the same sum both ways round.
    gamma = asked.roughness.gamma
    steep = np.log(max(there[0], 1e-300)) if there[0] > 0 else 0.0
    allowed = 1e-12 * (1 + abs(steep)) * (1 if gamma < 1e3 else 10)
    assert abs(there[0] - back[0]) <= allowed * max(there[0], back[0]) + 1e-300
    if name in ("flat", "approximate"):
        assert there[1] == pytest.approx(back[1], rel=1e-12)


@pytest.mark.parametrize("name", model.all_orders())
@SEARCH
@given(corners())
def test_walks(name, corner):
    asked, i, o = corner
    f, se = model.evaluate_walk(asked, i, o, name, 2, np.random.default_rng(0), (1, 50))
    for value in (*f, *se):
        assert np.isfinite(value)
        assert value >= 0


@pytest.mark.parametrize("name", [*model.order_one(), *model.all_orders()])
@SEARCH
@given(corners())
def test_densities_and_samples(name, corner):
    asked, i, o = corner
    brdf = model.Brdf(asked, name)
    assert np.isfinite(brdf.pdf(i, o))
    assert brdf.pdf(i, o) >= 0
    if name in model.all_orders() and asked.roughness.gamma < 1.6 and asked.roughness.sigma_x > 1:
        return  # walks of thousands of events are another test's
    drawn = brdf.sample(i, np.random.default_rng(0))
    assert np.isfinite(drawn.weight)
    assert drawn.weight >= 0
    assert abs(np.linalg.norm(drawn.o) - 1) < 1e-9
