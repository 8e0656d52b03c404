"""What is no plain real number is refused at every public entry; what is one keeps its value."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from microsurf.errors import InputError, real_array
from microsurf.model import Brdf, UserBrdf, direction, evaluate
from microsurf.physics import facet, fresnel, smith, smith_fit, student_t, vcavity, visible_normals
from microsurf.scene import Scene
from microsurf.stats import (
    convergence_order,
    correlated_ks,
    hypothesis_tests,
    intervals,
    squared_error,
    variance_components,
)
from microsurf.surface import Heightfield

HEIGHTS = np.arange(64.0).reshape(8, 8)  # small whole numbers: any type holds them


class Quantity(np.ndarray):
    """As astropy's: an array with a unit."""

    unit = "um"


class Elsewhere:
    """As an array on a graphics card."""

    def __array__(self, *_, **__):
        raise TypeError("copy it to the host first")


def masked(values):
    found = np.ma.array(values.copy(), mask=False)
    found[-1] = np.ma.masked
    found.data[-1] = 7e4
    return found


def gaps(values):
    """Frames and lists whose gaps numpy would turn into numbers or objects."""
    return [
        masked(values),
        list(masked(values)),
        masked(values).astype(int),
    ]


def others(values):
    return [
        values + 0j,
        values > 0,
        values.astype(object),
        values.astype(str),
        values.astype("M8[s]"),
        values.astype("m8[s]"),
        values.view([("x", float)]),
        values.view(Quantity),
        Elsewhere(),
        [1.0, [2.0, 3.0]],
        [pd.NA, 1.0],
        None,
    ]


def brdf_of(values):
    """A callable of one's own that gives these for its directions."""
    return UserBrdf("mine", lambda *_: values).evaluate(UP, UP, Scene())


UP = np.array([[0.0, 0.0, 1.0]] * 8)
ENTRIES = {
    "heights": (Heightfield, HEIGHTS),
    "spacing": (lambda v: Heightfield(HEIGHTS, v), np.ones(())),
    "theta": (lambda v: direction(v, 0.0), HEIGHTS),
    "phi": (lambda v: direction(0.0, v), HEIGHTS),
    "i": (lambda v: evaluate(Scene(), v, UP), UP),
    "o": (lambda v: Brdf(Scene()).pdf(UP, v), UP),
    "to sample": (lambda v: Brdf(Scene()).sample(v, np.random.default_rng(0)), UP),
    "walks": (
        lambda v: Brdf(Scene(), "smith-walk", 2).evaluate(v, UP, np.random.default_rng(0)), UP,
    ),
    "m": (lambda v: student_t.distribution(v, 2, 0.5), UP),
    "slopes": (lambda v: student_t.slope_density(0.0, v, 2, 0.5), HEIGHTS),
    "masking": (lambda v: smith.g1(v, 2, 0.5), UP),
    "x": (lambda v: smith.lambda_of_x(v, 2), np.ones(8)),
    "of the fit": (lambda v: smith_fit.g1(v, 2, 0.5), UP),
    "of a groove": (lambda v: vcavity.g2(UP, UP, v), UP),
    "visible": (lambda v: visible_normals.density(UP, v, 2, 0.5), UP),
    "mu": (lambda v: fresnel.reflectance(v, 1.5), np.ones(8)),
    "mu of a metal": (lambda v: fresnel.reflectance(v, 1.5, 2.0), np.ones(8)),
    "n": (fresnel.internal_diffuse_reflectance, np.full(8, 1.5)),
    "n of a body": (lambda v: facet.body_weight(v, 0.5), np.full(8, 1.5)),
    "kd": (lambda v: facet.albedo(0.5, 1.5, v), np.full(8, 0.5)),
    "of a BRDF": (brdf_of, np.ones(8)),
    "values of a z-test": (lambda v: hypothesis_tests.z_test(v, 0, 1), np.ones(8)),
    "errors of a z-test": (lambda v: hypothesis_tests.z_test(np.ones(8), 0, v), np.ones(8)),
    "counts": (
        lambda v: hypothesis_tests.chi_square(v, np.full(8, 20.0), total_fixed=False),
        np.full(8, 20.0),
    ),
    "p-values": (hypothesis_tests.holm, np.full(8, 0.5)),
    "p-values of one question": (hypothesis_tests.sidak, np.full(8, 0.5)),
    "values of a mean": (convergence_order.mean_of, np.arange(8.0)),
    "deviations": (
        lambda v: convergence_order.power(np.arange(1, 9), v, np.full(8, 3)), np.ones(8),
    ),
    "spread of a mean": (intervals.half_width_of_mean, np.arange(8.0)),
    "variances": (lambda v: intervals.dof_of_sum(v, np.full(8, 3)), np.ones(8)),
    "of surfaces": (
        lambda v: variance_components.components_of(v, np.ones(8)), np.arange(8.0),
    ),
    "draws": (lambda v: squared_error.interval(v, HEIGHTS, 8), HEIGHTS),
    "of a field": (
        lambda v: correlated_ks.field_ks(v, np.random.default_rng(0)), HEIGHTS / 64,
    ),
    "of a pair": (lambda v: brdf_of((v, np.zeros(8))), np.ones(8)),
}  # fmt: skip


