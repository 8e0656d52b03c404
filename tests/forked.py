"""Processes without the two seconds that Python takes to load what `microsurf` needs.

A server loads it once, in a process that does nothing else, and forks for each child. Such a
child is a process like any other: with its own standard streams, folder, environment, signals
and end, which is the interpreter's own. What Python does as it starts (its own environment
variables, a Ctrl-C or a missing package while libraries load) wants a fresh process.
"""

import atexit
import json
import os
import select
import signal
import socket
import subprocess
import sys
import tempfile
from contextlib import suppress
from functools import cache
from importlib import import_module
from pathlib import Path
from threading import Thread

MAIN = "from microsurf.cli import main; main()"
COMMANDS = ("warm_commands", "microsurf.cli.interrupt")
"""What the command line loads for its commands. It can't draw yet."""


class Child:
    """A forked process, used as one of `subprocess.Popen` with text.

    ``content`` (bytes) is piped into it, ``modules`` are what it finds loaded.
    """

    def __init__(self, code, *words, content=b"", modules=COMMANDS, cwd=None, env=None):
        request = {
            "code": code,
            "argv": ["-c", *map(str, words)],
            "cwd": os.fspath(cwd or Path.cwd()),
            "env": dict(os.environ if env is None else env),
        }
        (read, self._write), *others = (os.pipe() for _ in range(4))
        with tempfile.TemporaryFile() as file:
            file.write(json.dumps(request).encode())
            file.seek(0)
            ends = [read, *(write for _, write in others)]
            socket.send_fds(_server(modules), [b"."], [*ends, file.fileno()])
        for end in ends:
            os.close(end)
        self.stdout, self.stderr, self._status = (
            os.fdopen(end, encoding="utf-8", errors="surrogateescape") for end, _ in others
        )
        Thread(target=self._give, args=(content,), daemon=True).start()
        self.returncode = None
        self.pid = int(self._status.readline())

    def _give(self, content):
        with suppress(BrokenPipeError), os.fdopen(self._write, "wb") as stdin:
            stdin.write(content)

    def poll(self):
        """Exit code, or minus the signal that ended it; None while it runs."""
        return self.wait(0) if self.returncode is None else self.returncode

    def wait(self, timeout=None):
        """Wait for its end, at most so many seconds; None if it still runs then."""
        if self.returncode is None and select.select([self._status], [], [], timeout)[0]:
            self.returncode = os.waitstatus_to_exitcode(int(self._status.readline()))
        return self.returncode

    def send_signal(self, number):
        """Send it a signal, if it has not ended."""
        if self.poll() is None:
            os.kill(self.pid, number)

    def kill(self):
        """End it as a machine ends it that loses power."""
        self.send_signal(signal.SIGKILL)

    def communicate(self, timeout=300):
        """Everything it prints, to its end; killed after so many seconds."""
        texts = {}

        def read(stream):
            texts[stream] = stream.read()

        readers = [Thread(target=read, args=(s,), daemon=True) for s in (self.stdout, self.stderr)]
        for reader in readers:
            reader.start()
        if self.wait(timeout) is None:
            self.kill()
            raise subprocess.TimeoutExpired(str(self.pid), timeout)
        for reader in readers:
            reader.join(timeout)
        return texts[self.stdout], texts[self.stderr]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.wait()
        for stream in (self.stdout, self.stderr, self._status):
            stream.close()


def run(code, *words, timeout=300, **options):
    """Run code to its end: its exit code, and what it printed, as `subprocess.run` has them.

    Where nothing can be forked (Windows) in a fresh process.
    """
    if not hasattr(os, "fork"):
        return _fresh(code, words, timeout, **options)
    with Child(code, *words, **options) as process:
        out, err = process.communicate(timeout)
    return subprocess.CompletedProcess(code, process.returncode, out, err)


def _fresh(code, words, timeout, content=b"", modules=(), **options):
    del modules
    command = [sys.executable, "-c", code, *map(str, words)]
    ran = subprocess.run(  # noqa: S603 - our own
        command, input=content, capture_output=True, check=False, timeout=timeout, **options
    )
    texts = (text.decode(errors="surrogateescape") for text in (ran.stdout, ran.stderr))
    return subprocess.CompletedProcess(command, ran.returncode, *texts)


@cache
def _server(modules):
    """Start a server that has loaded modules: the socket that takes requests."""
    ours, its = socket.socketpair()
    with its:
        server = subprocess.Popen(  # noqa: S603 - our own
            [sys.executable, __file__, str(its.fileno()), *modules], pass_fds=[its.fileno()],
            # As `main` has it, before numpy is loaded: a process with threads is not forked.
            env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
            # Pipes, so that the interpreter makes streams that can be those of children too.
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        )  # fmt: skip

    def end():
        ours.close()
        server.communicate()

    atexit.register(end)
    return ours


def _serve(requests):
    """Fork for each request until there are no more; only children return, with their code."""
    usual = signal.signal(signal.SIGINT, signal.SIG_IGN)
    while True:
        _, ends, *_ = socket.recv_fds(requests, 1, 5)
        with suppress(ChildProcessError):
            while os.waitpid(-1, os.WNOHANG if ends else 0)[0]:
                pass
        if not ends:
            sys.exit()
        if not os.fork():
            break
        for end in ends:
            os.close(end)
    # Here is the child's parent: it tells its id, and at the end how it ended.
    requests.close()
    *streams, status, file = ends
    pid = os.fork()
    if pid:
        for end in streams:
            os.close(end)
        os.write(status, f"{pid}\n".encode())
        os.write(status, f"{os.waitpid(pid, 0)[1]}\n".encode())
        os._exit(0)
    os.close(status)
    for number, end in enumerate(streams):
        os.dup2(end, number)
        os.close(end)
    signal.signal(signal.SIGINT, usual)
    with os.fdopen(file) as text:
        request = json.load(text)
    os.chdir(request["cwd"])
    os.environ.clear()
    os.environ.update(request["env"])
    sys.argv[:] = request["argv"]
    return request["code"]


if __name__ == "__main__":
    for _name in sys.argv[2:]:
        import_module(_name)
    # As a program of its own from here on, to the interpreter's own end.
    exec(_serve(socket.socket(fileno=int(sys.argv[1]))), {"__name__": "__main__"})  # noqa: S102
