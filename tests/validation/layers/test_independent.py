import numpy as np
import pytest

from microsurf.model import walk
from microsurf.scene import Layers, Light, Material, Roughness, Scene, Substrate
from validation.layers.independent.cases import KD, QUANTITIES, WALKS, quantities
from validation.layers.measures import relative


def test_how_far_two_sources_are_and_its_error():
    """Pairs that go together have no error; a theory has that of its walks."""
    traced = np.array([0.4, 0.5, 0.6])
    assert relative(1.1 * traced, traced) == pytest.approx((10.0, 0.0), abs=1e-12)
    percent, error = relative(np.array([0.5]), traced, paired=False, walks=WALKS)
    assert percent == pytest.approx(0, abs=1e-12)
    walked = 0.5 * 0.5 / WALKS
    assert error == pytest.approx(100 * np.sqrt(0.01 / 3 + walked) / 0.5)
    percent, error = relative(traced[:2], traced, paired=False)
    assert percent == pytest.approx(-10)
    assert error == pytest.approx(100 * np.sqrt(0.005 / 2 + 0.9**2 * 0.01 / 3) / 0.5)


def test_regions_of_the_hemisphere(judge):
    """A Lambertian plane under nothing: parts of it by sin² of the rings and turns of sectors."""
    scene = Scene(
        material=Material(1.0, (KD,)),
        roughness=Roughness(8.0, (0.0,)),
        light=Light((80.0,)),
        layers=Layers(1.0, Substrate(shape="flat")),
    )
    walks = 100_000
    result = walk(scene, "layered-walk", walks=walks, seed=judge.seed(1))
    values = dict(zip(QUANTITIES, quantities(result)[0, 0], strict=True))
    sides = np.cos(np.radians(45)) ** 2 * 50 / 360
    parts = {"back": sides, "forward": sides, "zenith": np.sin(np.radians(15)) ** 2}
    expected = KD * np.array([1.0, 0.0, 1.0, *parts.values()])
    error = np.sqrt(expected * (KD - expected) / walks)
    np.testing.assert_allclose([values[q] for q in QUANTITIES[:3]], expected[:3], atol=1e-12)
    regions = [values[q] for q in parts]
    judge.near(regions, expected[3:], error[3:])
    judge.tells(regions, 1.1 * expected[3:], error[3:])
