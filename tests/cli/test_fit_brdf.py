"""What `microsurf fit` gives for a measured BRDF: figures, scene, picture, pairs."""

import json

import click
import numpy as np
import pytest
from click.testing import CliRunner
from made import closed_form, directions

from microsurf.cli.fit_brdf import fit_brdf_command, table
from microsurf.cli.group import cli
from microsurf.errors import InputError
from microsurf.results.measured_brdf import holds_brdf, read_brdf, write_csv
from microsurf.scene import Scene

CONTRACT = {
    "kind", "n", "n_ci", "gamma", "gamma_ci", "sigma", "sigma_ci", "kd", "log_rms",
    "held_out_log_rms", "verdict", "seconds",
}  # fmt: skip


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("brdf") / "paint.csv"
    vector = [np.log(0.3), 0.5, 1.5]
    write_csv(closed_form("interfaced-lambertian", vector, [0.2, 0.4], directions(6, 20)), path)
    return path


def test_everything_that_is_asked_is_written(file, tmp_path):
    values = fit_brdf_command(
        file,
        orders="1",
        out=tmp_path / "scene.toml",
        figure=tmp_path / "fit.png",
        pairs=tmp_path / "pairs.csv",
    )
    assert values.keys() >= CONTRACT
    assert values["kind"] == "brdf"
    assert values["held_out_log_rms"].keys() == {"beckmann", "ggx", "std"}
    json.dumps(values, allow_nan=False)
    assert "std, order 1" in table(values)
    assert Scene.read(tmp_path / "scene.toml").roughness.sigma_x == pytest.approx(0.3, rel=1e-3)
    assert (tmp_path / "fit.png").stat().st_size > 10_000
    assert read_brdf(tmp_path / "pairs.csv").pairs == 120


@pytest.mark.parametrize(
    ("option", "words"),
    [
        ({"out": "scene.json"}, "ending must be .toml"),
        ({"figure": "no/such/fit.png"}, "does not exist"),
        ({"material": "wood"}, "must be one of"),
    ],
)
def test_bad_options_write_nothing(file, tmp_path, option, words):
    option = {k: v if k == "material" else tmp_path / v for k, v in option.items()}
    with pytest.raises(InputError, match=words):
        fit_brdf_command(file, orders="1", **option)
    assert list(tmp_path.iterdir()) == []


def test_no_scene_for_what_no_scene_has(file, tmp_path):
    with pytest.raises(InputError, match="no scene has a mirror"):
        fit_brdf_command(
            file, material="lambertian+conductor", hold_out=(), out=tmp_path / "scene.toml"
        )
    assert list(tmp_path.iterdir()) == []


def run(*words):
    return CliRunner().invoke(cli, ["fit", *map(str, words)])


def test_the_command_knows_a_brdf_by_its_file(file):
    done = run(file, "--orders", "1", "--json")
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["kind"] == "brdf"
    shown = run(file, "--orders", "1", "--hold-out", "45")
    assert "verdict" in shown.stdout
    assert "[45.0]" in shown.stdout or "45" in shown.stdout


def test_options_of_the_other_kind_are_refused(file, tmp_path):
    with pytest.raises(InputError, match=r"--voids crop: .* is a measured BRDF"):
        CliRunner().invoke(cli, ["fit", str(file), "--voids", "crop"], catch_exceptions=False)
    np.save(tmp_path / "heights.npy", np.zeros((8, 8)))
    with pytest.raises(InputError, match=r"--aperture 2.0: .* is a surface"):
        CliRunner().invoke(
            cli, ["fit", str(tmp_path / "heights.npy"), "--aperture", "2"], catch_exceptions=False
        )


@pytest.mark.parametrize("seed", [-1, 2**64])
def test_seeds_that_no_stream_has_are_refused(file, seed):
    with pytest.raises(click.BadParameter, match="not in the range"):
        CliRunner().invoke(
            cli,
            ["fit", str(file), "--seed", str(seed)],
            catch_exceptions=False,
            standalone_mode=False,
        )


def test_people_see_infinity_for_beckmann():
    lists = {"distributions": {}, "evidence": {}, "channels": ["R", "G", "B"]}
    values = {"gamma": 1e9, "gamma_ci": [2.5, 1e9], "sigma": 0.3, **lists}
    assert table(values)["gamma"] == "∞"
    assert table(values)["gamma_ci"] == "2.5  ∞"
    assert table({**values, "gamma": None, "gamma_ci": None})["gamma"] is None


def test_text_of_astm_is_told_from_other_text(tmp_path):
    rows = "VARS theta_i,phi_i,theta_s,phi_s,550nm\n30,0,30,180,1\n"
    for name, text, brdf in (("a.txt", rows, True), ("b.txt", "1 2\n", False), ("c.csv", "", True)):
        (tmp_path / name).write_text(text)
        assert holds_brdf(tmp_path / name) is brdf
