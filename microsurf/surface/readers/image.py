"""Images whose grey levels are heights; they know neither pixel size nor unit."""

from pathlib import Path

import numpy as np
import PIL
from PIL import Image, ImageSequence

from ...errors import InputError
from ..declared import Declared
from ..heightfield import check_layout
from .height_map import HeightMap, choose, first_line

ENDINGS = (".png", ".tif", ".tiff", ".bmp", ".pgm")
_GREY = {"L", "I", "I;16", "I;16L", "I;16B", "I;16N", "F"}
"""Pillow's modes of one number a pixel: 8, 32 and 16 bits, and floating point."""


def _check(frame: Image.Image) -> None:
    """Refuse colours, and more pixels than a surface may have."""
    if frame.mode not in _GREY:
        raise InputError(
            f"an image of mode {frame.mode}: must hold one grey level a pixel, of 8, 16 or 32 "
            "bits; convert it"
        )
    check_layout((frame.height, frame.width), np.dtype(np.float64))


def read(path: Path, declared: Declared) -> HeightMap:
    """Read the grey levels of an image, or of one frame of several.

    Raises
    ------
    InputError
        If it is no image, a damaged one, or one in colour.

    """
    try:
        with Image.open(path) as image:
            count = getattr(image, "n_frames", 1)
            names = [f"frame {i}" for i in range(count)]
            taken = choose(declared.channel, names, 0)
            frame = ImageSequence.Iterator(image)[taken] if count > 1 else image
            _check(frame)  # before the pixels are unpacked
            heights = np.asarray(frame, dtype=np.float64)
            kind = f"{image.format} {frame.mode}"
    except InputError:
        raise
    except Exception as error:  # Pillow raises whatever the bytes provoke
        raise InputError(f"not an image, or a damaged one ({first_line(error)})") from error
    return HeightMap(
        heights=heights,
        pixel=None,
        unit=None,
        reader=f"Pillow {PIL.__version__}",
        format=kind,
        channel=names[taken],
        channels=tuple(names),
    )
