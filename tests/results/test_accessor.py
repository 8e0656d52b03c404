"""A result answers by its own material; the numbers are those of `test_albedos`."""

import numpy as np
import pytest
import xarray as xr

from microsurf import model
from microsurf.errors import InputError
from microsurf.physics.fresnel import reflectance
from microsurf.results import datasets
from microsurf.scene import Material, Scene

MIRROR = Scene.of(sigma=0, n=1.5, kd=0, theta=(0, 60))
COSINES = np.cos(np.radians([0, 60]))


@pytest.fixture(scope="module")
def mirrored():
    return model.predict(MIRROR, "flat")


def test_the_material_is_that_of_the_scene(mirrored):
    result = mirrored.microsurf
    assert result.scene == MIRROR
    found = result.albedo(order=1, kind="specular").values.ravel()
    np.testing.assert_allclose(found, reflectance(COSINES, 1.5), rtol=1e-12)
    assert not result.albedo(order=1, kind="body").any()
    assert not result.albedo(order=2).any()


def test_parts_add_up():
    result = model.predict(Scene.of(n=1.5, kd=0.8, theta=(0, 60)), "smith").microsurf
    whole = result.albedo()
    parts = [result.albedo(order=1, kind=kind) for kind in ("specular", "body")]
    np.testing.assert_allclose(sum(parts), whole, rtol=1e-14)
    np.testing.assert_allclose(result.albedo(kind="body"), parts[1], rtol=1e-14)
    np.testing.assert_allclose(result.albedo(order=1), whole, rtol=1e-14)
    for kind in ("specular", "body", None):
        lobe = result.lobe(1, kind)
        np.testing.assert_allclose(
            lobe.sum(("theta_o", "phi_o")), result.albedo(order=1, kind=kind), rtol=1e-13
        )
    assert float(result.albedo(kd=0.4).max()) < float(whole.min())


def test_one_of_several_kd_must_be_named():
    several = Scene(material=Material(1.5, (0.2, 0.8)))
    result = model.predict(several, "flat").microsurf
    with pytest.raises(InputError, match=r"kd is not given: the scene has 0\.2, 0\.8; name one"):
        result.albedo()
    assert (result.albedo(kd=0.2) < result.albedo(kd=0.8)).all()


def test_a_result_without_a_scene_says_what_to_give(mirrored):
    bare = xr.Dataset({"flux": mirrored.flux}).drop_attrs()
    with pytest.raises(InputError, match="give n and kd"):
        bare.microsurf.albedo()
    assert bare.microsurf.albedo(n=1.5, kd=0.0).equals(mirrored.microsurf.albedo())


def test_errors_come_from_paths_or_from_surfaces(mirrored):
    flux = np.repeat(mirrored.flux.values, 2, axis=0)
    flux[1] *= 1.1
    two = datasets.build(flux, (0, 60), (0,), (1,), attrs=mirrored.attrs).microsurf
    one = mirrored.microsurf.albedo().isel(realisation=0, drop=True)
    np.testing.assert_allclose(two.standard_error(), 0.05 * one, rtol=1e-12)
    assert not mirrored.microsurf.standard_error().any()


def test_a_notebook_shows_a_row_for_each_incidence(mirrored):
    html = mirrored.microsurf._repr_html_()
    assert html.count("<tr>") == 1 + 2
    assert "prediction: flat" in html
    assert "<td>0.04</td>" in html


def test_lobes_are_drawn():
    rough = model.predict(Scene.of(theta=(30,)), "smith")
    assert rough.microsurf.plot_lobes().axes
