"""Bounded reading of text files: strangers' files are data."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError

MOST_TEXT = 400_000_000
"""Bytes of a text that are read at most."""


def read_text(path: Path) -> str:
    """Text of a file in UTF-8 or Latin-1.

    Raises
    ------
    InputError
        If it is larger than MOST_TEXT, empty, or no text.

    """
    size = path.stat().st_size
    if size > MOST_TEXT:
        raise InputError(f"{size} bytes: at most {MOST_TEXT} bytes of text are read; thin it")
    raw = path.read_bytes()
    if not raw.strip():
        raise InputError("the file is empty")
    if b"\x00" in raw:
        raise InputError("not a text: it has zero bytes; check that its ending fits its format")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def as_numbers(words: Sequence[str], where: str) -> NDArray[np.float64]:
    """Words as numbers; the first that is none is named."""
    try:
        return np.asarray(words, dtype=np.float64)
    except ValueError:
        for word in words:
            try:
                float(word)
            except ValueError:
                raise InputError(f"{where}: {word[:40]!r} is not a number") from None
        raise


def table(lines: Sequence[str], first: int, columns: int, delimiter: str) -> NDArray[np.float64]:
    """Rows of numbers, shape (rows, columns); an empty field is NaN.

    ``first`` is the number of the first line, for messages.
    """
    rows = []
    for number, line in enumerate(lines, first):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        words = line.split(delimiter) if delimiter.strip() else line.split()
        if len(words) != columns:
            raise InputError(
                f"line {number} has {len(words)} fields where {columns} are expected; "
                "the file is truncated or damaged"
            )
        rows.append([word.strip() or "nan" for word in words])
    if not rows:
        raise InputError("no row of numbers; the file is truncated")
    flat = as_numbers([word for row in rows for word in row], f"lines {first} …")
    return flat.reshape(len(rows), columns)