@pytest.mark.parametrize("entry", ENTRIES)
def test_masked_values_are_refused(entry):
    function, values = ENTRIES[entry]
    function(values)  # the negative control
    if values.ndim == 0:
        with pytest.raises(InputError, match="masked"):
            function(np.ma.array(1.0, mask=True))
        return
    for gap in gaps(values):
        with pytest.raises(InputError, match="are masked"):
            function(gap)


@pytest.mark.parametrize("entry", ENTRIES)
def test_what_is_no_real_number_is_refused_without_a_warning(entry):
    function, values = ENTRIES[entry]
    for other in others(values):
        with pytest.raises(InputError) as failure:  # warnings are errors here
            function(other)
        assert "\n" not in str(failure.value)


@pytest.mark.parametrize(
    "array",
    [
        np.asfortranarray(HEIGHTS),
        HEIGHTS.astype(np.float16),
        HEIGHTS.astype(">f8"),
        HEIGHTS.astype(np.longdouble),
        HEIGHTS.astype(np.uint8),
        HEIGHTS[::-1, ::-1][::-1, ::-1],
        np.ma.array(HEIGHTS),
        np.ma.array(HEIGHTS, mask=False),
        pd.DataFrame(HEIGHTS),
        xr.DataArray(HEIGHTS, dims=("y", "x")),
        HEIGHTS.tolist(),
    ],
)
def test_real_numbers_of_any_kind_keep_their_value(array):
    h = Heightfield(array)
    assert type(h.heights) is np.ndarray
    assert h.heights.dtype == np.float64
    assert h.heights.flags.c_contiguous
    np.testing.assert_array_equal(h.heights, HEIGHTS)


def test_read_only_arrays_and_dask_are_taken():
    dask_array = pytest.importorskip("dask.array")
    fixed = HEIGHTS.copy()
    fixed.setflags(write=False)
    np.testing.assert_array_equal(Heightfield(fixed).heights, HEIGHTS)
    np.testing.assert_array_equal(Heightfield(dask_array.from_array(HEIGHTS)).heights, HEIGHTS)
    with pytest.raises(InputError, match="are masked"):
        real_array("heights", dask_array.from_array(masked(HEIGHTS)))


def test_floats_wider_than_double_are_not_cut_to_infinity():
    if np.finfo(np.longdouble).max > np.finfo(float).max:
        with pytest.raises(InputError, match="infinite"):
            Heightfield(HEIGHTS.astype(np.longdouble) * np.longdouble("1e4000"))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_unit_vectors_in_single_precision_are_made_unit(dtype):
    rng = np.random.default_rng(0)
    i, o = direction(np.arccos(rng.uniform(0.1, 1, (2, 1000))), rng.uniform(0, 7, (2, 1000)))
    rounded = i.astype(dtype), o.astype(dtype)
    asked = Brdf(Scene())
    found, wanted = asked.evaluate(*rounded), asked.evaluate(i, o)
    # Rounding turns a direction by up to 1e-7; f of σ = 0.5 changes by 30 times that at most.
    for one, other in zip(found, wanted, strict=True):
        np.testing.assert_allclose(one, other, rtol=3e-6 if dtype is np.float32 else 1e-13)
    assert np.abs(np.linalg.norm(asked.sample(rounded[0], rng).o, axis=-1) - 1).max() < 1e-12


@pytest.mark.parametrize(
    "w", [UP * 1.00001, UP * 0.0, UP * np.nan, direction(0.5, 0.3).astype(np.float16)]
)
def test_other_lengths_are_refused_with_what_to_do(w):
    with pytest.raises(InputError, match=r"in float64, divide by np\.linalg\.norm\(i, axis=-1"):
        evaluate(Scene(), w, UP)
    if np.isfinite(w).all() and w.any():  # the advice helps
        i = w.astype(np.float64)
        i /= np.linalg.norm(i, axis=-1, keepdims=True)
        evaluate(Scene(), i, UP)
