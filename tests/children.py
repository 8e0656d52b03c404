"""Commands as processes of their own, to be interrupted."""

import json
import subprocess
import sys
import time
from contextlib import suppress

import forked
import psutil

LISTEN = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
"""Takes Ctrl-C as usual.

A shell without job control has what it puts into the background ignore SIGINT, and
whatever that starts: `make test` in a script, and a test's children.
"""


def start(*words, **options):
    """Start `microsurf` so that it can be interrupted, wherever the tests were started."""
    return forked.Child(LISTEN + forked.MAIN, *words, **options)


def python(code, *words, **options):
    """Start a fresh Python with code, its standard output and error to be read."""
    return subprocess.Popen(  # noqa: S603 - our own
        [sys.executable, "-c", code, *map(str, words)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options,
    )  # fmt: skip


def wait_for_work(process, seconds):
    """Wait until a process has used so many seconds of processor time."""
    begin = time.monotonic()
    with suppress(psutil.Error):
        while process.poll() is None and time.monotonic() - begin < 120:
            times = psutil.Process(process.pid).cpu_times()
            if times.user + times.system >= seconds:
                return
            time.sleep(0.05)


def timeless(path):
    """A report without how long its parts took and the command, which names the folder."""
    report = json.loads(path.read_text())
    del report["command"]
    for scene in report["scenes"]:
        del scene["seconds"], scene["measured"]["tracing_seconds"]
    return report
