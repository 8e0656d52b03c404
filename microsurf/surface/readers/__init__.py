"""Readers of instruments' files, in the order in which they are tried.

A new format is one file with a `Reader`, and one entry here.
"""

import logging
import warnings
from pathlib import Path

from ...errors import InputError
from . import image, surface_topography, x3p
from .height_map import MICROMETRES, ORIENTATION, HeightMap, Reader, unit_named

READERS: tuple[Reader, ...] = (x3p.READER, surface_topography.READER, image.READER)

ENDINGS = tuple(sorted({ending for reader in READERS for ending in reader.endings}))

__all__ = ["ENDINGS", "MICROMETRES", "ORIENTATION", "READERS", "HeightMap", "read", "unit_named"]


def read(path: Path, channel: str | None = None) -> HeightMap:
    """Read a map of heights with the first reader that knows its ending and its content.

    Raises
    ------
    InputError
        If no reader does, or the file is damaged.

    """
    # Libraries warn and log about tags and versions; what matters they raise.
    logging.getLogger("tifffile").addHandler(logging.NullHandler())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for reader in READERS:
            if path.suffix.lower() in reader.endings:
                found = reader.read(path, channel)
                if found is not None:
                    return found
    raise InputError("of no format that is known under its ending; export it again")
