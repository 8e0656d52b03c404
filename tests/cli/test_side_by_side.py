"""Scenes in processes of their own: in their order, with their errors, and none is left behind."""

import signal
import subprocess
import sys
import threading
import time

import children
import forked
import psutil
import pytest

from microsurf.cli import side_by_side

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere nothing is forked")

BEGIN = """
import os, sys, time
from pathlib import Path
from microsurf import memory
from microsurf.cli import interrupt, side_by_side
from microsurf.errors import InputError
from microsurf.files import whole_file
whole = memory.available()
def ran(work, begin=lambda number: None):
    return side_by_side.in_order(work, list("abcd"), 2, begin)
"""
IN_ORDER = """
def work(name, tell):
    tell("waiting")
    time.sleep(1.0 if name == "a" else 0.1)
    return name, os.getpid(), memory.available() < 0.8 * whole
results = list(ran(work))
assert [name for name, _, _ in results] == list("abcd")
assert len({pid for _, pid, _ in results} - {os.getpid()}) == 2
assert all(part for _, _, part in results)  # each takes its part of the memory only
"""
FAILING = """
def work(name, tell):
    if name == "c":
        raise InputError("c is wrong")
    time.sleep(0.3)
    return name
results = []
try:
    for name in ran(work):
        results.append(name)
except InputError as error:
    assert str(error) == "c is wrong" and "in work" in error.__notes__[0]
    assert results == ["a", "b"]
else:
    raise AssertionError
"""
LOST = """
def work(name, tell):
    os._exit(9)
try:
    list(ran(work))
except Exception as error:
    assert "exit code 9" in str(error) and "--resume" in str(error)
else:
    raise AssertionError
"""
ENDLESS = """
def work(name, tell):
    with whole_file(Path(f"{name}.txt")) as temporary:
        temporary.write_text("half")
        tell("half")
        sum(iter(int, 1))  # for ever, and holds the interpreter's lock
def begin(number):
    os.write(1, f"{os.getpid()}\\n".encode())  # in one go: the other writes too
interrupt.arm()
try:
    list(ran(work, begin))
except KeyboardInterrupt:
    interrupt.end()
    sys.exit(130)
"""


UNCHECKED = """
from importlib import import_module
from microsurf.analysis import validate
from microsurf.analysis.self_test import SelfTest
from microsurf.cli import main
from microsurf.report.figures import figure
command = import_module("microsurf.cli.validate")
command.self_test = lambda *_, **__: SelfTest([], None, "2020-01-01 00:00")
validate.WALKS, figure.DPI = 20_000, 50
main()
"""
"""`microsurf` without the minute that checks microsurf itself, with few walks and pixels."""


@pytest.mark.parametrize("code", [IN_ORDER, FAILING, LOST], ids=["order", "error", "lost"])
def test_results_and_errors_come_in_the_order_of_names(code):
    with forked.Child(BEGIN + code) as process:
        assert process.communicate(timeout=120) == ("", "")
    assert process.returncode == 0


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_processes_end_with_the_command_and_leave_nothing(tmp_path, number):
    """Whether it is interrupted or killed, in the middle of a file."""
    with forked.Child(children.LISTEN + BEGIN + ENDLESS, cwd=tmp_path) as process:
        others = [psutil.Process(int(process.stdout.readline())) for _ in range(2)]
        until = time.monotonic() + 60
        while len(list(tmp_path.iterdir())) < 2 and time.monotonic() < until:
            time.sleep(0.05)
        process.send_signal(number)
        _, err = process.communicate(timeout=60)
    assert (process.returncode, err) in [(130, "microsurf: interrupted\n"), (-signal.SIGKILL, "")]
    assert psutil.wait_procs(others, timeout=10)[1] == []
    assert list(tmp_path.iterdir()) == []


def test_a_process_with_threads_is_not_forked():
    """A fork would have none of them, and wait for what they hold."""
    end = threading.Event()
    thread = threading.Thread(target=end.wait)
    thread.start()
    assert not side_by_side.possible()
    end.set()
    thread.join()
    alone = "from microsurf.cli import side_by_side; assert side_by_side.possible()"
    subprocess.run([sys.executable, "-c", alone], check=True)  # noqa: S603 - our own


def test_a_report_has_the_same_bits_with_scenes_side_by_side(tmp_path):
    for name, sigma in (("a", 0.3), ("b", 0)):
        (tmp_path / f"{name}.toml").write_text(
            f"[surface]\ncells = 16\nrealisations = 2\n[light]\ntheta = [60]\n"
            f"[accuracy]\npaths = 2000\n[roughness]\nsigma = {sigma}\n"
        )
    words = ["validate", tmp_path / "a.toml", tmp_path / "b.toml", "--no-refine", "--out"]
    for workers, name in ((1, "alone"), (2, "both")):
        with forked.Child(UNCHECKED, *words, tmp_path / name, "--workers", workers) as process:
            _, err = process.communicate(timeout=600)
        assert (process.returncode, err) == (0, "")
    alone, both = (children.timeless(tmp_path / name / "report.json") for name in ("alone", "both"))
    assert alone == both
    pages = [sorted((tmp_path / name / "figures").iterdir()) for name in ("alone", "both")]
    assert [path.name for path in pages[0]] == [path.name for path in pages[1]]
    for one, other in zip(*pages, strict=True):
        assert one.read_bytes() == other.read_bytes(), one.name
