"""What `microsurf fit` gives for a measured BRDF: figures, scene, picture, pairs."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from microsurf.cli.fit_brdf import fit_brdf_command, table
from microsurf.errors import InputError
from microsurf.results.measured_brdf import read_brdf, write_csv
from microsurf.scene.toml import read

sys.path.insert(0, str(Path(__file__).parents[1] / "analysis" / "brdf_fit"))

from made import closed_form, directions

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
    assert read(tmp_path / "scene.toml").roughness.sigma_x == pytest.approx(0.3, rel=1e-3)
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
