"""A run that can be stopped: what is finished is stored by stages, and taken up again.

`Run` is the folder DIR/unfinished, for one process at a time. Each computation in it (a
scene with its seed and options) has a key, in which are also the sources of microsurf and
the versions of what computes. What fits no key is not found, and made again.
"""

import hashlib
import json
import re
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from ..errors import InputError, MicrosurfError
from ..scene import Scene
from ..surface import substrate_digest
from ..trace.checkpoint import claim
from .stored import load, save
from .versions import state_of_the_code

if TYPE_CHECKING:
    from filelock import FileLock

T = TypeVar("T")

FOLDER = "unfinished"
_LOCK = "lock"
_FILE = re.compile(r"[0-9a-f]{24}-[a-z0-9-]{1,40}\.npz|\.[0-9a-f]{12}\.npz")
"""Of a stage, and of one that a killed run was writing."""


class Stages:
    """The stages of one computation; kept nowhere without a folder.

    ``seconds`` is what they took, in this run or before; ``taken_up`` how many were there.
    ``tell`` is called with the name of each as it begins.
    """

    def __init__(self, folder: Path | None = None, key: str = "") -> None:
        self._folder, self._key = folder, key
        self.tell: Callable[[str], None] | None = None
        self.seconds = 0.0
        self.taken_up = 0

    def done(self, name: str, make: Callable[[], T]) -> T:
        """Give what a stage came to: read if it was finished, else made and stored.

        What is made must consist of what `stored` can hold. Raises MicrosurfError if there
        is no room for it.
        """
        path = None if self._folder is None else self._folder / f"{self._key[:24]}-{name}.npz"
        stored_result = None if path is None else load(path, self._key)
        if stored_result is not None:
            value, seconds = stored_result[0]
            self.taken_up += 1
        else:
            if self.tell is not None:
                self.tell(name)
            begin = time.perf_counter()
            value = make()
            seconds = time.perf_counter() - begin
            if path is not None:
                try:
                    save(path, self._key, (value, seconds))
                except InputError as error:  # it could be written when the run began
                    raise MicrosurfError(str(error)) from error
        self.seconds += seconds
        result: T = value
        return result


class Run:
    """The folder of a run's finished stages, in that of what it writes.

    Without ``resume`` what an earlier run left there is removed, and all is done again.

    Raises
    ------
    InputError
        If another process is at it, or it can't be made or read.

    """

    def __init__(self, out: Path, *, resume: bool) -> None:
        self._folder = out / FOLDER
        self._lock: FileLock | None = None
        try:
            self._folder.mkdir(exist_ok=True)
            self._lock = claim(self._folder / _LOCK)
            if not resume:
                self._clear()
        except OSError as error:
            raise InputError(
                f"{self._folder}: can't be a folder for finished stages ({error.strerror}); "
                "remove it or choose another place"
            ) from error

    def stages(self, **what: Any) -> Stages:
        """Stages of one computation, distinguished from others by values that JSON can hold."""
        text = json.dumps([state_of_the_code(), what], sort_keys=True)
        return Stages(self._folder, hashlib.sha256(text.encode()).hexdigest())

    def of_scene(self, scene: Scene, **what: Any) -> Stages:
        """Stages of a scene, whose files are known by their content, and of further values."""
        file = scene.surface.file
        content = None if file is None else hashlib.sha256(Path(file).read_bytes()).hexdigest()
        under = substrate_digest(scene)
        more = {} if under is None else {"substrate": under}
        return self.stages(scene=scene.to_toml(), file=content, **more, **what)

    def finish(self) -> None:
        """Remove the stages, once what they were for is safe; what is not ours is left there."""
        if self._lock is None:
            return
        with suppress(OSError):  # what can't be removed is found by nobody
            self._clear()
            self._lock.release()
            (self._folder / _LOCK).unlink(missing_ok=True)
            self._folder.rmdir()
        self._lock = None

    def _clear(self) -> None:
        for path in self._folder.iterdir():
            if _FILE.fullmatch(path.name):
                path.unlink()
