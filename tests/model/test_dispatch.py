"""One `predict` for all models: what the command line takes, Python takes."""

from dataclasses import replace

import pytest
import xarray as xr

import microsurf
from microsurf import model
from microsurf.errors import InputError
from microsurf.model.single_scattering import first_order
from microsurf.scene import Accuracy, Light, Scene

SCENE = replace(Scene(), light=Light((50.0,)), accuracy=Accuracy(2000))


def test_a_walk_is_predicted_by_its_name():
    for key in model.all_orders():
        by_name = microsurf.predict(SCENE, key, seed=3)
        xr.testing.assert_equal(by_name, model.walk(SCENE, key, seed=3))
        assert by_name.attrs["model"] == key
        assert not by_name.equals(microsurf.predict(SCENE, key, seed=4))


def test_order_one_is_integrated():
    xr.testing.assert_equal(microsurf.predict(SCENE, "flat"), first_order.predict(SCENE, "flat"))


def test_an_unknown_name_is_answered_with_all_of_them():
    with pytest.raises(InputError, match=r"model = .cook.: must be one of flat.*vcavity-walk"):
        microsurf.predict(SCENE, "cook")
