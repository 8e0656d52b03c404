"""A real browser, driven over a pipe by Chrome's own protocol: no driver, no port, no library."""

import base64
import json
import os
import select
import shutil
import signal
import tempfile
import time
from contextlib import suppress

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
OPTIONS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run",
    "--disable-extensions", "--disable-background-networking", "--remote-debugging-pipe",
)  # fmt: skip


def installed():
    """Path of a Chromium or Chrome, or None."""
    return next(filter(None, map(shutil.which, NAMES)), None) if os.name == "posix" else None


class Browser:
    """One page of a headless browser; errors of the page's scripts are kept in ``faults``."""

    def __init__(self):
        self.faults = []
        self._number, self._unread = 0, b""
        self._profile = tempfile.mkdtemp(prefix="browser")
        theirs_in, self._out = os.pipe()
        self._in, theirs_out = os.pipe()
        # The protocol speaks on descriptors 3 and 4. High ones first, so that none is hit.
        high = [os.dup2(pipe, 60 + k) for k, pipe in enumerate((theirs_in, theirs_out))]
        silent = os.open(os.devnull, os.O_WRONLY)
        self._pid = os.posix_spawn(
            installed(),
            [installed(), *OPTIONS, f"--user-data-dir={self._profile}"],
            os.environ,
            file_actions=[
                (os.POSIX_SPAWN_DUP2, silent, 2),
                (os.POSIX_SPAWN_DUP2, high[0], 3),
                (os.POSIX_SPAWN_DUP2, high[1], 4),
            ],
            setpgroup=0,
        )
        for descriptor in (theirs_in, theirs_out, silent, *high):
            os.close(descriptor)
        target = self._send("Target.createTarget", url="about:blank")["targetId"]
        attached = self._send("Target.attachToTarget", targetId=target, flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime"):
            self.send(f"{domain}.enable")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        with suppress(ProcessLookupError):
            os.killpg(self._pid, signal.SIGKILL)
        os.waitpid(self._pid, 0)
        os.close(self._in)
        os.close(self._out)
        shutil.rmtree(self._profile, ignore_errors=True)

    def send(self, method, **parameters):
        """Do something in the page and wait for the answer."""
        return self._send(method, self._session, **parameters)

    def _send(self, method, session=None, **parameters):
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        if session is not None:
            message["sessionId"] = session
        os.write(self._out, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._read()
            if answer.get("id") == self._number:
                assert "error" not in answer, (method, answer)
                return answer["result"]

    def _read(self):
        while b"\0" not in self._unread:
            readable, _, _ = select.select([self._in], [], [], 60)
            assert readable, "the browser says nothing"
            part = os.read(self._in, 1 << 16)
            assert part, "the browser ended"
            self._unread += part
        text, _, self._unread = self._unread.partition(b"\0")
        answer = json.loads(text)
        if answer.get("method") == "Runtime.exceptionThrown":
            self.faults.append(answer["params"]["exceptionDetails"])
        return answer

    def open(self, path, width=1200, height=900):
        """Open a file in a window of so many pixels and wait until it is loaded."""
        self.send(
            "Emulation.setDeviceMetricsOverride",
            width=width, height=height, deviceScaleFactor=1, mobile=False,
        )  # fmt: skip
        self.send("Page.navigate", url=path.as_uri())
        loaded = "location.href.split('#')[0] + document.readyState"
        deadline = time.monotonic() + 30
        while self.run(loaded) != f"{path.as_uri()}complete":
            assert time.monotonic() < deadline, "the page does not load"

    def run(self, script):
        """Value of an expression in the page; a promise is waited for."""
        answer = self.send(
            "Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True
        )
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def press(self, key, code):
        """Press a key that writes nothing, as a hand does."""
        for kind in ("rawKeyDown", "keyUp"):
            self.send(
                "Input.dispatchKeyEvent", type=kind, key=key, code=key,
                windowsVirtualKeyCode=code,
            )  # fmt: skip

    def picture(self, path):
        """Write a picture of the whole page."""
        shot = self.send("Page.captureScreenshot", captureBeyondViewport=True)
        path.write_bytes(base64.b64decode(shot["data"]))
