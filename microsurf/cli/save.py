"""How commands write the files of one run: all of them or none."""

import json
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from ..files import whole_file
from ..report.figures.figure import as_csv, write

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Text: TypeAlias = str | Mapping[str, Any] | Sequence[Mapping[str, Any]]
Content: TypeAlias = "Figure | Text"


def save(folder: Path, contents: Mapping[str, Content], dpi: int = 150) -> None:
    """Write files by name: figures, texts, an object as JSON, rows as CSV.

    None takes its name before all are written. ``dpi`` is that of a PNG.

    Raises
    ------
    InputError
        If the folder is not there or can't be written.
    MicrosurfError
        If there is no room.

    """
    with ExitStack() as files:
        for name, content in contents.items():
            path = files.enter_context(whole_file(folder / name))
            if isinstance(content, str | Mapping | Sequence):
                path.write_text(_text(content), encoding="utf-8", newline="\n")
            else:
                write(content, path, dpi)


def save_study(
    folder: Path,
    name: str,
    figure: "Figure",
    rows: Sequence[Mapping[str, Any]],
    values: Mapping[str, Any],
    dpi: int = 150,
) -> None:
    """Write NAME.png and .pdf, .csv with the rows and .json with all values, see `save`."""
    contents: dict[str, Content] = {
        f"{name}.png": figure,
        f"{name}.pdf": figure,
        f"{name}.csv": rows,
        f"{name}.json": values,
    }
    save(folder, contents, dpi)


def rounded(rows: Iterable[Mapping[str, Any]], digits: int) -> list[dict[str, Any]]:
    """Rows with that many significant digits of their floats."""
    return [
        {k: f"{v:.{digits}g}" if isinstance(v, float) else v for k, v in row.items()}
        for row in rows
    ]


def _text(content: Text) -> str:
    if isinstance(content, str):
        return content
    if isinstance(content, Mapping):
        return json.dumps(content, indent=1, allow_nan=False)
    return as_csv(content)
