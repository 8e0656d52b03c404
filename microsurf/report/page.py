"""report.html, one self-contained file, and report.json."""

import base64
import io
import json
import platform
import shlex
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

import jinja2
from matplotlib import rc_context
from matplotlib.figure import Figure

from .. import __version__, precision, summary
from ..errors import InputError
from ..files import check_writable, whole_file
from ..validate import Validation, as_json
from . import plots

SCHEMA = 1
_LIBRARIES = ("numpy", "scipy", "embreex", "xarray", "numba")

_EFFECTS = (
    "Measured over predicted, with its 95 % interval over {basis}. Green: the "
    "margin within which the theory counts as holding."
)
_LOBES = (
    "Lobes in the plane of incidence, Kd = {kd:g}. Points: traced on the explicit surface, "
    "bands 95 % over {basis}{bound}. Coloured lines: single scattering by the theory, integrated "
    "over the same bins; black line: all orders by its random walk."
)
_BOUND = " (order 1: from the weights of its paths; all orders: an upper bound)"
_ALBEDOS = (
    "Albedo by the number of facets met. Bars: standard deviation between surfaces. Open red "
    "symbols: the same orders by the random walk."
)
_SURFACE = (
    "The surface itself: a profile, and how many facets are steeper than a slope. "
    "The dotted line is where the mesh ends and the theory goes on."
)


def make_folder(out: Path) -> None:
    """Make the folder of a report, before any work is done for it."""
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"{out}: can't be made a folder ({error.strerror}); choose another"
        ) from error
    check_writable(out / "report.html")


def write(entries: list[Validation], out: Path, seed: int) -> None:
    """Write report.html and report.json into the folder ``out``."""
    document = {
        "schema": SCHEMA,
        "microsurf": __version__,
        "seed": seed,
        "command": shlex.join(["microsurf", *sys.argv[1:]]),
        "python": platform.python_version(),
        "libraries": {name: version(name) for name in _LIBRARIES},
        "scenes": [
            {**as_json(entry), "errors": precision.as_json(entry.measured, entry.scene)}
            for entry in entries
        ],
    }
    with whole_file(out / "report.json") as temporary:
        temporary.write_text(
            json.dumps(document, indent=1, default=_plain, allow_nan=False), encoding="utf-8"
        )
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("microsurf.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    page = environment.get_template("report.html.jinja").render(
        document=document,
        quantities=summary.QUANTITIES | precision.LOBES,
        verdicts=summary.QUANTITIES,
        entries=[(entry, _figures(entry)) for entry in entries],
    )
    with whole_file(out / "report.html") as temporary:
        temporary.write_text(page, encoding="utf-8")


def _plain(value: Any) -> Any:
    """What json does not know: arrays and numpy numbers become lists and numbers."""
    return value.tolist()


def _figures(entry: Validation) -> list[tuple[str, str]]:
    """Pictures of a scene as data addresses, each with its caption."""
    kd = entry.scene.material.kd[0]
    basis = entry.comparisons[0].basis if entry.comparisons else "nothing"
    surfaces = entry.measured.sizes["realisation"]
    pictures = [
        (plots.effects(entry.comparisons), _EFFECTS.format(basis=basis)),
        (
            plots.lobes(entry.measured, entry.predicted, entry.scene, kd),
            _LOBES.format(kd=kd, basis=basis, bound=_BOUND if surfaces == 1 else ""),
        ),
        (plots.albedos(entry.measured, entry.predicted, entry.scene, kd), _ALBEDOS),
    ]
    if entry.heightfield is not None:
        pictures.append((plots.surface(entry.heightfield, entry.scene), _SURFACE))
    return [(_svg(figure), caption) for figure, caption in pictures]


def _svg(figure: Figure) -> str:
    """A figure as the address of an SVG image: nothing in it can run."""
    buffer = io.BytesIO()
    # A fixed salt and no date: the same figures give the same bytes.
    with rc_context({"svg.hashsalt": "microsurf"}):
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    return "data:image/svg+xml;base64," + base64.b64encode(buffer.getvalue()).decode()
