"""What a shell hands down changes and breaks nothing."""

import os
import subprocess
import sys

import pytest

MICROSURF = "from microsurf.cli import main; main()"
NOTEBOOK = "module://no_such_module.backend_inline"


def run(folder, *arguments, **environment):
    """Run a command in its own process and folder, with these variables beside the usual."""
    return subprocess.run(  # noqa: S603 - ourselves
        [sys.executable, "-c", MICROSURF, *arguments], cwd=folder, check=False, text=True,
        env=os.environ | environment, capture_output=True, encoding="utf-8",
    )  # fmt: skip


@pytest.fixture(scope="module")
def prediction(tmp_path_factory):
    """A folder with a small result."""
    folder = tmp_path_factory.mktemp("result")
    asked = "predict --gamma 2 --sigma 0.5 --theta 40 --out smith.nc"
    ran = run(folder, *asked.split())
    assert ran.returncode == 0, ran.stderr
    return folder


def test_commands_that_draw_nothing_load_nothing_to_draw_with():
    code = "import sys, microsurf.cli.group; sys.exit('matplotlib' in sys.modules)"
    ran = subprocess.run([sys.executable, "-c", code], check=False)  # noqa: S603 - ourselves
    assert ran.returncode == 0


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
    for rc, out in ({}, "plain.svg"), ({"MATPLOTLIBRC": str(tmp_path / "matplotlibrc")}, "odd.svg"):
        ran = run(prediction, "plot", "smith.nc", "--out", out, **rc)
        assert (ran.returncode, ran.stderr) == (0, "")
    assert (prediction / "odd.svg").read_bytes() == (prediction / "plain.svg").read_bytes()


def test_a_matplotlibrc_in_this_folder_changes_no_figure(prediction, tmp_path):
    """There matplotlib finds it before any other; in Latin-1 it is refused."""
    (tmp_path / "smith.nc").write_bytes((prediction / "smith.nc").read_bytes())
    assert run(tmp_path, "plot", "smith.nc", "--out", "plain.svg").returncode == 0
    (tmp_path / "matplotlibrc").write_bytes(GARBAGE)
    ran = run(tmp_path, "plot", "smith.nc", "--out", "odd.svg")
    assert (ran.returncode, ran.stderr) == (0, "")
    assert (tmp_path / "odd.svg").read_bytes() == (tmp_path / "plain.svg").read_bytes()
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
