"""Pairs of surfaces: their slopes, their correlation, and that they do not cross."""

from dataclasses import replace

import numpy as np
import pytest

from microsurf.errors import InputError
from microsurf.physics import student_t
from microsurf.scene import Layers, Roughness, Scene, Substrate, Surface
from microsurf.surface import Heightfield, Mesh, layered_mesh, surface_of
from microsurf.surface.layers import LayeredMesh


def scene(substrate, gap=20.0, gamma=8.0, sigma=0.5, cells=64, **surface):
    return Scene(
        roughness=Roughness(gamma, (sigma,)),
        surface=Surface(cells=cells, correlation=4.0, realisations=1, **surface),
        layers=Layers(gap, substrate),
    )


def own(correlation=0.0, gamma=8.0, sigma=(0.5,)):
    return Substrate(gamma, sigma, correlation)


def test_the_interface_is_that_of_the_scene_without_layers():
    asked = scene(own())
    pair = layered_mesh(asked, 3, 1)
    alone = surface_of(replace(asked, layers=None), 3, 1).heights
    assert np.array_equal(pair.interface.heights, alone - alone.mean())


def test_full_correlation_and_equal_roughness_is_the_same_surface():
    pair = layered_mesh(scene(own(1.0)), 3, 0)
    np.testing.assert_array_equal(pair.substrate.heights, pair.interface.heights - 20.0)
    upside_down = layered_mesh(scene(own(-1.0)), 3, 0)
    np.testing.assert_allclose(
        upside_down.substrate.heights + 20, -upside_down.interface.heights, atol=1e-9
    )


@pytest.mark.parametrize("correlation", [-1.0, -0.5, 0.0, 0.5, 1.0])
def test_the_correlation_is_that_of_the_fields(correlation):
    """Of 256² cells and L = 4 a sample's correlation has an error of 0.014."""
    report = layered_mesh(scene(own(correlation), 40.0, cells=256), 5, 0).report()
    for name in ("height_correlation", "slope_correlation"):
        assert report[name] == pytest.approx(correlation, abs=0.07), name


def test_another_roughness_has_its_own_slopes():
    pair = layered_mesh(scene(own(0.7, gamma=3.0, sigma=(0.25,)), cells=128), 5, 0)
    heights = pair.substrate.heights
    p, q = np.roll(heights, -1, 1) - heights, np.roll(heights, -1, 0) - heights
    p, q = np.stack([p, np.roll(p, -1, 0)]), np.stack([np.roll(q, -1, 1), q])
    quantiles = np.quantile(np.hypot(p, q), [0.5, 0.9])
    np.testing.assert_allclose(
        quantiles, 0.25 * student_t.slope_quantile(np.array([0.5, 0.9]), 3.0), rtol=0.02
    )


def test_a_shape_is_the_interface_scaled():
    same = layered_mesh(scene(Substrate(shape="same"), 0.01), 3, 0)
    assert same.least_distance == pytest.approx(0.01, rel=1e-9)
    half = layered_mesh(scene(Substrate(shape="same", sigma=(0.25,)), 9.0), 3, 0)
    np.testing.assert_array_equal(half.substrate.heights, half.interface.heights / 2 - 9)
    flat = layered_mesh(scene(Substrate(shape="flat"), 9.0), 3, 0)
    assert np.all(flat.substrate.heights == -9)
    assert flat.report()["height_correlation"] == 0


@pytest.mark.parametrize("substrate", [Substrate(shape="flat"), own()])
def test_surfaces_that_cross_are_refused_with_what_to_do(substrate):
    with pytest.raises(InputError, match=r"layers\.gap = 0\.5: .* cross.* Raise it") as refused:
        layered_mesh(scene(substrate, 0.5), 3, 0)
    needed = float(str(refused.value).split("must be > ")[1].split(" ")[0])
    assert layered_mesh(scene(substrate, needed * 1.001), 3, 0).least_distance > 0
    with pytest.raises(InputError):
        layered_mesh(scene(substrate, needed * 0.999), 3, 0)


def test_the_least_distance_sees_crossed_diagonals():
    """One vertex up in each surface, where the other's diagonal passes the cell's middle."""
    low, high = np.zeros((4, 4)), np.zeros((4, 4))
    high[1, 1], low[1, 2] = -1.0, 1.0
    straight, flipped = np.zeros((4, 4), bool), np.ones((4, 4), bool)
    pair = LayeredMesh(Mesh(high, straight), Mesh(low - 2, flipped), 2.0)
    # In the cell between them: interface −½ in the middle, substrate −3/2.
    assert pair.least_distance == pytest.approx(1.0)


def test_a_file_must_have_the_interfaces_period(tmp_path):
    rng = np.random.default_rng(1)
    np.save(tmp_path / "below.npy", 0.1 * rng.standard_normal((64, 64)))
    np.save(tmp_path / "other.npy", 0.1 * rng.standard_normal((64, 32)))
    pair = layered_mesh(scene(Substrate(file=str(tmp_path / "below.npy"))), 3, 0)
    assert pair.substrate.heights.mean() == pytest.approx(-20)
    with pytest.raises(InputError, match="64 × 32 cells; must be that of the interface"):
        layered_mesh(scene(Substrate(file=str(tmp_path / "other.npy"))), 3, 0)
    missing = scene(Substrate(file=str(tmp_path / "none.npy")))
    with pytest.raises(InputError, match=r"none\.npy"):
        layered_mesh(missing, 3, 0)


def test_a_given_interface_without_a_field_has_no_correlation():
    given = Heightfield(np.random.default_rng(1).standard_normal((64, 64)) * 0.1)
    assert layered_mesh(scene(own()), 3, 0, given).least_distance > 0
    with pytest.raises(InputError, match="was not generated"):
        layered_mesh(scene(own(0.5)), 3, 0, given)


def test_a_scene_without_layers_is_refused():
    with pytest.raises(InputError, match="one surface"):
        layered_mesh(Scene(), 3, 0)
