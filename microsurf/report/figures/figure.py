"""A figure with its words and its numbers: shown in the page, and its files beside it."""

import csv
import io
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ...files import whole_file
from .style import own_style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DPI = 200
"""Of the raster: what journals ask of a halftone at half a page, and sharp on a screen."""
COLOURS = 64
"""Of the raster: a dozen hues and their edges; a quarter of the bytes of all colours."""
SMALL = 40_000
"""Bytes of a vector picture that is kept, though its raster may be smaller."""

_FORMULA = ("=", "+", "-", "@")
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,120}")


@dataclass(frozen=True)
class Picture:
    """A figure, what it says, and the numbers it draws.

    Attributes
    ----------
    name : str
        Of its files: ASCII letters, digits, ``.``, ``_`` and ``-``.
    figure : matplotlib.figure.Figure
        One message.
    caption : str
        Plain text under the figure; also what a reader hears who can't see it.
    rows : sequence of mappings
        The numbers drawn, a row each, not empty. Columns are the keys in the order of
        their first appearance, with their unit in the name (``theta_i_deg``).

    Raises
    ------
    ValueError
        If the name is none of a file, or there is no caption or no row.

    """

    name: str
    figure: "Figure"
    caption: str
    rows: Sequence[Mapping[str, Any]]

    def __post_init__(self) -> None:
        if not _NAME.fullmatch(self.name):
            raise ValueError(f"picture {self.name!r}: the name must fit a file")
        if not self.caption or not self.rows:
            raise ValueError(f"picture {self.name}: has no caption or no numbers")


def save(picture: Picture, folder: Path) -> dict[str, bytes]:
    """Write NAME.png, NAME.csv and, if it is small, NAME.svg into ``folder``.

    An SVG is small that has no more bytes than its raster, or than `SMALL`. Lobes of a
    dozen panels have ten times as many: `microsurf plot` draws them as vectors.

    All or none: none takes its name before all are written. The same picture gives the
    same bytes.

    Returns
    -------
    dict
        Ending of each file ("svg", "png", "csv") to its content: what a page shows first.

    Raises
    ------
    InputError
        If the folder is not there or can't be written.
    MicrosurfError
        If there is no room.

    """
    raster, vector = _both(picture.figure)
    files = {} if vector is None else {"svg": vector}
    files |= {"png": raster, "csv": as_csv(picture.rows).encode()}
    with ExitStack() as written:
        for ending, content in files.items():
            path = written.enter_context(whole_file(folder / f"{picture.name}.{ending}"))
            path.write_bytes(content)
    return files


class _TooLargeError(Exception):
    """More was written than there is a use for."""


class _Bounded(io.BytesIO):
    """Takes so many bytes and no more."""

    def __init__(self, most: int) -> None:
        super().__init__()
        self._most = most

    def write(self, content: Any) -> int:
        if self.tell() + len(content) > self._most:
            raise _TooLargeError
        return super().write(content)


def _both(figure: "Figure") -> tuple[bytes, bytes | None]:
    """PNG, and SVG if it is small: laid out once, as an SVG is, and each drawn once.

    `savefig` would lay out and draw twice for each, to end most often with an SVG that is too
    large: it is drawn up to there.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415 - only to draw
    from matplotlib.backends.backend_svg import FigureCanvasSVG  # noqa: PLC0415 - only to draw

    engine, canvas, dpi = figure.get_layout_engine(), figure.canvas, figure.dpi
    pixels: Any = FigureCanvasAgg(figure)
    vector: Any = FigureCanvasSVG(figure)
    try:
        with _style():
            figure.dpi = vector.fixed_dpi
            if engine is not None and figure.axes:
                engine.execute(figure)
            figure.set_layout_engine("none")
            figure.dpi = DPI
            figure.set_canvas(pixels)
            pixels.draw()
            raster = _in_few_colours(np.asarray(pixels.buffer_rgba()))
            content = _Bounded(max(len(raster), SMALL))
            figure.dpi = dpi
            figure.set_canvas(vector)
            vector.print_svg(content, metadata={"Date": None})
    except _TooLargeError:
        return raster, None
    finally:
        figure.dpi = dpi
        figure.set_canvas(canvas)
        figure.set_layout_engine(engine)
    return raster, content.getvalue()


def _in_few_colours(pixels: NDArray[np.uint8]) -> bytes:
    """PNG of so many as a figure has."""
    content = io.BytesIO()
    few = Image.fromarray(pixels).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    few.save(content, format="png", optimize=True, dpi=(DPI, DPI))
    return content.getvalue()


def write(figure: "Figure", path: Path, dpi: float = DPI) -> None:
    """Write a figure as PNG, PDF or SVG, by the ending of ``path``: the only place that does.

    The same figure gives the same bytes. Letters of an SVG are outlines: it looks the same
    wherever it is opened. ``dpi`` is that of a PNG.
    """
    path.write_bytes(_drawn(figure, path.suffix.lower()[1:], dpi))


def _drawn(figure: "Figure", kind: str, dpi: float = DPI) -> bytes:
    unsaid = {"png": "Software", "pdf": "CreationDate", "svg": "Date"}
    content = io.BytesIO()
    with _style():
        figure.savefig(
            content, format=kind, dpi=dpi if kind == "png" else "figure",
            metadata={unsaid[kind]: None},
        )  # fmt: skip
    return content.getvalue()


@contextmanager
def _style() -> Iterator[None]:
    """Our own, with the letters of an SVG as outlines, and its names the same each time."""
    from matplotlib import rc_context  # noqa: PLC0415 - late: only to draw

    with own_style(), rc_context({"svg.hashsalt": "microsurf", "svg.fonttype": "path"}):
        yield


def as_csv(rows: Sequence[Mapping[str, Any]]) -> str:
    """Rows as CSV: numbers with all their digits, nothing where there is none.

    Texts that a spreadsheet would take for a formula have a ' in front.
    """
    columns = list(dict.fromkeys(key for row in rows for key in row))
    buffer = io.StringIO()
    writer = csv.DictWriter(buffer, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows({key: _plain(value) for key, value in row.items()} for row in rows)
    return buffer.getvalue()


def _plain(value: Any) -> Any:
    """numpy's numbers as Python's own; what is not a number is left empty; no formulas."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, str) and value.lstrip().startswith(_FORMULA) and not _is_number(value):
        return f"'{value}"
    return None if isinstance(value, float) and np.isnan(value) else value


def _is_number(text: str) -> bool:
    """Whether it is a number that was rounded for people."""
    try:
        float(text)
    except ValueError:
        return False
    return True
