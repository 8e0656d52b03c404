"""What a shell hands down changes and breaks nothing."""

import os

import forked
import pytest

from microsurf.cli import group

NOTEBOOK = "module://no_such_module.backend_inline"


def run(folder, *arguments, **environment):
    """Run a command in its own process and folder, with these variables beside the usual.

    What it forks has not loaded matplotlib, whose variables they are.
    """
    return forked.run(forked.MAIN, *arguments, cwd=folder, env=os.environ | environment)


@pytest.fixture(scope="module")
def prediction(tmp_path_factory):
    """A folder with a small result, and its figure in an environment without anything odd."""
    folder = tmp_path_factory.mktemp("result")
    for asked in (
        "predict --gamma 2 --sigma 0.5 --theta 40 --out smith.nc",
        "plot smith.nc --out plain.svg",
    ):
        ran = run(folder, *asked.split())
        assert (ran.returncode, ran.stderr) == (0, "")
    return folder


def test_commands_that_draw_nothing_load_nothing_to_draw_with():
    """Nor has what the commands here are forked from, which has loaded the same.

    Nor `scipy.stats`, a fifth of a second for what `scipy.special` has too.
    """
    ran = forked.run("import sys; print(*sys.modules)")
    loaded = {*ran.stdout.split()}
    assert {f"microsurf.cli.{name}" for name in group.COMMANDS} <= loaded
    assert not {"matplotlib", "scipy.stats"} & loaded


@pytest.mark.parametrize("command", ["--version", "plot smith.nc --out lobes.svg"])
def test_the_backend_of_a_notebook_breaks_no_command(prediction, command):
    ran = run(prediction, *command.split(), MPLBACKEND=NOTEBOOK)
    assert (ran.returncode, ran.stderr) == (0, "")


GARBAGE = b"""text.usetex: True
axes.facecolor: red
font.size: 30
savefig.bbox: tight
backend: nonsense
figure.dpi: minus one
no.such.key: 3
this line is not one
"""


@pytest.mark.parametrize("text", [GARBAGE, "font.family: café".encode("latin-1")])
def test_a_matplotlibrc_changes_no_figure(prediction, tmp_path, text):
    """Nor is it mentioned: of one in Latin-1 the import of matplotlib ended in a traceback."""
    (tmp_path / "matplotlibrc").write_bytes(text)
    rc = {"MATPLOTLIBRC": str(tmp_path / "matplotlibrc")}
    ran = run(prediction, "plot", "smith.nc", "--out", "odd.svg", **rc)
    assert (ran.returncode, ran.stderr) == (0, "")
    assert (prediction / "odd.svg").read_bytes() == (prediction / "plain.svg").read_bytes()


def test_a_matplotlibrc_in_this_folder_changes_no_figure(prediction, tmp_path):
    """There matplotlib finds it before any other; in Latin-1 it is refused."""
    (tmp_path / "smith.nc").write_bytes((prediction / "smith.nc").read_bytes())
    (tmp_path / "matplotlibrc").write_bytes(GARBAGE)
    ran = run(tmp_path, "plot", "smith.nc", "--out", "odd.svg")
    assert (ran.returncode, ran.stderr) == (0, "")
    assert (tmp_path / "odd.svg").read_bytes() == (prediction / "plain.svg").read_bytes()
    (tmp_path / "matplotlibrc").write_bytes("font.family: café".encode("latin-1"))
    ran = run(tmp_path, "plot", "smith.nc", "--out", "none.svg")
    assert ran.returncode == 2
    assert ran.stderr.startswith("microsurf: matplotlibrc: is not text in UTF-8")
    assert ran.stderr.count("\n") == 1
    assert not (tmp_path / "none.svg").exists()


def test_a_home_where_nothing_can_be_written_is_not_mentioned(prediction, tmp_path):
    """matplotlib says so in two lines; a file in the place of a folder can't be written to."""
    (tmp_path / "home").write_text("")
    homes = {name: str(tmp_path / "home") for name in ("HOME", "XDG_CONFIG_HOME", "XDG_CACHE_HOME")}
    ran = run(prediction, "plot", "smith.nc", "--out", "homeless.svg", **homes)
    assert (ran.returncode, ran.stderr) == (0, "")
