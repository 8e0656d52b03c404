"""What the figures of a report share: style, palette, markers, names, and a page's width.

Drawn to be printed at their own size: no letter is smaller than 8 pt there. matplotlib is
imported where something is drawn: what draws nothing starts faster, and runs without it.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, NamedTuple

from ...errors import InputError
from ...model import MODELS
from ...model.registry import Line

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe and Ito's palette: distinct to the colour-blind; markers and lines say it again.
BLACK, ORANGE, BLUE, VERMILION, GREEN, PURPLE, GREY = (
    "#000000", "#E69F00", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#888888",
)  # fmt: skip
PALETTE = {
    "black": BLACK, "orange": ORANGE, "blue": BLUE, "vermilion": VERMILION, "green": GREEN,
    "purple": PURPLE, "grey": GREY,
}  # fmt: skip
MARGIN = "#cfe8dc"
"""Behind what counts as holding."""
WIDTH = 7.1
"""Of a page without its margins, in inches."""
SMALL = 8.5
"""Letters of legends, in points."""
LONGEST = 80
"""Letters of a user's words in a figure."""

QUANTITY_STYLE = {
    "specular": (VERMILION, "s", "order-1 specular"),
    "body": (BLUE, "o", "order-1 body"),
    "total": (BLACK, "D", "total"),
}


class SourceStyle(NamedTuple):
    """How a model's curve or symbol is drawn; ``label`` without the orders it is of."""

    colour: str
    marker: str
    line: Line
    label: str
    orders: str = ""

    @property
    def name(self) -> str:
        """Label with the orders."""
        return {"1": f"{self.label}, order 1", "all": f"{self.label}, all orders"}.get(
            self.orders, self.label
        )


_OTHERS = {
    "measured": SourceStyle(BLACK, "o", "-", "measured"),
    "surface": SourceStyle(BLACK, "*", "-", "explicit surfaces"),
}


def source_style(key: str) -> SourceStyle:
    """Style of a model, see `model.registry`; of what is measured; of a user's BRDF."""
    if key in MODELS:
        of = MODELS[key]
        return SourceStyle(
            PALETTE.get(of.colour, of.colour), of.marker, of.line, of.label, of.orders
        )
    return _OTHERS.get(key, SourceStyle(VERMILION, "D", "-.", as_text(key)))


@contextmanager
def own_style() -> Iterator[None]:
    """Draw and save in matplotlib's own style, whatever a user's matplotlibrc asks for.

    Ticks and letters take their style when they are laid out, so saving needs it as drawing does.

    Raises
    ------
    InputError
        If matplotlib can't load for a matplotlibrc that is not text.

    """
    try:
        from matplotlib import rc_context, rcdefaults  # noqa: PLC0415 - late: only to draw
    except UnicodeDecodeError as error:
        raise InputError(
            "matplotlibrc: is not text in UTF-8, and matplotlib reads it before it draws; "
            "save it as UTF-8, or go to a folder without one"
        ) from error

    with rc_context():
        rcdefaults()
        yield


def new_figure(height: float, width: float = WIDTH) -> "Figure":
    """Give a figure that lays itself out; inches."""
    from matplotlib.figure import Figure  # noqa: PLC0415 - late: only to draw

    return Figure(figsize=(width, height), layout="constrained")


def clean(axes: "Axes") -> None:
    """Light grid, no box."""
    axes.grid(visible=True, color="#dddddd", linewidth=0.5)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def as_text(words: str) -> str:
    """Give what a user wrote as letters: no formula, no line break, at most LONGEST of them.

    matplotlib reads what stands between two $ as a formula, and leaves labels that begin
    with _ out of legends.
    """
    plain = "".join(c if c.isprintable() else "\ufffd" for c in words)
    if len(plain) > LONGEST:
        plain = plain[: LONGEST // 2] + "…" + plain[-LONGEST // 2 :]
    unseen = "\u200b" if plain.startswith("_") else ""
    return unseen + plain.replace("$", r"\$")


@own_style()
def nothing(why: str) -> "Figure":
    """Give a figure that says there is nothing to show, and why."""
    figure = new_figure(1.0)
    figure.text(0.5, 0.5, f"nothing to show: {why}", ha="center", va="center", fontsize=10)
    return figure
