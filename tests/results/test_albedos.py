"""Figures of a result against simulated paths: what a count says about a mean and its error."""

import numpy as np
import pytest
import xarray as xr

from microsurf.physics import facet
from microsurf.results import albedos, datasets, detector

N, KD = 1.5, 0.8
W = float(facet.body_weight(N, KD))


def one_bin(flux, path_weight=None, paths=None):
    """Build a dataset of (realisation, order, body_events) fluxes on a detector of a single bin."""
    events = flux.shape[2]
    data = xr.Dataset(
        {
            "flux": (
                ("realisation", "order", "body_events", "theta_i", "phi_i", "theta_o", "phi_o"),
                flux[..., None, None, None, None],
            )
        },
        coords={
            "theta_i": [0.0],
            "phi_i": [0.0],
            "order": list(detector.ORDERS[: flux.shape[1]]),
            "path_weight": ("body_events", np.ones(events) if path_weight is None else path_weight),
        },
    )
    if paths is not None:
        dims = ("realisation", "theta_i", "phi_i")
        data["paths"] = (dims, np.full((len(flux), 1, 1), float(paths)))
    return data


def simulated(runs, paths, rng, survival=1.0):
    """Paths with geometric numbers of events, traced ``runs`` times; also each run's exact mean.

    Beyond BODY_EXACT body events a path survives each with probability ``survival``
    and counts for more, as in `trace.wavefront`.
    """
    events = detector.BODY_EXACT + 5
    p = np.zeros((4, events + 1))  # the last: absorbed
    for order in range(4):
        # As many as 20 body events at order 4+, or thinning would have nothing to do.
        low, high = order, (order + 2 if order < 3 else events)
        p[order, low:high] = 0.4 ** (order + 1) / (high - low)
    weight = survival ** -np.maximum(np.arange(events) - detector.BODY_EXACT, 0.0)
    p[:, :events] /= weight
    p[0, -1] = 1 - p.sum()
    counts = rng.multinomial(paths, p.ravel(), size=runs).reshape(runs, 4, events + 1)
    flux = counts[:, :, :events] / paths * weight
    return one_bin(flux, weight, paths), p[:, :events] * weight


@pytest.mark.parametrize("survival", [1.0, 0.6])
@pytest.mark.parametrize("name", list(albedos.QUANTITIES))
def test_ray_error_is_the_spread_of_many_runs(name, survival, judge):
    """4000 runs know their spread to 1.1 %. Negative control: errors a tenth off."""
    data, exact = simulated(4000, 500, np.random.default_rng(judge.seed(5)), survival)
    values = data.microsurf.albedo(**albedos.SELECTED[name], n=N, kd=KD).values.ravel()
    errors = data.microsurf.ray_error(**albedos.SELECTED[name], n=N, kd=KD).values.ravel()
    weights = W ** np.arange(exact.shape[1])
    truth = {
        "specular": exact[0, 0],
        "body": (exact[0, 1:] * weights[1:]).sum(),
        "total": (exact * weights).sum(),
    }[name]
    judge.near(values.mean(), truth, values.std() / np.sqrt(len(values)))
    off = variance_gap(values, errors)
    judge.near(*off)
    judge.tells(off[0] - 0.2 * values.var(), *off[1:])


def variance_gap(values, errors):
    """Mean of the variances claimed minus that of the values, 0, and its standard error."""
    gaps = errors**2 - (values - values.mean()) ** 2
    return gaps.mean(), 0.0, gaps.std() / np.sqrt(len(gaps))


def test_ray_error_without_the_path_weight_would_be_wrong(judge):
    """Negative control: paths that stand for many spread more than their light says.

    For 16 at most: of more the spread itself is not known from so few runs.
    It is ten standard errors off in each of 800 seeds; at a survival of 0.3 and 4000 runs
    one in 300 would not be told.
    """
    survival = 0.5
    data, _ = simulated(16_000, 500, np.random.default_rng(judge.seed(6)), survival)
    values = data.microsurf.albedo(n=N, kd=1.0).values.ravel()

    def gap(d):
        return variance_gap(values, d.microsurf.ray_error(n=N, kd=1.0).values.ravel())

    judge.near(*gap(data))
    blind = data.assign_coords(path_weight=("body_events", np.ones(data.sizes["body_events"])))
    judge.tells(*gap(blind))


