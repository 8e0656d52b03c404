"""Files are read from wherever they come, and written whole or not at all."""

import ctypes
import errno
import os
import secrets
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .errors import InputError, MicrosurfError

_CAN_NOT_SYNC = {errno.EINVAL, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP}
"""What a file system answers that has no sync, as some of networks and in user space."""

UNFINISHED, PLACES, PLACE = ctypes.create_string_buffer(32 * 4096), 32, 4096
"""Temporaries under way, a name a place, for machine code that ends the process at once."""

_placing = threading.Lock()


def check_readable(path: Path, instead: str) -> None:
    """Refuse a path that is no file one may read; ``instead`` says what to do then.

    What can be read only once, such as a pipe, is refused too: see `read_once`.
    """
    _check_there(path, instead)
    try:
        if not path.is_file():
            raise InputError(f"{path}: is a pipe or a device; save it as a file first")
        path.open("rb").close()
    except OSError as error:
        raise InputError(f"{path}: can't be read ({error.strerror}); {instead}") from error


def read_once(path: Path, instead: str, most: int) -> bytes:
    """All of a file, a pipe or /dev/stdin, which `check_readable` would empty.

    Raises
    ------
    InputError
        If it is not there, may not be read, or has more than ``most`` bytes.

    """
    _check_there(path, instead)
    try:
        with path.open("rb") as stream:
            content = stream.read(most + 1)
    except OSError as error:
        raise InputError(f"{path}: can't be read ({error.strerror}); {instead}") from error
    if len(content) > most:
        raise InputError(f"{path}: too large, more than {most} bytes; {instead}")
    return content


def _check_there(path: Path, instead: str) -> None:
    _check_name(path)
    try:
        if path.is_dir():
            raise InputError(f"{path}: is a folder; {instead}")
        if not path.exists():
            raise InputError(f"{path}: no such file; {instead}")
    except OSError as error:
        raise InputError(f"{path}: can't be read ({error.strerror}); {instead}") from error


def _check_name(path: Path) -> None:
    """Refuse a name that reports and results, which hold it as text, could not hold."""
    try:
        str(path).encode()
    except UnicodeEncodeError as error:
        raise InputError(f"{path}: its name is not text in UTF-8; rename it") from error


def behind_links(path: Path) -> Path:
    """Return the file that is written under this name: a link's target, as any program does."""
    with suppress(OSError):  # of a name that no file can have
        return Path(os.path.realpath(path)) if path.is_symlink() else path
    return path


def check_writable(path: Path) -> None:
    """Refuse a path that could not be written, before any work is done for it."""
    path = behind_links(path)
    try:
        if path.is_symlink():
            raise InputError(f"{path}: is a link to itself; choose another")
        if path.exists() and not path.is_dir() and not path.is_file():
            raise InputError(f"{path}: is a pipe or a device; give the name of a file")
        if path.is_dir():
            raise InputError(f"{path}: is a folder; give the name of a file")
        if not path.parent.is_dir():
            raise InputError(f"{path}: the folder {path.parent} does not exist; make it first")
        # Permissions don't tell all, a file system may be read-only: try.
        _beside(path, path.suffix).unlink()
    except OSError as error:
        raise _refused(path, error) from error


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Give a temporary path beside ``path`` that takes its name if the block succeeds.

    The temporary keeps the ending, by which writers choose their format. A link stays one:
    its target is written, whole or not at all.
    """
    check_writable(path)
    target = behind_links(path)
    try:
        temporary = _beside(target, path.suffix)
    except OSError as error:
        raise _refused(path, error) from error
    try:
        with _known(temporary):
            yield temporary
            _to_disk(temporary)
            temporary.replace(target)
    except OSError as error:
        raise MicrosurfError(
            f"{path}: could not be written ({error.strerror or error}); nothing was left there. "
            "Make room or choose another place"
        ) from error
    finally:
        with suppress(OSError):  # Windows keeps what a failed writer has left open
            temporary.unlink()


def _beside(path: Path, ending: str) -> Path:
    """Make an empty file of its own name in the same folder.

    The system gives it the rights of any new file. To change them later, as `tempfile`
    makes necessary, is refused by some file systems of networks, and takes a look at the
    umask that other threads would notice.
    """
    while True:
        temporary = path.parent / f".{secrets.token_hex(6)}{ending}"
        with suppress(FileExistsError):
            temporary.touch(exist_ok=False)
            return temporary


@contextmanager
def _known(temporary: Path) -> Iterator[None]:
    """Note a temporary among those UNFINISHED, if there is a place."""
    name = os.fsencode(temporary.absolute())
    with _placing:
        free = [k * PLACE for k in range(PLACES) if UNFINISHED[k * PLACE] == b"\0"]
        index = free[0] if free and len(name) < PLACE else None
        if index is not None:
            # Its first letter comes last and goes first: half a name may be that of another.
            second = ctypes.addressof(UNFINISHED) + index + 1
            ctypes.memmove(second, name[1:] + b"\0", len(name))
            UNFINISHED[index] = name[:1]
    try:
        yield
    finally:
        if index is not None:
            UNFINISHED[index] = b"\0"


def _to_disk(path: Path) -> None:
    """Wait until the disk has it, where the file system can tell."""
    with path.open("r+b") as written:  # Windows syncs only what may be written
        try:
            os.fsync(written.fileno())
        except OSError as error:
            if error.errno not in _CAN_NOT_SYNC:
                raise


def _refused(path: Path, error: OSError) -> InputError:
    return InputError(f"{path}: can't be written ({error.strerror}); choose another")
