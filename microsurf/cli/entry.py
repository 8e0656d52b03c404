"""The command line's entry: gives every error one line and its exit code."""

import os
import signal
import sys
from pathlib import Path
from types import FrameType

import click

from ..errors import MicrosurfError


def main() -> None:
    """Run the command line with its exit codes: every error is one line on stderr."""
    if sys.stderr is None:  # closed by the caller: progress bars can't bear that
        sys.stderr = Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115 - to the end
    # Libraries swallow or misreport a Ctrl-C that meets them while they load: nothing
    # has begun yet, so it ends the process here.
    usual = signal.signal(signal.SIGINT, _stop)
    from .group import cli  # noqa: PLC0415 - loads all of them, hence late

    signal.signal(signal.SIGINT, usual)
    try:
        # Not cli.main(), which prints an empty line of its own at Ctrl-C.
        with cli.make_context("microsurf", sys.argv[1:] or ["--help"]) as context:
            cli.invoke(context)
    except MicrosurfError as error:
        _fail(str(error), error.exit_code)
    except click.exceptions.Exit as done:
        sys.exit(done.exit_code)
    except click.ClickException as error:
        _fail(error.format_message(), 2)
    except (KeyboardInterrupt, click.Abort):
        _fail("interrupted", 130)
    except BrokenPipeError:
        # The reader of --help has gone; or Python complains when it flushes at the end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except (OSError, MemoryError) as error:
        _fail(f"could not finish: {error or 'out of memory'}", 3)


def _stop(_: int, __: FrameType | None) -> None:
    os.write(2, b"microsurf: interrupted\n")
    os._exit(130)


def _fail(message: str, code: int) -> None:
    click.echo("microsurf: " + " ".join(message.split()), err=True)
    sys.exit(code)
