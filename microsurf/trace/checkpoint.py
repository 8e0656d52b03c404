"""Finished work items on disk, each written whole or not at all, so that a killed run goes on.

A stream's work items (one angle on one realisation) are put together as they add up: the file
of its first one then stands for the first ``count`` of them. What is there is believed
only if it belongs to this run and its checksum is right; else it is traced again.
"""

import errno
import hashlib
import json
import logging
import shutil
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from filelock import FileLock, Timeout
from numpy.typing import NDArray

from .. import __version__
from ..errors import InputError, MicrosurfError
from ..files import whole_file
from ..scene import Scene
from ..surface import substrate_digest
from .engine import engine_of
from .scheduler import Stream
from .wavefront import Tally
from .work_items import PATHS_PER_ITEM, Realisation, WorkItem

TOGETHER = 32
"""So many work items of a stream at most lie about singly."""

RESULT = "result.nc"
"""Name of the whole result while it is written."""
_RUN, _LOCK = "run.json", "lock"
_NO_LOCKS = {errno.ENOSYS, errno.ENOLCK, errno.EINVAL, errno.ENOTSUP, errno.EOPNOTSUPP}
"""What a file system answers that has none: Lustre and NFS as they are often mounted."""
_ITEMS = "[0-9]*-[0-9]*-[0-9]*.npz"


class Checkpoint:
    """A folder of finished work items of one run, for one process at a time.

    Raises
    ------
    InputError
        If it holds work items and ``resume`` is false, those of another run, or other files;
        if another process is at it, or it can't be made or read.

    """

    def __init__(
        self,
        folder: Path,
        scene: Scene,
        realisations: Sequence[Realisation] | None,
        seed: int,
        *,
        resume: bool,
        item_paths: int | None = None,
    ) -> None:
        self._folder = folder
        run = {
            "microsurf": __version__,
            "item_paths": PATHS_PER_ITEM if item_paths is None else item_paths,
            "tally": [f.name for f in fields(Tally)],
            "seed": seed,
            "scene": scene.to_toml(),
            "engine": engine_of(scene),
            "substrate": substrate_digest(scene),
            "surfaces": None
            if realisations is None
            else [realisation.name for realisation in realisations],
        }
        self._run = hashlib.sha256(json.dumps(run).encode()).hexdigest()
        self._together: dict[tuple[int, int], int] = {}
        note = folder / _RUN
        try:
            folder.mkdir(exist_ok=True)
            self._lock = claim(folder / _LOCK)
        except OSError as error:
            raise InputError(
                f"{folder}: can't be a folder for finished work items ({error.strerror}); "
                "remove it or choose another place"
            ) from error
        try:
            self._check(note, resume=resume)
            with whole_file(note) as temporary:
                temporary.write_text(json.dumps({"run": self._run, **run}, indent=1), "utf-8")
        except BaseException:
            self.close()
            raise

    def _check(self, note: Path, *, resume: bool) -> None:
        ours = {path.name for path in self._folder.glob(_ITEMS)}
        others = {path.name for path in self._folder.iterdir()} - ours - {_RUN, _LOCK, RESULT}
        # What a killed run was writing begins with a point.
        foreign = sorted(name for name in others if not name.startswith("."))
        if foreign:
            raise InputError(
                f"{self._folder}: holds {foreign[0]}, which is no work item of a run; "
                "move it elsewhere or choose another place"
            )
        if ours and not resume:
            raise InputError(
                f"{self._folder}: holds finished work items of a run that was not finished; "
                "add --resume to go on with it, or remove the folder to begin again"
            )
        if ours and _read(note) != self._run:
            raise InputError(
                f"{self._folder}: holds work items of another run (another scene, seed, surface, "
                "engine or version); resume that one with its own options, or remove the folder"
            )

    def _path(self, item: WorkItem, number: int) -> Path:
        name = f"{item.realisation.number:05d}-{item.angle:05d}-{number:08d}.npz"
        return self._folder / name

    def save(self, item: WorkItem, tally: Tally) -> None:
        """Write what a work item came to. Raises MicrosurfError if there is no room for it."""
        self._write(self._path(item, item.number), 1, tally)

    def add_up(self, item: WorkItem, stream: Stream) -> None:
        """Put a stream's work items together, if many lie about singly or no more are wanted."""
        key = item.realisation.number, item.angle
        before = self._together.get(key, 1)
        if stream.tally is None or stream.added <= before:
            return
        if stream.closed or stream.added - before >= TOGETHER:
            self._write(self._path(item, 0), stream.added, stream.tally)
            self._together[key] = stream.added
            # Of a closed stream also what is beyond enough.
            for number in range(before, stream.issued if stream.closed else stream.added):
                self._path(item, number).unlink(missing_ok=True)

    def _write(self, path: Path, count: int, tally: Tally) -> None:
        arrays: dict[str, Any] = {"count": np.array(count)}
        for field in fields(Tally):
            values = np.asarray(getattr(tally, field.name))
            index = np.flatnonzero(values).astype(np.uint32)
            arrays[field.name] = values.ravel()[index]
            arrays[f"{field.name} place"] = index
            arrays[f"{field.name} shape"] = np.array(values.shape)
        arrays["checksum"] = self._checksum(path, arrays)
        try:
            with whole_file(path) as temporary:
                np.savez(temporary, **arrays)
        except InputError as error:  # it could be written when the run began
            raise MicrosurfError(str(error)) from error

    def _checksum(self, path: Path, arrays: dict[str, Any]) -> NDArray[np.uint8]:
        """Digest of a file's arrays, of its place, and of the run it belongs to."""
        digest = hashlib.sha256(f"{self._run} {path.name}".encode())
        for name in sorted(arrays.keys() - {"checksum"}):
            values = np.ascontiguousarray(arrays[name])
            digest.update(f"{name} {values.dtype.str} {values.shape}".encode())
            digest.update(values.tobytes())
        return np.frombuffer(digest.digest(), np.uint8)

    def close(self) -> None:
        """Let others have the folder."""
        self._lock.release()

    def leave(self) -> None:
        """Remove the folder if no work item of it was finished."""
        if not any(self._folder.glob(_ITEMS)):
            self.close()  # Windows removes nothing that is open
            clear(self._folder)

    def load(self, item: WorkItem) -> tuple[int, Tally] | None:
        """How many work items are there from this one on, and their sum; None if none is."""
        path = self._path(item, item.number)
        if not path.is_file():
            return None
        try:
            with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
                arrays = {name: archive[name] for name in archive.files}
            if not np.array_equal(arrays["checksum"], self._checksum(path, arrays)):
                return None
            count, tally = int(arrays["count"]), _tally(arrays)
        except Exception:  # noqa: BLE001 - numpy and zipfile raise anything for a damaged file
            return None
        if count > 1:
            self._together[item.realisation.number, item.angle] = count
        return count, tally


