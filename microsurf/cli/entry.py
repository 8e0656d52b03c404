"""The command line's entry: answers Ctrl-C from the first moment, so it loads nothing itself."""

import os
import signal
import sys


def main() -> None:
    """Run the command line with its exit codes: every error is one line on stderr."""
    # numpy's matrices are small here, and a product that waits for a second thread of its own
    # took up to 50 ms instead of 0.1 where cores are busy with rays. Read as numpy is loaded.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # Libraries swallow or misreport a Ctrl-C that meets them while they load: nothing
    # has begun yet, so it ends the process here. Whoever ignores it goes on ignoring it.
    usual = signal.getsignal(signal.SIGINT)
    if usual is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, _stop)
    try:
        from .exit_codes import run  # noqa: PLC0415 - late: half of the time that --version takes
    except ImportError as error:  # click itself
        from .missing import sentence  # noqa: PLC0415 - late, as it is needed here only

        what = sentence(error)
        if what is None:
            raise
        sys.stderr.write(f"microsurf: {what}\n")
        sys.exit(3)
    run(usual)


def _stop(*_: object) -> None:
    os.write(2, b"microsurf: interrupted\n")
    os._exit(130)
