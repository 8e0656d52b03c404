"""What need not be done twice on one machine: kept in the user's cache folder.

The folder is that of the environment variable MICROSURF_CACHE, or the system's place for
caches. It only ever saves time: a file that is damaged or does not fit is made again, and a
folder that can't be made or written is done without.
"""

import hashlib
import os
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Generic, TypeVar

from ..errors import InputError, MicrosurfError
from . import stored
from .versions import state_of_the_code

T = TypeVar("T")

_VARIABLE = "MICROSURF_CACHE"


@dataclass(frozen=True)
class Dated(Generic[T]):
    """A value, and when it was made: a date and a time of UTC."""

    value: T
    date: str


def remembered(
    name: str, make: Callable[[], T], sound: Callable[[T], bool], *, again: bool = False
) -> Dated[T]:
    """Give what was made before by the same code on this machine; else make it, and keep it.

    Parameters
    ----------
    name : str
        Tells it from others, with all that it depends on beside code and machine.
    make : callable
        Makes it, out of what `stored` can hold.
    sound : callable
        Whether a value may be kept: what is amiss is looked at anew each time.
    again : bool
        Make it now, whatever is kept.

    """
    # What only shows or asks changes no number: the layers are held by a test.
    key = state_of_the_code(without=("cli", "report"))
    folder = _folder()
    digest = hashlib.sha256(name.encode()).hexdigest()[:16]
    path = None if folder is None else folder / f"{digest}.npz"
    result: Any = None if path is None or again else stored.load(path, key)
    if result is not None:
        kept: Dated[T] = result[0]
        return kept
    new = Dated(make(), datetime.now(UTC).isoformat(" ", "minutes").removesuffix("+00:00"))
    if path is not None and sound(new.value):
        with suppress(InputError, MicrosurfError, OSError):  # no room: not kept, no less right
            stored.save(path, key, new)
    return new


def _folder() -> Path | None:
    """Where caches are kept, made if it is not there; None if that can't be."""
    try:
        folder = Path(os.environ.get(_VARIABLE) or _usual())
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):  # the latter of a user without a home
        return None
    return folder


def _usual() -> Path:
    if sys.platform == "win32":
        folder = os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local"
    elif sys.platform == "darwin":
        folder = Path.home() / "Library" / "Caches"
    else:
        folder = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(folder) / "microsurf"
