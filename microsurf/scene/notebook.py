"""Tables as HTML for notebooks: every text escaped, so that a title can hold no markup."""

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any


def table(rows: Iterable[Sequence[str]], head: Sequence[str] = (), caption: str = "") -> str:
    """Lay out cells of text as an HTML table."""
    parts = [f"<caption>{escape(caption)}</caption>"] if caption else []
    if head:
        parts.append("<tr>" + "".join(f"<th>{escape(cell)}</th>" for cell in head) + "</tr>")
    parts += [
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows
    ]
    return f"<table>{''.join(parts)}</table>"


def sections(values: Mapping[str, Any], caption: str = "") -> str:
    """Lay out a mapping as HTML: a row for each mapping in it, what is None or empty left out."""

    def said(value: Any) -> bool:
        return value is not None and value not in ({}, "")

    def text(value: Any) -> str:
        if isinstance(value, Mapping):
            return ", ".join(f"{k} = {text(v)}" for k, v in value.items() if said(v))
        return ", ".join(map(text, value)) if isinstance(value, tuple | list) else str(value)

    rows = [(name, text(value)) for name, value in values.items() if said(value)]
    return table([row for row in rows if row[1]], caption=caption)
