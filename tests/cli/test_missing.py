"""A package that is not installed is named in one line, with what to do; it is no fault of ours."""

import subprocess
import sys

import pytest

from microsurf.cli import missing

HIDE = """
import sys
class Hide:
    def find_spec(self, name, path=None, target=None):
        if name.partition('.')[0] == {name!r}:
            raise ModuleNotFoundError(f'No module named {{name!r}}', name=name)
sys.meta_path.insert(0, Hide())
from microsurf.cli import main
sys.argv = ['microsurf', *{words!r}]
main()
"""


def without(module, *words):
    """Run `microsurf --help`, or that of a command, where a module is not found."""
    return subprocess.run(  # noqa: S603 - our own
        [sys.executable, "-c", HIDE.format(name=module, words=[*words, "--help"])],
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize(
    ("module", "asked"), [("click", "click>="), ("numba", "numba>="), ("tomli_w", "tomli-w>=")]
)
def test_a_missing_package_is_one_line_that_says_what_to_install(module, asked):
    done = without(module, "surface")
    assert (done.returncode, done.stdout) == (3, "")
    assert done.stderr.count("\n") == 1
    assert done.stderr.startswith(f"microsurf: needs {module}, which is not installed; do `pip ")
    assert f'pip install "{asked}' in done.stderr


def test_a_package_that_help_does_not_need_is_not_missed():
    """Negative control; nor is what only commands need, which `--help` alone does not load."""
    assert without("mitsuba", "surface").returncode == 0
    assert without("scipy").returncode == 0


@pytest.mark.parametrize("name", ["microsurf.model.none", "microsurf", "", None])
def test_a_module_of_ours_that_is_missing_is_a_fault(name):
    assert missing.sentence(ModuleNotFoundError("x", name=name)) is None


def test_a_missing_backend_is_found_in_the_words_of_who_misses_it():
    error = ImportError("No module named 'h5py', backend not available. Please install 'h5py'.")
    assert (
        missing.sentence(error)
        == 'needs h5py, which is not installed; do `pip install "h5py>=3.11"`'
    )


def test_a_module_that_is_there_but_lacks_a_name_is_a_fault():
    error = ImportError("cannot import name 'x' from 'numba'", name="numba")
    assert missing.sentence(error) is None


@pytest.mark.parametrize(
    ("module", "package"),
    [("PIL.Image", "pillow>=11"), ("odd_name.inner", "odd_name"), ("h5netcdf", "h5netcdf>=1.6")],
)
def test_packages_are_called_as_they_are_installed(module, package):
    said = missing.sentence(ModuleNotFoundError("x", name=module))
    assert said is not None
    assert said.endswith(f'do `pip install "{package}"`')
