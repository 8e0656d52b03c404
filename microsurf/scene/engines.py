"""Every ray engine as one entry: what it is called, what it does, and where its code is.

A new engine is one file with its `trace.engine.Tracer` and one entry in ENGINES. Scenes,
`--engine` with its help, the tracer and the citations take what they know of engines from here.
"""

from dataclasses import dataclass

from . import validators
from .citation import Citation

AUTO = "auto"
"""In files and on the command line: the engine of scenes that name none."""


@dataclass(frozen=True)
class Engine:
    """One entry.

    Attributes
    ----------
    key : str
        Its name in scenes, on the command line and in results.
    label : str
        Its name in sentences.
    what : str
        What it does, in one line, for the help.
    citations : tuple of str or Citation
        What it rests on: keys of `report.references`, or works that are not in that list.
    loader : str
        "MODULE:NAME" of its `trace.engine.Tracer`. The module is imported when the engine first
        traces: a scene that names an engine needs none of its libraries.

    """

    key: str
    label: str
    what: str
    citations: tuple[str | Citation, ...]
    loader: str


ENGINES: dict[str, Engine] = {
    entry.key: entry
    for entry in (
        Engine(
            "exact", "exact", "walks over the heights in float64 and loses no light",
            (), "microsurf.trace.engine:EXACT",
        ),
        Engine(
            "embree", "Embree", "intersects triangles in float32",
            ("wald2014",), "microsurf.trace.engine:EMBREE",
        ),
    )
}  # fmt: skip
"""In the order of the help."""


def checked(key: str) -> str | None:
    """Key of an engine that is in the list; None for "auto".

    Raises
    ------
    InputError
        If it is neither.

    """
    allowed = (AUTO, *ENGINES)
    validators.require(key in allowed, "accuracy.engine", key, ", ".join(allowed))
    return None if key == AUTO else key
