"""report.json: all figures of a report for programs."""

import json
import platform
import shlex
import sys
from collections.abc import Iterable
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from .. import __version__
from ..analysis import regression
from ..analysis.validation import Validation, as_json
from ..files import whole_file
from ..invariants import Invariant, as_rows, broken
from ..results import uncertainty

LIBRARIES = (
    "click", "embreex", "filelock", "h5netcdf", "jinja2", "matplotlib", "mpmath", "numba", "numpy",
    "psutil", "scipy", "tomli-w", "tqdm", "trimesh", "xarray",
)  # fmt: skip
"""What microsurf needs to run."""


def of_scene(entry: Validation) -> dict[str, Any]:
    """Figures of one scene; their errors take most of a second."""
    return {**as_json(entry), "errors": uncertainty.as_json(entry.measured, entry.scene)}


def of(
    scenes: list[dict[str, Any]],
    seed: int,
    lasting: Iterable[Invariant] = (),
    old: tuple[str, dict[str, Any]] | None = None,
) -> dict[str, Any]:
    """Give the document of report.json, of figures of scenes, see `of_scene`.

    report.schema.json beside this file describes it.
    """
    lasting = list(lasting)
    content = {
        "schema": regression.SCHEMA,
        "microsurf": __version__,
        "seed": seed,
        "command": shlex.join(["microsurf", *sys.argv[1:]]),
        "python": platform.python_version(),
        "libraries": versions(),
        "scenes": list(scenes),
        "invariants": as_rows(lasting),
        "broken": broken(lasting),
    }
    return content | {
        "baseline": None if old is None else regression.against(content, old[1], old[0])
    }


def versions() -> dict[str, str]:
    """Installed versions of LIBRARIES; embreex is not to be had on every machine."""
    installed = {}
    for name in LIBRARIES:
        with suppress(PackageNotFoundError):
            installed[name] = version(name)
    return installed


def save(document: dict[str, Any], path: Path) -> None:
    """Write a document as strict JSON."""
    text = json.dumps(document, indent=1, default=_plain, allow_nan=False)
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def _plain(value: Any) -> Any:
    """What json does not know: arrays and numpy numbers become lists and numbers."""
    return value.tolist()
