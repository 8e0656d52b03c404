"""Gives every error of a command one line and its exit code."""

import codecs
import logging
import os
import signal
import sys
import traceback
import unicodedata
from importlib.metadata import PackageNotFoundError, metadata
from pathlib import Path
from typing import Any, NoReturn

import click

from ..errors import MicrosurfError
from . import missing

TRACEBACK = "MICROSURF_TRACEBACK"
"""Environment variable: if it is set, errors print their traceback first."""


def run(usual: Any) -> None:
    """Run the command line with its exit codes: every error is one line on stderr.

    ``usual`` is what SIGINT did before `main`, which the commands get back.
    """
    if sys.stderr is None:  # closed by the caller: progress bars can't bear that
        sys.stderr = Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115 - to the end
    _print_anywhere()
    _own_matplotlib()
    try:
        from . import interrupt  # noqa: PLC0415 - late: it loads LLVM
        from .group import cli  # noqa: PLC0415 - late: so that its errors are met here

        words = sys.argv[1:] or ["--help"]
        # The command is the first word that is no option. Loaded before Ctrl-C is its own.
        cli.commands.get(next((word for word in words if not word.startswith("-")), ""))
        signal.signal(signal.SIGINT, usual)
        # Not cli.main(), which prints an empty line of its own at Ctrl-C.
        with cli.make_context("microsurf", words) as context:
            interrupt.arm()
            try:
                cli.invoke(context)
            finally:
                interrupt.disarm()
    except MicrosurfError as error:
        _fail(str(error), error.exit_code)
    except click.exceptions.Exit as done:
        sys.exit(done.exit_code)
    except click.ClickException as error:
        _fail(error.format_message(), 2)
    except (KeyboardInterrupt, click.Abort):
        interrupt.end()
        sys.exit(130)
    except BrokenPipeError:
        # The reader of --help has gone; or Python complains when it flushes at the end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except (OSError, MemoryError) as error:
        _fail(f"could not finish: {error or 'out of memory'}", 3)
    except Exception as error:  # noqa: BLE001 - 1, as Python ends, would mean a verdict
        absent = missing.sentence(error) if isinstance(error, ImportError) else None
        if absent:
            _fail(absent, 3)
        what = ": ".join(filter(None, (type(error).__name__, str(error))))
        _fail(f"fault in microsurf ({what[:300]}); please report it{_where()}", 3)


def _own_matplotlib() -> None:
    """Let matplotlib load, and say nothing, whatever the shell and the home hand down to it."""
    # Of notebooks, whose module is often missing where this runs.
    os.environ.pop("MPLBACKEND", None)
    # One that is not in UTF-8 would end the command; figures have their own style in any case.
    os.environ["MATPLOTLIBRC"] = os.devnull
    # It complains about a home where it can't write, and about a matplotlibrc in this folder.
    logging.getLogger("matplotlib").setLevel(logging.ERROR)


def _where() -> str:
    """Where faults are reported, and how to see more of this one."""
    trace = f"with what {TRACEBACK}=1 prints before this line"
    try:
        links = metadata("microsurf").get_all("Project-URL") or []
    except PackageNotFoundError:
        links = []
    for link in links:
        name, _, address = link.partition(", ")
        if name == "Issues":
            return f" at {address} {trace}"
    return f" {trace}"


def _print_anywhere() -> None:
    """Let γ, ≥ and odd file names be printed whatever the terminal or file can take."""
    codecs.register_error("microsurf", _spelled)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="microsurf")


_SPELLED = str.maketrans(
    {"−": "-", "–": "-", "≤": "<=", "≥": ">=", "→": "->", "·": "*", "×": "x", "√": "sqrt",
     "∞": "inf", "°": " deg", "’": "'", "✓": "ok", "━": "-"}
)  # fmt: skip


def _spelled(error: UnicodeError) -> tuple[str, int]:
    """Spell letters that an encoding lacks: gamma for γ, 2 for ², ? where nothing is like it."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    spelled = ""
    for letter in error.object[error.start : error.end]:
        name = unicodedata.name(letter, "")
        plain = unicodedata.normalize("NFKD", letter.translate(_SPELLED))
        if name.startswith("GREEK SMALL LETTER "):
            spelled += name.split()[3].lower()
        else:
            spelled += plain.encode("ascii", "ignore").decode() or "?"
    return spelled, error.end


def _fail(message: str, code: int) -> NoReturn:
    if os.environ.get(TRACEBACK):
        traceback.print_exc()
    click.echo("microsurf: " + " ".join(message.split()), err=True)
    sys.exit(code)
