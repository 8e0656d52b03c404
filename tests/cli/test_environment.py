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


def test_a_matplotlibrc_changes_no_figure(prediction, tmp_path):
    (tmp_path / "matplotlibrc").write_text(
        "text.usetex: True\naxes.facecolor: red\nfont.size: 30\nsavefig.bbox: tight\n"
    )
    for rc, out in ({}, "plain.svg"), ({"MATPLOTLIBRC": str(tmp_path / "matplotlibrc")}, "odd.svg"):
        ran = run(prediction, "plot", "smith.nc", "--out", out, **rc)
        assert (ran.returncode, ran.stderr) == (0, "")
    assert (prediction / "odd.svg").read_bytes() == (prediction / "plain.svg").read_bytes()
