"""X3P (ISO 25178-72, formerly ISO 5436-2), read and written by x3pio.

Its coordinates are right-handed with y upwards, in metres: rows are turned over on
the way in and out.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from .height_map import HeightMap, Reader, choose, first_line, missing

Array = NDArray[np.float64]

ENDING = ".x3p"
_METRES = 1e-6  # in a micrometre


def read(path: Path, channel: str | None) -> HeightMap:
    """Read one layer of a surface on a regular grid.

    Raises
    ------
    InputError
        If x3pio is missing, the file is damaged, or it is a profile, a cloud of points or
        on an irregular grid.

    """
    try:
        import x3pio  # noqa: PLC0415 - an extra
    except ImportError as error:
        raise missing("x3pio") from error
    try:
        stored = x3pio.read(path)
    except x3pio.X3pError as error:
        raise InputError(
            f"not an X3P file, or a damaged one ({first_line(error)}); export it again"
        ) from error
    except Exception as error:  # zipfile and XML parsers raise whatever the bytes provoke
        raise InputError("not an X3P file, or a damaged one; export it again") from error
    if not isinstance(stored, x3pio.Surface):
        raise InputError(f"an X3P {type(stored).__name__}: must be a surface on a grid")
    names = [f"layer {i}" for i in range(len(stored.layers))]
    layer = stored.layers[choose(channel, names, 0)]
    if not layer.is_regular_grid:
        raise InputError("its points lie on no regular grid; export heights on a grid")
    axes = layer.header
    increments = (axes.x.increment, axes.y.increment)
    known = None not in increments
    return HeightMap(
        heights=np.array(layer.z, dtype=np.float64)[::-1],
        pixel=(float(increments[0] or 0), float(increments[1] or 0)) if known else None,
        unit="m",
        reader=f"x3pio {x3pio.__version__}",
        format="x3p",
        channel=names[choose(channel, names, 0)],
        channels=tuple(names),
    )


def write(heights: Array, pixel: tuple[float, float], path: Path) -> None:
    """Write heights in µm, NaN where nothing was measured, as X3P in double precision.

    Raises
    ------
    InputError
        If x3pio is missing.

    """
    try:
        import x3pio  # noqa: PLC0415 - an extra
    except ImportError as error:
        raise missing("x3pio") from error
    x3pio.write(
        path, heights[::-1] * _METRES, x_scale=pixel[0] * _METRES, y_scale=pixel[1] * _METRES
    )


READER = Reader((ENDING,), read)
