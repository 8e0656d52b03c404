from dataclasses import replace

import brute
import numpy as np
import pytest
import xarray as xr

from microsurf import model
from microsurf.errors import InputError
from microsurf.physics import facet
from microsurf.results import datasets, detector
from microsurf.scene import Light, Material, Roughness, Scene

SCENE = Scene(
    material=Material(1.5, (0.0, 0.5, 1.0)),
    roughness=Roughness(2.0, (0.5,)),
    light=Light((0.0, 60.0), (0.0, 45.0)),
)


def energies(scene, name):
    return datasets.hemispherical(model.predict(scene, name).flux).squeeze(("realisation", "order"))


@pytest.mark.parametrize("name", model.order_one())
def test_dimensions_are_those_of_a_measurement_and_energy_is_at_most_1(name):
    predicted = model.predict(replace(SCENE, light=Light((0.0, 20.0))), name)
    assert predicted.flux.dims == (
        "realisation", "theta_i", "phi_i", "order", "body_events", "theta_o", "phi_o",
    )  # fmt: skip
    assert predicted.flux.shape == (1, 2, 1, 1, 2, detector.RINGS, detector.SECTORS)
    assert np.all(predicted.flux >= 0)
    total = datasets.hemispherical(predicted.flux).sum("body_events")
    assert np.all(total <= 1 + 1e-12)
    assert predicted.attrs["model"] == name
    assert predicted.attrs["source"] == "prediction"
    assert predicted.attrs["specular_error"] < 1e-5
    assert predicted.attrs["body_error"] < 1e-4


def test_an_isotropic_lobe_is_the_same_for_every_phi_i():
    flux = model.predict(SCENE, "smith").flux
    xr.testing.assert_equal(flux.isel(phi_i=0, drop=True), flux.isel(phi_i=1, drop=True))


def test_anisotropic_lobes_differ_with_phi_i_and_exchange_with_the_axes():
    light = Light((40.0,), (0.0, 90.0))
    scene = replace(SCENE, material=Material(1.5, (0.0,)), light=light)
    along = energies(replace(scene, roughness=Roughness(2.0, (0.2, 0.6))), "smith")
    across = energies(replace(scene, roughness=Roughness(2.0, (0.6, 0.2))), "smith")
    specular = along.isel(theta_i=0, body_events=0)
    np.testing.assert_allclose(specular, across.isel(theta_i=0, body_events=0)[::-1], rtol=1e-8)
    assert abs(specular[0] / specular[1] - 1) > 1e-3


def test_only_what_the_scene_requires_runs():
    diffuse = model.predict(replace(SCENE, material=Material(1.0, (0.5,)), light=Light((30.0,))))
    assert not np.any(diffuse.flux.sel(body_events=0))
    assert diffuse.attrs["effects"] == "substrate, roughness"
    mirror = model.predict(replace(SCENE, material=Material(1.5, (0.0,)), light=Light((30.0,))))
    assert not np.any(mirror.flux.sel(body_events=1))
    assert mirror.attrs["effects"] == "interface, roughness"
    plane = replace(SCENE, roughness=Roughness(2.0, (0.0,)))
    xr.testing.assert_equal(model.predict(plane, "vcavity"), model.predict(SCENE, "flat"))


def test_a_prediction_is_saved_and_loaded(tmp_path):
    predicted = model.predict(replace(SCENE, material=Material(1.5, (0.0,))), "smith")
    datasets.save(predicted, tmp_path / "p.nc")
    xr.testing.assert_equal(datasets.load(tmp_path / "p.nc"), predicted)


@pytest.mark.parametrize("name", model.order_one())
def test_evaluate_is_the_mean_brdf_of_a_small_bin_and_linear_in_the_body_weight(name):
    scene = replace(SCENE, light=Light((10.0,)), material=Material(1.5, (0.5,)))
    i, o = brute.direction(10, 0), brute.direction(20, 90)
    specular, body = model.evaluate(scene, i, o, name)
    flux = model.predict(scene, name).flux.squeeze(drop=True)
    mean = datasets.brdf(flux).isel(theta_o=10, phi_o=9)
    weight = float(facet.body_weight(1.5, 0.5))
    # The lobe is curved over a bin of 2° × 10°: half a percent is far below its variation.
    assert float(mean[1]) * weight == pytest.approx(float(body), rel=5e-3)
    assert float(mean[0]) == pytest.approx(float(specular), rel=2e-2, abs=1e-30)
    white = replace(scene, material=Material(1.5, (1.0,)))
    _, at_white = model.evaluate(white, i, o, name)
    assert float(body) == pytest.approx(weight * float(at_white), rel=1e-14)


def test_evaluate_takes_arrays_and_is_0_below_the_horizon():
    scene = replace(SCENE, material=Material(1.5, (0.5,)))
    i = brute.direction(30, 0)
    o = np.stack([[brute.direction(t, p) for t in (10, 89, 91)] for p in (0, 120)])
    specular, body = model.evaluate(scene, i, o)
    assert specular.shape == body.shape == (2, 3)
    assert np.all(specular[:, :2] > 0)
    assert np.all(body[:, :2] > 0)
    assert not np.any(specular[:, 2])
    assert not np.any(body[:, 2])


def test_what_makes_no_sense_is_refused():
    up = brute.direction(0, 0)
    one = replace(SCENE, material=Material(1.5, (0.5,)))
    with pytest.raises(InputError, match="model = 'cook': must be one of flat, approximate"):
        model.evaluate(one, up, up, "cook")
    with pytest.raises(InputError, match=r"material\.kd"):
        model.evaluate(SCENE, up, up)
    with pytest.raises(InputError, match="o: must be unit vectors"):
        model.evaluate(one, up, 2 * up)
    with pytest.raises(InputError, match="i: must be unit vectors"):
        model.evaluate(one, np.array([np.nan, 0, 1]), up)
