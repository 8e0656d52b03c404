"""What a page is made of: sections of text, tables and pictures."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .figures.figure import Picture

_SENTENCE = 24  # characters, from which on a cell is more than a name or a number


@dataclass(frozen=True)
class Table:
    """A table: ``caption`` above it, ``note`` under it, a row for each mapping.

    Columns are the keys of the rows in the order of their first appearance; units belong
    into them. Texts are shown as they are, whole numbers whole, other numbers with
    ``digits`` significant ones; None is an en dash. All of it is escaped.
    """

    caption: str
    rows: Sequence[Mapping[str, Any]]
    note: str = ""
    digits: int = 4

    @property
    def columns(self) -> list[str]:
        """Of all rows, in the order in which they first appear."""
        return list(dict.fromkeys(key for row in self.rows for key in row))

    def is_text(self, column: str) -> bool:
        """Whether a column holds sentences, which read from the left and may wrap."""
        cells = [row[column] for row in self.rows if column in row]
        return any(isinstance(cell, str) and len(cell) > _SENTENCE for cell in cells)

    def shown(self, value: Any) -> str:
        """One cell as text."""
        if isinstance(value, np.generic):
            value = value.item()
        if value is None:
            return "–"
        if isinstance(value, bool):
            return "yes" if value else "no"
        if isinstance(value, int | str):
            return str(value)
        return f"{value:.{self.digits}g}"


@dataclass(frozen=True)
class Section:
    """One part of the page, of a scene or of the whole report.

    ``text`` is plain: an empty line ends a paragraph. ``name`` is its address in the
    page; ASCII letters, digits and ``-``. ``cites`` are keys of `references`.
    """

    name: str
    title: str
    text: str = ""
    tables: tuple[Table, ...] = ()
    pictures: tuple[Picture, ...] = ()
    cites: tuple[str, ...] = ()

    @property
    def paragraphs(self) -> list[str]:
        """The text, cut at its empty lines."""
        return [part.strip() for part in self.text.split("\n\n") if part.strip()]
