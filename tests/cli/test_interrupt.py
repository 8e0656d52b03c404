"""Ctrl-C ends a command at once, whatever it is at: 130, one line, no half file."""

import signal
import subprocess
import sys
import time

import children
import forked
import pytest

from microsurf.cli import interrupt

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no alarm")

ROUGH = ("--gamma", "1.75", "--sigma", "0.5")
ANGLES = ",".join(f"{k * 2.7:.1f}" for k in range(32))
SECONDS = 2
BUSY = 3
"""Seconds more that a machine may need which does other things besides."""

HOLDING = """
import itertools
from pathlib import Path
from microsurf.cli import interrupt
from microsurf.files import whole_file
interrupt.arm()
with whole_file(Path("other.txt")):
    pass
with whole_file(Path("half.txt")) as temporary:
    temporary.write_text("half")
    print(temporary.is_file(), flush=True)
    sum(itertools.repeat(1, 10**11))  # minutes, without a look at signals or at other threads
"""


@pytest.mark.parametrize("presses", [1, 2])
@pytest.mark.parametrize(
    ("words", "work"),
    [
        pytest.param(("surface", *ROUGH, "--cells", "3072", "--out", "s.npz"), 0.6, id="surface"),
        pytest.param(("predict", *ROUGH, "--theta", ANGLES), 1, id="predict"),
    ],
)
def test_long_stages_end_at_once(tmp_path, words, work, presses):
    """A slow surface took half a minute to answer, 32 angles 17 s."""
    with children.start(*words, cwd=tmp_path) as process:
        try:
            children.wait_for_work(process, work)
            begin = time.monotonic()
            for _ in range(presses):
                process.send_signal(signal.SIGINT)
                time.sleep(0.2)
            _, err = process.communicate(timeout=300)
        finally:
            process.kill()
    assert time.monotonic() - begin < SECONDS + BUSY
    assert (process.returncode, err) == (130, "microsurf: interrupted\n")
    assert list(tmp_path.iterdir()) == []


def test_what_holds_the_interpreters_lock_ends_too(tmp_path):
    """As Embree does while it takes a mesh."""
    with forked.Child(children.LISTEN + HOLDING, cwd=tmp_path) as process:
        try:
            assert process.stdout.readline() == "True\n"
            time.sleep(1)  # until it is in there
            begin = time.monotonic()
            process.send_signal(signal.SIGINT)
            _, err = process.communicate(timeout=300)
        finally:
            process.kill()
    assert time.monotonic() - begin < SECONDS + BUSY
    assert (process.returncode, err) == (130, "microsurf: interrupted\n")
    assert [path.name for path in tmp_path.iterdir()] == ["other.txt"]


SWALLOWING = """
import signal, time
from microsurf.cli import interrupt

class Swallows:  # as LLVM's objects do, which numba drops all the time
    def __del__(self):
        signal.raise_signal(signal.SIGINT)

class Odd:
    def __del__(self):
        raise ValueError("told")

interrupt.arm()
Odd()
Swallows()
time.sleep(100)
"""


def test_a_destructor_that_swallows_it_says_nothing(tmp_path):
    """Python printed `Exception ignored in …` and a traceback; other exceptions are still told."""
    begin = time.monotonic()
    with forked.Child(children.LISTEN + SWALLOWING, cwd=tmp_path) as process:
        _, err = process.communicate(timeout=300)
    assert time.monotonic() - begin < SECONDS + BUSY
    assert process.returncode == 130
    assert "ValueError: told" in err
    assert "KeyboardInterrupt" not in err
    assert err.endswith("microsurf: interrupted\n")


ENDING = """
import os, signal
from microsurf.cli import interrupt

class Press:  # while Python takes down its modules, when its own handlers are gone
    def __del__(self, kill=os.kill, here=os.getpid(), number=signal.SIGINT):
        kill(here, number)

interrupt.arm()
interrupt.disarm()
last = Press()
"""


def test_a_press_after_the_end_changes_nothing(tmp_path):
    """All was written, and yet the process ended by the signal."""
    with forked.Child(children.LISTEN + ENDING, cwd=tmp_path) as process:
        _, err = process.communicate(timeout=300)
    assert (process.returncode, err) == (0, "")


IGNORED = """
import signal, sys
signal.signal(signal.SIGINT, signal.SIG_IGN)

class Press:  # while the commands load
    def find_spec(self, name, *_):
        if name == "microsurf.cli.predict":
            signal.raise_signal(signal.SIGINT)

sys.meta_path.insert(0, Press())
sys.argv = ["microsurf", "predict", "--help"]
from microsurf.cli import main
main()
"""


def test_who_ignores_it_goes_on_ignoring_it(tmp_path):
    """What a script has put into the background is not ended by Ctrl-C at the terminal."""
    ran = subprocess.run(  # noqa: S603 - our own
        [sys.executable, "-c", IGNORED], capture_output=True, text=True, timeout=300, check=False,
        cwd=tmp_path,
    )  # fmt: skip
    assert (ran.returncode, ran.stderr) == (0, "")
    assert "Usage: microsurf predict" in ran.stdout


LOADING = """
import signal, sys

class Press:
    def find_spec(self, name, *_):
        if name == late:
            signal.raise_signal(signal.SIGINT)

late = sys.argv.pop()
sys.meta_path.insert(0, Press())
from microsurf.cli import main
loaded = {"click", "importlib.metadata", "numpy"} & set(sys.modules)
sys.stdout.write(f"{loaded}")
sys.stdout.flush()
main()
"""


@pytest.mark.parametrize(
    ("word", "late"),
    [("--version", "click"), ("predict", "microsurf.cli.predict"), ("plot", "xarray")],
    ids=["the first of the libraries", "a command", "what it needs"],
)
def test_it_is_taken_while_anything_is_loaded(tmp_path, word, late):
    """One press in three within the first second ended in a traceback."""
    with children.python(children.LISTEN + LOADING, word, late, cwd=tmp_path) as process:
        out, err = process.communicate(timeout=300)
    assert (process.returncode, out, err) == (130, "set()", "microsurf: interrupted\n")


def test_it_is_pythons_again_after_a_command():
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    interrupt.arm()
    interrupt.disarm()
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    signal.signal(signal.SIGINT, before)
