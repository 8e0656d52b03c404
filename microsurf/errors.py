"""The errors a user sees: one line that names the value, what is allowed and what to do."""

import reprlib
from typing import Any


class MicrosurfError(Exception):
    """Something could not be finished; what was finished is kept. Exit code 3."""

    exit_code = 3


class InputError(MicrosurfError, ValueError):
    """What was asked for makes no sense. Exit code 2."""

    exit_code = 2


def require(condition: bool, name: str, value: Any, allowed: str) -> None:
    """Raise InputError with one line that says what was given and what may be."""
    if not condition:
        plain = value.tolist() if hasattr(value, "tolist") else value  # without numpy's names
        # reprlib cuts what is too long for one line.
        raise InputError(f"{name} = {reprlib.repr(plain)}: must be {allowed}")