def test_standard_error_is_over_realisations_if_there_are_several():
    flux = np.zeros((3, 1, 1))
    flux[:, 0, 0] = 0.1, 0.2, 0.6
    data = one_bin(flux, paths=1e6)
    by_hand = np.std([0.1, 0.2, 0.6], ddof=1) / np.sqrt(3)
    assert data.microsurf.standard_error(n=N, kd=KD).item() == pytest.approx(by_hand)
    alone = data.isel(realisation=[0])
    by_hand = np.sqrt(0.1 * 0.9 / 1e6)
    assert alone.microsurf.standard_error(n=N, kd=KD).item() == pytest.approx(by_hand)
    # A prediction has no paths and no error.
    assert alone.drop_vars("paths").microsurf.standard_error(n=N, kd=KD).item() == 0


def test_figures_by_hand():
    flux = np.zeros((1, 2, 3))
    flux[0] = [[0.1, 0.2, 0.0], [0.01, 0.02, 0.04]]
    found = albedos.figures(one_bin(flux), (KD,), n=N)
    specular = [0.1, 0.01, 0, 0]
    body = [0.2 * W, 0.02 * W + 0.04 * W**2, 0, 0]
    assert found["specular_by_order"] == specular
    assert found["body_by_order"] == pytest.approx(body, rel=1e-14)
    assert found["albedo_by_order"] == pytest.approx(np.add(specular, body), rel=1e-14)
    assert found["albedo"] == pytest.approx(sum(specular) + sum(body), rel=1e-14)
    assert found["albedo_se"] == 0


def test_figures_keep_the_order_of_angles_and_kd():
    """θ outermost, then φ, then Kd: flux = 0.1 θ-index + 0.01 φ-index, all of it one body event."""
    flux = np.zeros((1, 2, 3, 1, 2, detector.RINGS, detector.SECTORS))
    for t in range(2):
        for p in range(3):
            flux[0, t, p, 0, 1, 7, 9] = 0.1 * (t + 1) + 0.01 * p
    data = datasets.build(flux, [0, 60], [0, 45, 90], orders=(1,))
    found = albedos.figures(data, (0.5, 1.0, 0.5), n=1.0)
    wanted = [[k * v for k in (0.5, 1.0, 0.5)] for v in (0.1, 0.11, 0.12, 0.2, 0.21, 0.22)]
    np.testing.assert_allclose(found["albedo"], wanted, rtol=1e-14)
    np.testing.assert_allclose(np.array(found["body_by_order"])[..., 0], wanted, rtol=1e-14)


def test_losses_by_hand():
    data = one_bin(np.zeros((2, 1, 1)), paths=100)
    dims = ("realisation", "theta_i", "phi_i", "cause")
    data["ended"] = (dims, np.array([[[[50.0, 1.0, 2.0]]], [[[60.0, 0.0, 4.0]]]]))
    data = data.assign_coords(
        cause=["absorbed", "below", "behind"], lost=("cause", [False, True, True])
    )
    # Of a walk, whose paths all carry the same light.
    assert albedos.losses(data) == {
        "lost": 7 / 200,
        "lost_light": 7 / 200,
        "lost_by_cause": {"below": 1, "behind": 6},
    }


@pytest.mark.parametrize("light", [0.0, 1e-9, 5.0])
def test_paths_lost_are_paths_whatever_light_they_carried(light):
    """`lost` is the sum of `lost_by_cause` over all paths; the light has a figure of its own."""
    data = one_bin(np.zeros((2, 1, 1)), paths=100)
    dims = ("realisation", "theta_i", "phi_i", "cause")
    data["ended"] = (dims, np.array([[[[50.0, 0.0, light]]], [[[60.0, 0.0, 0.0]]]]))
    data["ended_paths"] = (dims, np.array([[[[50, 0, 3]]], [[[60, 0, 2]]]]))
    data = data.assign_coords(
        cause=["absorbed", "below", "wrapped"], lost=("cause", [False, True, True])
    )
    assert albedos.losses(data) == {
        "lost": 5 / 200,
        "lost_light": light / 200,
        "lost_by_cause": {"below": 0, "wrapped": 5},
    }
