"""A traced result as a material: its ratios, its energy, and what it refuses."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner

from microsurf.analysis.export import check, rgl, traced
from microsurf.analysis.export.traced import of_result
from microsurf.cli.group import cli
from microsurf.errors import InputError
from microsurf.model import direction, predict, walk
from microsurf.results import datasets, detector
from microsurf.results.measured_brdf import read_brdf
from microsurf.scene import Light, Material, Roughness, Scene

SCENE = Scene(
    material=Material(0.2, (), 3.9),
    roughness=Roughness(2.0, (0.4,)),
    light=Light((0.0, 20.0, 40.0, 60.0, 75.0), (0.0,)),
)
PATHS = 20_000


def as_traced(scene, seeds=(1, 2, 3)):
    """Walks in the place of explicit surfaces: the same arrays at a hundredth of the time."""
    walks = [walk(scene, walks=PATHS, seed=seed, workers=1) for seed in seeds]
    result = xr.concat([w.drop_vars("ended") for w in walks], "realisation")
    flux = result.flux.sel(order=1).isel(body_events=slice(2)).values
    variance = np.pad(flux, [(0, 0)] * 3 + [(0, 2 - flux.shape[3])] + [(0, 0)] * 2) / PATHS
    dims = ("realisation", "theta_i", "phi_i")
    result["bin_variance"] = ((*dims, "kind", "theta_o", "phi_o"), variance)
    result["light_rays"] = result.paths
    result.attrs = walks[0].attrs
    return result


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    path = tmp_path_factory.mktemp("traced") / "a.nc"
    datasets.save(as_traced(SCENE), path)
    return path


@pytest.fixture(scope="module")
def source(result):
    return of_result(result)


def in_bins(source, t):
    """Light of a source in the detector's bins at incidence t."""
    theta_o, turn = traced.points_of_bins()
    o = direction(theta_o.ravel(), turn.ravel())
    i = np.broadcast_to(direction(np.radians(source.traced.theta_i[t]), 0.0), o.shape)
    f = source.evaluate(i, o)[:, 0].reshape(theta_o.shape)
    return f.mean(axis=-1) * detector.projected_solid_angles()


def test_each_incidence_keeps_its_albedo_and_the_lobe_its_errors(source):
    bins = source.traced
    for t in range(len(bins.theta_i)):
        wanted = bins.energy[t, 0, 0]
        there = in_bins(source, t)
        assert there.sum() == pytest.approx(wanted.sum(), rel=2e-3)
        own = np.sqrt(2 / np.pi) * bins.error[t].sum()
        assert np.abs(there - wanted).sum() < 1.5 * own


def test_it_is_nearer_to_another_trace_than_the_trace_is(source, tmp_path):
    path = tmp_path / "b.nc"
    datasets.save(as_traced(SCENE, (4, 5, 6)), path)
    other = of_result(path).traced.energy[:, 0, 0]
    here = np.stack([in_bins(source, t) for t in range(len(other))])
    raw = np.abs(source.traced.energy[:, 0, 0] - other).sum()
    assert np.abs(here - other).sum() < 0.85 * raw


def test_light_that_the_model_does_not_have_is_added(source):
    first = predict(SCENE).flux.values[0, :, 0, 0, 0].sum(axis=(-2, -1))
    whole = source.traced.energy.sum(axis=(1, 2, 3, 4))
    assert np.all(whole > first * 1.02)
    # Far from the lobe at 75° the model has hardly any light, and later orders have.
    i, o = direction(np.array([np.radians(75)]), 0.0), direction(np.array([np.radians(60)]), 0.0)
    assert source.evaluate(i, o)[0, 0] > 0


def test_mitsuba_reads_it_within_the_errors_of_the_trace(source, tmp_path):
    pytest.importorskip("mitsuba")
    rgl.write(source, tmp_path / "a.bsdf")
    judged = check.check_traced(source, tmp_path / "a.bsdf")
    assert judged["error"] < 1.5 * judged["trace_error"]
    assert judged["albedo_error"] < 0.003
    # A negative control: lobes three rings, 6°, off are not those of the file.
    bins = source.traced
    shifted = replace(bins, energy=np.roll(bins.energy, 3, axis=-2))
    judged = check.check_traced(replace(source, traced=shifted), tmp_path / "a.bsdf")
    assert judged["error"] > 1.5 * judged["trace_error"]


def test_one_surface_is_smoothed_by_the_errors_of_its_rays(tmp_path):
    path = tmp_path / "a.nc"
    datasets.save(as_traced(SCENE, (1,)), path)
    one = of_result(path)
    assert "specular 0°" not in one.notes[0]
    own = np.sqrt(2 / np.pi) * one.traced.error[2].sum()
    assert np.abs(in_bins(one, 2) - one.traced.energy[2, 0, 0]).sum() < 1.5 * own


@pytest.mark.parametrize(
    ("light", "sigma", "words"),
    [
        (Light((30.0,)), (0.4,), "--theta 0,15,30"),
        (Light((0.0, 40.0, 80.0)), (0.4,), "too few"),
        (SCENE.light, (0.4, 0.2), "--phi 0,30,60,90"),
    ],
)
def test_too_few_incidences_are_refused_with_the_command_that_helps(tmp_path, light, sigma, words):
    scene = replace(SCENE, light=light, roughness=Roughness(2.0, sigma))
    thetas, phis = scene.light.theta, scene.light.phi
    flux = np.zeros((1, len(thetas), len(phis), 4, 1, detector.RINGS, detector.SECTORS))
    empty = datasets.build(flux, thetas, phis, attrs={"source": "x", "scene": scene.to_toml()})
    empty["light_rays"] = empty.flux.isel(order=0) * 0
    datasets.save(empty, tmp_path / "a.nc")
    with pytest.raises(InputError, match=words):
        of_result(tmp_path / "a.nc")


def test_the_command_writes_a_result_and_says_how_it_was_smoothed(result, tmp_path):
    out = tmp_path / "a.csv"
    run = CliRunner().invoke(cli, ["export", str(result), "--out", str(out)])
    assert run.exit_code == 0
    assert "ratios are smoothed over" in run.stderr
    assert read_brdf(out).pairs == 5 * (1 + 45 * 36)


def test_what_was_predicted_is_refused(tmp_path):
    datasets.save(predict(SCENE), tmp_path / "a.nc")
    with pytest.raises(InputError, match="not traced"):
        of_result(tmp_path / "a.nc")
