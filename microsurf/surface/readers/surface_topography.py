"""Instruments' own formats, read by SurfaceTopography (extra ``topography``).

The file's ending says which of its readers may try, so that a file of another format
under that ending is refused and not guessed at. Its heights are [x, y] with the first
row on top.
"""

from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError
from ..declared import Declared
from .height_map import HeightMap, choose, first_line, unit_named

FORMATS = {
    ".al3d": ("al3d",), ".apx": ("plu",), ".asc": ("sdf", "asc"), ".bcr": ("bcr",),
    ".bcrf": ("bcr",), ".cur": ("wsxm",), ".dat": ("metropro", "asc"), ".datx": ("datx",),
    ".di": ("di",), ".ezd": ("ezd",), ".frt": ("frt",), ".gwy": ("gwy",), ".h5": ("h5",),
    ".hfm": ("xyz",), ".ibw": ("ibw",), ".jpk": ("jpk",), ".lext": ("lext",), ".mat": ("mat",),
    ".mdt": ("mdt",), ".mi": ("mi",), ".mnt": ("mnt",), ".nc": ("nc",), ".nid": ("ezd",),
    ".nms": ("nms",), ".oir": ("oir",), ".opd": ("opd",), ".opdx": ("opdx",), ".os3d": ("os3d",),
    ".plu": ("plu",), ".plux": ("plux",), ".poir": ("poir",), ".qep": ("qep",), ".sdf": ("sdf",),
    ".spm": ("di",), ".stp": ("wsxm",), ".sur": ("sur",), ".tif": ("ps",), ".tiff": ("ps",),
    ".tmd": ("tmd",), ".tom": ("wsxm",), ".top": ("wsxm",), ".txt": ("sdf", "asc"),
    ".vk3": ("vk",), ".vk4": ("vk",), ".vk6": ("vk",), ".vk7": ("vk",), ".xyz": ("xyz",),
    ".zip": ("nmm",), ".zmg": ("zmg",), ".zon": ("zon",),
    **{f".{number:03d}": ("di",) for number in range(1000)},
}  # fmt: skip
"""SurfaceTopography's readers by ending, in the order of trying; Bruker numbers its files."""

_SHARED = {".tif", ".tiff"}
"""Endings under which another reader may know the file."""

_PARK_MAGIC, _PARK_HEIGHTS = 50432, (50434, 50435)
"""Tags of Park Systems' TIFFs: their mark; heights and their header."""

_OTHER_KINDS = ("amplitude", "phase", "error", "deflection", "friction", "current", "potential")
"""Words in the names of channels that hold no heights."""


def read(path: Path, declared: Declared) -> HeightMap | None:
    """Read one channel of heights.

    Raises
    ------
    InputError
        If none of its readers for that ending can read the file, or it holds no such channel.
    ImportError
        If SurfaceTopography is missing.

    """
    ending = path.suffix.lower()
    if ending in _SHARED and not _by_park(path):
        return None
    from SurfaceTopography import IO  # noqa: PLC0415 - an extra, and 2 s to import

    reasons = []
    for name in FORMATS[ending]:
        try:
            with IO.lookup_reader_by_format[name](str(path)) as opened:
                return _channel(opened, name, declared.channel)
        except InputError:
            raise
        except Exception as error:  # noqa: BLE001 - they raise whatever the bytes provoke
            reasons.append(f"{name}: {first_line(error)}")
    raise InputError(f"damaged, or of another format ({'; '.join(reasons)}); export it again")


def _by_park(path: Path) -> bool:
    """Whether a TIFF has Park Systems' magic tag; other TIFFs are images.

    Raises
    ------
    InputError
        If it has, and was cut short: Pillow leaves out tags that lie beyond a file's end.

    """
    from PIL import Image, UnidentifiedImageError  # noqa: PLC0415 - only where it is needed

    try:
        with Image.open(path) as image:
            tags = set(getattr(image, "tag_v2", ()))
    except (UnidentifiedImageError, OSError, ValueError):
        return False
    if _PARK_MAGIC not in tags:
        return False
    if not tags.issuperset(_PARK_HEIGHTS):
        raise InputError("a TIFF by Park Systems, cut short: it ends before its heights do")
    return True


def _holds_heights(channel: Any) -> bool:
    """Whether a channel is a map of heights; Bruker's errors and phases come in lengths, too."""
    named_otherwise = any(word in str(channel.name).lower() for word in _OTHER_KINDS)
    plain = channel.unit is None or isinstance(channel.unit, str)
    return channel.dim == 2 and channel.data_kind.name == "HEIGHT" and plain and not named_otherwise


def _channel(opened: Any, name: str, channel: str | None) -> HeightMap:
    channels = [c for c in opened.channels if _holds_heights(c)]
    if not channels:
        kinds = ", ".join(f"{c.name!r} ({c.data_kind.value}, {c.dim}D)" for c in opened.channels)
        raise InputError(f"no channel holds a map of heights; there are {kinds or 'none'}")
    names = [str(c.name) for c in channels]
    indices = [c.index for c in channels]
    default = opened.default_channel.index
    taken = channels[choose(channel, names, indices.index(default) if default in indices else 0)]
    if taken.is_uniform is False:
        raise InputError("its points lie on no regular grid; export heights on a grid")
    sized = taken.physical_sizes is not None
    given = {} if sized else {"physical_sizes": tuple(float(n) for n in taken.nb_grid_pts)}
    topography = taken.topography(**given)
    heights = np.ma.filled(np.ma.asarray(topography.heights(), dtype=np.float64), np.nan).T
    pixel = tuple(
        float(size) / count
        for size, count in zip(topography.physical_sizes, topography.nb_grid_pts, strict=True)
    )
    return HeightMap(
        heights=heights,
        pixel=(pixel[0], pixel[1]) if sized else None,
        unit=None if topography.unit is None else unit_named(topography.unit),
        reader=f"SurfaceTopography {version('SurfaceTopography')}",
        format=name,
        channel=str(taken.name),
        channels=tuple(names),
        periodic=bool(taken.is_periodic),
    )
