"""X3P (ISO 25178-72, formerly ISO 5436-2), read and written by x3pio.

Its coordinates are right-handed with y upwards, in metres: rows are turned over on
the way in and out.
"""

from pathlib import Path

import numpy as np

from ...errors import InputError
from ..declared import Declared
from ..heightfield import Heightfield
from .height_map import PIXELS, HeightMap, choose, first_line

_METRES = 1e-6  # in a micrometre


def read(path: Path, declared: Declared) -> HeightMap:
    """Read one layer of a surface on a regular grid.

    Raises
    ------
    InputError
        If the file is damaged, or it is a profile, a cloud of points or on an irregular grid.
    ImportError
        If x3pio is missing.

    """
    import x3pio  # noqa: PLC0415 - an extra

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
    layer = stored.layers[choose(declared.channel, names, 0)]
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
        channel=names[choose(declared.channel, names, 0)],
        channels=tuple(names),
    )


def write(h: Heightfield, path: Path) -> None:
    """Write heights, taken for µm, as X3P in double precision; NaN where they were filled.

    Raises
    ------
    InputError
        If a pixel is none in µm.
    ImportError
        If x3pio is missing.

    """
    import x3pio  # noqa: PLC0415 - an extra

    if not all(PIXELS[0] <= d <= PIXELS[1] for d in h.pixel):
        raise InputError(
            f"spacing = {h.spacing}: X3P holds metres, so lengths are taken for µm; a "
            f"pixel must be {PIXELS[0]:g} … {PIXELS[1]:g} µm. Choose another format"
        )
    heights = h.heights if h.filled is None else np.where(h.filled, np.nan, h.heights)
    x3pio.write(
        path, heights[::-1] * _METRES, x_scale=h.pixel[0] * _METRES, y_scale=h.pixel[1] * _METRES
    )
