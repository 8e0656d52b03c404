"""Measured BRDFs: readers by format, one a file, and one writer.

A new format is one file with NAME, ENDINGS and ``read(path)``, and one entry in READERS.
"""

from dataclasses import replace
from pathlib import Path

from ...errors import InputError
from ...files import check_readable
from . import astm, csv_pairs, merl, pbrt, rgl
from .csv_pairs import write as write_csv
from .scattered import MeasuredBrdf
from .tidy import tidy

__all__ = ["ENDINGS", "MeasuredBrdf", "holds_brdf", "read_brdf", "write_csv"]

READERS = (csv_pairs, pbrt, astm, merl, rgl)
_HEAD = 65536  # bytes in which the line VARS is looked for
ENDINGS = tuple(ending for reader in READERS for ending in reader.ENDINGS)


def holds_brdf(path: Path) -> bool:
    """Whether a file is one of a measured BRDF, by its ending, or by its text if that is ASTM's.

    .asc and .txt are endings of many things; ASTM's text has a line VARS near its top.
    """
    ending = path.suffix.lower()
    if ending not in astm.SHARED:
        return ending in ENDINGS
    with path.open("rb") as stream:
        head = stream.read(_HEAD)
    return any(line.strip().startswith(b"VARS") for line in head.splitlines())


def read_brdf(path: Path) -> MeasuredBrdf:
    """Read a measured BRDF; the ending of its name picks the reader.

    Returns
    -------
    MeasuredBrdf
        With remarks on what is odd about it.

    Raises
    ------
    InputError
        If the file is missing, truncated, of another format, or holds nothing to use.

    """
    path = Path(path)
    check_readable(path, "give a measured BRDF")
    for reader in READERS:
        if path.suffix.lower() in reader.ENDINGS:
            try:
                return tidy(replace(reader.read(path), reader=reader.NAME, source=path.name))
            except (InputError, OSError) as error:
                raise InputError(f"{path}: {error}") from error
    raise InputError(
        f"{path}: unknown ending {path.suffix!r}; a measured BRDF is one of {', '.join(ENDINGS)}"
    )
