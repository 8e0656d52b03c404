"""Files are written whole or not at all."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .errors import InputError, MicrosurfError


def check_readable(path: Path, instead: str) -> None:
    """Refuse a path that is no file one may read; ``instead`` says what to do then."""
    try:
        if path.is_dir():
            raise InputError(f"{path}: is a folder; {instead}")
        if not path.is_file():
            raise InputError(f"{path}: no such file; {instead}")
        path.open("rb").close()
    except OSError as error:
        raise InputError(f"{path}: can't be read ({error.strerror}); {instead}") from error


def check_writable(path: Path) -> None:
    """Refuse a path that could not be written, before any work is done for it."""
    try:
        if path.is_dir():
            raise InputError(f"{path}: is a folder; give the name of a file")
        if not path.parent.is_dir():
            raise InputError(f"{path}: the folder {path.parent} does not exist; make it first")
        # Permissions don't tell all, a file system may be read-only: try.
        handle, name = tempfile.mkstemp(prefix=".", suffix=path.suffix, dir=path.parent)
    except OSError as error:
        raise InputError(f"{path}: can't be written ({error.strerror}); choose another") from error
    os.close(handle)
    Path(name).unlink()


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Give a temporary path beside ``path`` that takes its name if the block succeeds.

    The temporary keeps the ending, by which writers choose their format.
    """
    check_writable(path)
    try:
        handle, name = tempfile.mkstemp(prefix=".", suffix=path.suffix, dir=path.parent)
    except OSError as error:
        raise InputError(f"{path}: can't be written ({error.strerror}); choose another") from error
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        with temporary.open("rb") as written:
            os.fsync(written.fileno())
        temporary.chmod(0o666 & ~_umask())
        temporary.replace(path)
    except OSError as error:
        raise MicrosurfError(
            f"{path}: could not be written ({error.strerror or error}); nothing was left there. "
            "Make room or choose another place"
        ) from error
    finally:
        temporary.unlink(missing_ok=True)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