def claim(path: Path) -> FileLock:
    """Lock a file, to hold its folder until this process ends, however it does.

    By trust where the file system has no locks. To be released by who is done before.

    Raises
    ------
    InputError
        If another process has it.
    OSError
        If it can't be made.

    """
    # A lock made of a file alone would outlive a killed run, and bar its resumption.
    lock = FileLock(path, thread_local=False, fallback_to_soft=False)
    try:
        lock.acquire(timeout=0)
    except Timeout as error:
        raise InputError(
            f"{path.parent}: another run is at work there; wait for it or choose another place"
        ) from error
    except OSError as error:
        if error.errno not in _NO_LOCKS:
            raise
        logging.getLogger(__name__).warning(
            "microsurf: %s: the file system has no locks (%s); let no other run work there",
            path.parent,
            error.strerror,
        )
    return lock


def _tally(arrays: dict[str, Any]) -> Tally:
    values = {}
    for field in fields(Tally):
        filled = arrays[field.name]
        values[field.name] = np.zeros(arrays[f"{field.name} shape"], filled.dtype)
        values[field.name].ravel()[arrays[f"{field.name} place"]] = filled
    return Tally(**values)


def clear(folder: Path) -> None:
    """Remove a folder of finished work items, once the whole result is safe.

    Raises
    ------
    MicrosurfError
        If that is not possible.

    """
    try:
        shutil.rmtree(folder)
    except OSError as error:
        raise MicrosurfError(
            f"{folder}: could not be removed ({error.strerror}); remove it yourself"
        ) from error


def _read(note: Path) -> str | None:
    try:
        content = json.loads(note.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    return content.get("run") if isinstance(content, dict) else None
