"""Forked children are processes like others: streams, exit codes, signals, folder, environment."""

import os
import signal

import forked
import pytest

TELL = """
import os, sys, threading
from pathlib import Path
print(sys.argv, os.getcwd(), os.environ["TOLD"], threading.active_count(), sys.stdin.read())
print("γ", file=sys.stderr)
"""


@pytest.mark.parametrize("forks", [True, False])
def test_streams_words_folder_and_environment(tmp_path, monkeypatch, forks):
    if not forks:
        monkeypatch.delattr(os, "fork")
    content = b"x" * 200_000  # more than a pipe holds
    ran = forked.run(TELL, "a", 1, content=content, cwd=tmp_path, env={**os.environ, "TOLD": "e"})
    assert ran.stdout == f"['-c', 'a', '1'] {tmp_path} e 1 {content.decode()}\n"
    assert (ran.returncode, ran.stderr) == (0, "γ\n")


@pytest.mark.parametrize(
    ("code", "ends"),
    [("import sys; sys.exit(7)", 7), ("1 / 0", 1), ("import os; os.abort()", -signal.SIGABRT)],
)
def test_it_ends_as_an_interpreter_does(code, ends):
    ran = forked.run(code)
    assert ran.returncode == ends
    assert ran.stderr.startswith("Traceback") == (ends == 1)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_signals_reach_it_and_it_alone(number):
    with forked.Child("import time; print(1, flush=True); time.sleep(100)") as process:
        assert process.stdout.readline() == "1\n"
        assert process.poll() is None
        process.send_signal(number)
        assert process.communicate() == ("", "")
    assert process.returncode == -number
    assert forked.run("print(2)").stdout == "2\n"  # the server serves on
