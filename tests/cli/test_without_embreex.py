"""Where embreex has no wheel (Linux on arm64) everything works, by the exact engine."""

import json
import sys
from importlib import import_module

import pytest
from click.testing import CliRunner

from microsurf.analysis import validate
from microsurf.analysis.self_test import SelfTest
from microsurf.cli.group import cli
from microsurf.errors import InputError

SCENE = """title = "small"
[material]
n = 1.5
kd = 0.8
[roughness]
gamma = 8.0
sigma = 0.3
[surface]
cells = 32
correlation = 4.0
realisations = 2
[light]
theta = [50.0]
[accuracy]
paths = 2000
"""
OF_SCENE = ("--gamma", "8", "--sigma", "0.3", "--theta", "50")


@pytest.fixture
def run(monkeypatch, tmp_path, undrawn):  # noqa: ARG001 - as it is for its effect
    """Run a command without embreex, in a folder of its own; gives its exit code and texts."""
    monkeypatch.setitem(sys.modules, "embreex", None)
    monkeypatch.setitem(sys.modules, "embreex.mesh_construction", None)
    monkeypatch.setitem(sys.modules, "embreex.rtcore_scene", None)
    monkeypatch.setattr(validate, "WALKS", 2000)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.toml").write_text(SCENE, encoding="utf-8")
    return lambda *arguments: CliRunner().invoke(cli, arguments)


def test_embree_is_missing_and_says_what_to_do(run):
    found = run("measure", *OF_SCENE, "--cells", "32", "--paths", "1000", "--engine", "embree")
    assert isinstance(found.exception, InputError)
    assert "exact engine" in str(found.exception)


@pytest.mark.parametrize(
    "arguments",
    [
        ("measure", *OF_SCENE, "--cells", "32", "--paths", "1000"),
        ("predict", *OF_SCENE),
        ("surface", "--gamma", "8", "--sigma", "0.3", "--cells", "32", "--out", "made.npz"),
    ],
)
def test_commands_work(run, arguments):
    found = run(*arguments, "--json")
    assert found.exit_code == 0, found.output
    assert json.loads(found.stdout)


@pytest.fixture
def checked(monkeypatch):
    """The self-test comes to this, without its half a minute."""
    of_itself = SelfTest([], None, "2020-01-01 00:00")
    monkeypatch.setattr(
        import_module("microsurf.cli.validate"), "self_test", lambda *_, **__: of_itself
    )


@pytest.mark.parametrize(
    "checks", ["checked", pytest.param("tmp_path", marks=pytest.mark.long, id="self-test")]
)
def test_validate_works_masking_and_all(run, tmp_path, checks, request):
    """The self-test too; its parts have tests of their own, with the exact engine alone too."""
    request.getfixturevalue(checks)
    found = run("validate", "small.toml", "--out", "report", "--json")
    assert found.exit_code in (0, 1), found.output
    report = json.loads((tmp_path / "report" / "report.json").read_text(encoding="utf-8"))
    scene = report["scenes"][0]
    assert scene["measured"]["engine"] == "exact"
    assert scene["masking"]
    assert not scene["broken"]
    assert not report["broken"]
