"""Numbers in the named columns of a CSV, as spreadsheets and instruments write it.

Spaces about names and numbers, quotes, a byte-order mark, other columns, and empty lines and
empty cells at the end of a line do no harm.
"""

import csv
import io
from collections.abc import Sequence
from pathlib import Path

from ..errors import InputError
from ..files import read_once

MOST_BYTES = 400_000_000


def read_columns(path: Path, wanted: str, *choices: Sequence[str]) -> tuple[int, list[list[str]]]:
    """Read a CSV's cells under the names of one of several choices; from a pipe, too.

    Parameters
    ----------
    path : Path
        A CSV in UTF-8 whose first line names its columns.
    wanted : str
        What that line must name, for messages.
    *choices : sequence of str
        Names; the first choice that is all there is taken.

    Returns
    -------
    choice : int
        Number of the choice.
    rows : list of list of str
        Cells in the order of its names, no longer than the row was.

    Raises
    ------
    InputError
        If it is no such file, a column is missing or there twice, or a row has more cells than
        there are names, as with decimal commas.

    """
    content = read_once(path, f"give a CSV with the columns {wanted}", MOST_BYTES)
    try:
        lines = io.StringIO(content.decode("utf-8-sig"), newline="")
        table = [_cells(row) for row in csv.reader(lines, skipinitialspace=True)]
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: not a CSV ({error}); give one with {wanted}") from error
    header, *rows = table or [[]]
    missing = [[name for name in names if name not in header] for names in choices]
    if all(missing):
        raise InputError(f"{path}: no column {missing[-1][0]}; its first line must name {wanted}")
    choice = missing.index([])
    names = choices[choice]
    twice = [name for name in names if header.count(name) > 1]
    if twice:
        raise InputError(f"{path}: two columns {twice[0]}; leave one")
    rows = [row for row in rows if row]
    for number, row in enumerate(rows, 1):
        if len(row) > len(header):
            raise InputError(
                f"{path}: row {number} has {len(row)} cells, its first line names {len(header)}; "
                "decimals need a point, not a comma"
            )
    columns = [header.index(name) for name in names]
    return choice, [[row[k] for k in columns if k < len(row)] for row in rows]


def _cells(row: list[str]) -> list[str]:
    """Cells of a row without blanks about them, and without empty ones at its end."""
    cells = [cell.strip() for cell in row]
    while cells and not cells[-1]:
        cells.pop()
    return cells
