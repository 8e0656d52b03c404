"""The workflow that CI runs: it is YAML, its shell is shell, and what it names is there."""

import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest
import yaml

from microsurf import model

ROOT = Path(__file__).parent.parent
FILES = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
MADE = ("reports/latest", "baseline/")  # by the workflow itself


def steps():
    for file in FILES:
        for job in yaml.safe_load(file.read_text(encoding="utf-8"))["jobs"].values():
            yield from job["steps"]


def scripts():
    return [step["run"] for step in steps() if "run" in step]


def test_it_is_a_workflow():
    (file,) = FILES
    document = yaml.safe_load(file.read_text(encoding="utf-8"))
    # YAML 1.1 reads the word "on" as true.
    assert set(document[True]) == {"push", "pull_request"}
    assert document["permissions"] == {"contents": "read"}
    assert all(("run" in step) != ("uses" in step) for step in steps())


def test_it_runs_only_what_github_itself_publishes():
    uses = [step["uses"] for step in steps() if "uses" in step]
    assert uses
    assert all(re.fullmatch(r"actions/[a-z/-]+@v\d+", use) for use in uses)


def test_what_it_names_is_there():
    text = "\n".join(scripts())
    named = re.findall(r"(?<![\w/.])(?:validation|microsurf|tests|baseline|reports)/[\w./-]+", text)
    mine = [name for name in named if not name.startswith(MADE)]
    assert len(mine) >= 6
    assert [name for name in mine if not (ROOT / name).exists()] == []
    hashed = re.findall(r"hashFiles\('([^']+)'\)", FILES[0].read_text(encoding="utf-8"))
    assert all((ROOT / name).is_file() for name in hashed)
    targets = re.findall(r"\bmake (\w+)", text)
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert targets == [t for t in targets if f"\n{t}:" in makefile] != []


def test_its_models_load(monkeypatch):
    monkeypatch.chdir(ROOT)
    (name,) = re.findall(r"--model (\S+)", "\n".join(scripts()))
    assert model.load_user_brdf(name).name == name


def test_nothing_of_the_event_gets_into_the_shell():
    """What a pull request's author wrote must not become a command: no ${{ }} in a script."""
    assert not [script for script in scripts() if "${{" in script]


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
def test_its_shell_is_shell():
    for script in scripts():
        subprocess.run(["bash", "-n"], input=script, text=True, check=True)  # noqa: S607


def test_its_machines_are_those_of_the_readme():
    (file,) = FILES
    matrix = yaml.safe_load(file.read_text(encoding="utf-8"))["jobs"]["machines"]["strategy"][
        "matrix"
    ]
    for system in ("ubuntu", "macos", "windows"):
        assert any(name.startswith(system) for name in matrix["os"])
    assert matrix["python"] == ["3.11", "3.12", "3.13", "3.14"]  # as texts: 3.10 is 3.1 otherwise
    asked = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert asked["project"]["requires-python"] == f">={matrix['python'][0]}"
