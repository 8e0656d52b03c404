"""Errors that nobody foresaw, and outputs that can't take every letter."""

import errno
import io
import os
import subprocess
import sys
from importlib import import_module

import pytest

from microsurf.cli import entry, exit_codes


@pytest.fixture
def fault(monkeypatch, capsys):
    """Run `microsurf predict` with this error in its middle: its code and what it printed."""

    def run(error):
        def fail(*_, **__):
            raise error

        monkeypatch.setattr(import_module("microsurf.cli.predict").model, "predict", fail)
        asked = "microsurf predict --gamma 2 --sigma 0.5 --json"
        monkeypatch.setattr(sys, "argv", asked.split())
        with pytest.raises(SystemExit) as end:
            entry.main()
        return end.value.code, *capsys.readouterr()

    return run


@pytest.mark.parametrize(
    "error", [ValueError("odd\nthing"), KeyError("x"), RecursionError(), AssertionError()]
)
def test_a_fault_is_3_and_one_line_that_says_where_to_tell(fault, error):
    code, out, err = fault(error)
    assert (code, out) == (3, "")
    assert err.count("\n") == 1
    assert type(error).__name__ in err
    assert "report it" in err
    assert exit_codes.TRACEBACK in err


def test_its_address_is_that_of_the_package(fault, monkeypatch):
    class Metadata:
        def get_all(self, _):
            return ["Home, https://a.example", "Issues, https://b.example/issues"]

    monkeypatch.setattr(exit_codes, "metadata", lambda _: Metadata())
    assert "report it at https://b.example/issues with" in fault(ValueError("x"))[2]


@pytest.mark.parametrize("error", [ValueError("x"), OSError(errno.EIO, "I/O"), MemoryError()])
def test_its_traceback_is_there_on_demand(fault, monkeypatch, error):
    assert "Traceback" not in fault(error)[2]
    monkeypatch.setenv(exit_codes.TRACEBACK, "1")
    code, _, err = fault(error)
    assert code == 3
    assert err.startswith("Traceback")
    assert err.splitlines()[-1].startswith("microsurf: ")


def test_what_fails_while_commands_load_is_one_line():
    code = (
        "import sys\nclass Broken:\n    def find_spec(self, name, *_):\n"
        "        if name == 'microsurf.cli.predict': raise ValueError('broken')\n"
        "sys.meta_path.insert(0, Broken())\nsys.argv = ['microsurf', 'predict', '--help']\n"
        "from microsurf.cli import main\nmain()\n"
    )
    ran = subprocess.run(  # noqa: S603 - our own
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=300, check=False
    )
    assert ran.returncode == 3
    assert ran.stderr.count("\n") == 1
    assert "broken" in ran.stderr


@pytest.mark.parametrize("encoding", ["cp1252", "latin-1", "shift-jis", "utf-8"])
def test_help_is_printed_in_every_encoding(encoding, monkeypatch):
    """As PYTHONIOENCODING has it in the test below."""
    printed = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(printed, encoding))
    monkeypatch.setattr(sys, "argv", ["microsurf", "measure", "--help"])
    with pytest.raises(SystemExit) as end:
        entry.main()
    assert not end.value.code
    sys.stdout.flush()
    text = printed.getvalue().decode(encoding)
    assert ("γ" if encoding in {"shift-jis", "utf-8"} else "gamma") in text
    assert "\\u" not in text


NAME = "γ\udcff²⌘.toml"  # the second is a byte that is no letter


def test_an_error_names_letters_that_the_terminal_lacks():
    ran = subprocess.run(  # noqa: S603 - our own
        [sys.executable, "-c", "from microsurf.cli import main; main()", "measure", NAME],
        capture_output=True, timeout=300, check=False,
        env={**os.environ, "PYTHONIOENCODING": "cp1252"},
    )  # fmt: skip
    assert ran.returncode == 2
    assert ran.stderr.startswith("microsurf: gamma?²?.toml".encode("cp1252"))
    assert ran.stderr.count(b"\n") == 1
