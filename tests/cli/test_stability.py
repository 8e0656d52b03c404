"""microsurf stability, and what commands do beyond the border it measures."""

import json
from dataclasses import replace

import pytest
from click.testing import CliRunner

from microsurf import stability
from microsurf.cli import stability as command
from microsurf.cli.group import cli
from microsurf.errors import InputError
from microsurf.report.figures import stability as stability_plot
from microsurf.stability import survey
from microsurf.stability.case import points
from microsurf.stability.functions import FUNCTIONS
from microsurf.stability.map import summarise
from microsurf.stability.sweep import Count

TINY = {
    "gamma": (1.75, 1e9), "sigma": (0.5,), "wide": (0.5,), "theta": (0.0, 75.0), "rho": (1.0,),
    "u": (0.5,), "below": (95.0,), "tilt": (60.0,), "n": (1.0, 1.5), "k": (1.0,), "metal": (0.2,),
    "kd": (0.0, 1.0),
}  # fmt: skip


def small(wrong=None):
    """Return a map of few places and no borders."""
    functions = [
        replace(function, value=wrong) if wrong and function.name == "r_e" else function
        for function in FUNCTIONS
        if function.name in ("D", "Λ", "F", "r_e", "r_i")
    ]
    found = [(function, list(points(function, TINY))) for function in functions]
    return stability.Stability(
        [point for _, mine in found for point in mine],
        [summarise(function, mine) for function, mine in found],
        [Count("D", 10, 0, 0, 0)],
        [],
        0.1,
    )


def run(monkeypatch, tmp_path, *words, wrong=None):
    monkeypatch.setattr(command, "survey", lambda **_: small(wrong))
    return CliRunner().invoke(cli, ["stability", "--out", str(tmp_path / "map"), *words])


def test_writes_the_map_and_prints_one_object(monkeypatch, tmp_path):
    done = run(monkeypatch, tmp_path, "--quick", "--json")
    assert done.exit_code == 0
    values = json.loads(done.stdout)
    assert {"functions", "counts", "limits", "sound", "seconds", "quick", "out"} <= values.keys()
    assert values["sound"] is True
    row = next(row for row in values["functions"] if row["function"] == "Λ")
    assert row["kept"] >= 12
    assert row["at"].startswith("θ = ")
    names = {path.name for path in (tmp_path / "map").iterdir()}
    assert names == {
        *(f"stability.{ending}" for ending in ("md", "csv", "json")),
        *(f"stability-{group}.png" for group in stability_plot.GROUPS if group != "samplers"),
    }
    head = (tmp_path / "map" / "stability.csv").read_text(encoding="utf-8").splitlines()[0]
    assert head == "function,group,place,value,condition,right,attainable,kept"


def test_a_wrong_law_is_an_unexpected_verdict(monkeypatch, tmp_path):
    done = run(monkeypatch, tmp_path, wrong=lambda _: 0.5)
    assert done.exit_code == 1
    assert "| r_e |" in done.stdout
    assert "short" in done.stdout
    assert (tmp_path / "map" / "stability.md").exists()


def test_a_negative_value_is_unsound():
    assert small().sound
    assert not replace(small(), counts=[Count("D", 10, 0, 0, 1)]).sound


@pytest.mark.parametrize("name", ["surface", "measure"])
def test_a_tail_no_mesh_holds_is_refused_unless_told(name, tmp_path):
    words = {
        "surface": ["--out", str(tmp_path / "s.npz")],
        "measure": ["--paths", "200", "--realisations", "1", "--theta", "10"],
    }[name]
    heavy = [name, "--gamma", "1.6", "--sigma", "0.5", "--cells", "32", "--json", *words]
    refused = CliRunner().invoke(cli, heavy)
    assert isinstance(refused.exception, InputError)
    text = str(refused.exception)
    assert "gamma = 1.6" in text
    assert "--allow-truncated-tail" in text
    done = CliRunner().invoke(cli, [*heavy, "--allow-truncated-tail"])
    assert done.exit_code == 0
    assert "accepted by" in done.stderr
    assert json.loads(done.stdout)["truncated_tail"].startswith("gamma = 1.6: at least")
    inside = [word if word != "1.6" else "1.65" for word in heavy]
    assert "truncated_tail" not in json.loads(CliRunner().invoke(cli, inside).stdout)


@pytest.mark.parametrize("name", ["validate", "convergence"])
def test_a_scene_beyond_the_border_is_refused(name, tmp_path):
    scene = tmp_path / "heavy.toml"
    scene.write_text("[roughness]\ngamma = 1.6\n", encoding="utf-8")
    refused = CliRunner().invoke(cli, [name, str(scene), "--out", str(tmp_path / "out")])
    assert isinstance(refused.exception, InputError)
    assert not (tmp_path / "out").exists()


def test_theory_has_no_such_border():
    words = [
        "predict",
        "--gamma",
        "1.6",
        "--sigma",
        "0.5",
        "--theta",
        "10",
        "--model",
        "approximate",
    ]
    assert CliRunner().invoke(cli, words).exit_code == 0


@pytest.mark.long
def test_the_whole_quick_map_is_sound():
    found = survey(quick=True)
    assert found.sound
    assert {row.verdict for row in found.limits} == {"ok", "border"}
