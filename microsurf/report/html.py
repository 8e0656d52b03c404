"""report.html, one self-contained file, and what lies beside it."""

import base64
import platform
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jinja2

from .. import memory
from ..analysis.validate import Validation
from ..files import whole_file
from ..invariants import Invariant
from ..results import albedos, uncertainty
from . import attachments, citations, json_document
from . import scene_figures as pictures
from .figures.figure import ENDINGS, Picture, save
from .junit import to_junit
from .markdown import to_markdown
from .section import Section, Table


@dataclass(frozen=True)
class _Shown:
    """A picture that was written: its width in inches, its address, and those of its files."""

    name: str
    caption: str
    width: float
    address: str
    files: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class _Part:
    """A section whose pictures were written."""

    anchor: str
    title: str
    paragraphs: list[str]
    tables: tuple[Table, ...]
    pictures: list[_Shown]


def write(
    entries: Sequence[Validation],
    out: Path,
    seed: int,
    *,
    lasting: Iterable[Invariant] = (),
    old: tuple[str, dict[str, Any]] | None = None,
    of_all: Sequence[Section] = (),
    of_scenes: Mapping[str, Sequence[Section]] | None = None,
) -> dict[str, Any]:
    """Write a report into the folder ``out``; returns the document of report.json.

    report.html needs nothing beside it. Beside it lie report.json, report.md and junit.xml,
    references.bib, constraints.txt; figures/, three files each; data/, results as netCDF; scenes/.
    The page is written last, so that it never speaks of what is not there.

    Parameters
    ----------
    entries : sequence of Validation
        The scenes, in the order of the page.
    out : Path
        The folder.
    seed : int
        That of all scenes.
    lasting : iterable of Invariant
        What must hold whatever the scene, see `invariants.global_invariants`.
    old : (str, dict), optional
        Name and document of a report to compare with, see `baseline`.
    of_all : sequence of Section
        Further sections of the whole report, before the scenes.
    of_scenes : mapping from the names of entries to sequences of Section
        Further sections of single scenes, after their own figures.

    Raises
    ------
    InputError
        If the folder can't be made or written.
    MicrosurfError
        If there is no room.

    """
    attachments.make_folders(out)
    further = of_scenes or {}
    entries = list(entries)
    content = json_document.of(entries, seed, lasting, old)
    attached = attachments.attach(entries, out, seed)
    cited = [key for part in (*of_all, *_chain(further)) for key in part.cites]
    references = citations.collect(entries, cited)
    figures = out / "figures"
    page = _template().render(
        document=content,
        machine=_machine(),
        quantities=albedos.QUANTITIES | uncertainty.LOBES,
        verdicts=albedos.QUANTITIES,
        overview=[_show(picture, figures) for picture in pictures.of_all(entries)],
        parts=[_part(part, "all", figures) for part in of_all],
        scenes=[
            {
                "entry": entry,
                "data": data,
                "files": files,
                "figures": [_show(p, figures) for p in pictures.of_scene(entry, files.slug)],
                "parts": [_part(part, files.slug, figures) for part in further.get(entry.name, ())],
            }
            for entry, data, files in zip(entries, content["scenes"], attached, strict=True)
        ],
        references=references,
        megabytes={name: _size(out / name) / 1e6 for name in attachments.FOLDERS},
        bound=attachments.DATA_BYTES / 2**20,
    )
    json_document.save(content, out / "report.json")
    for name, text in (
        ("report.md", to_markdown(content)),
        ("junit.xml", to_junit(content)),
        ("references.bib", citations.bibtex(references)),
        ("constraints.txt", attachments.constraints(content["libraries"])),
        ("report.html", page),
    ):
        with whole_file(out / name) as temporary:
            temporary.write_text(text, encoding="utf-8", newline="\n")
    return content


def _chain(further: Mapping[str, Sequence[Section]]) -> Iterable[Section]:
    return (part for parts in further.values() for part in parts)


def _part(part: Section, where: str, figures: Path) -> _Part:
    shown = [_show(picture, figures) for picture in part.pictures]
    return _Part(f"{where}-{part.name}", part.title, part.paragraphs, part.tables, shown)


def _show(picture: Picture, figures: Path) -> _Shown:
    """Write a picture, and give it as the address of an SVG image: nothing in it can run."""
    text = save(picture, figures)
    address = "data:image/svg+xml;base64," + base64.b64encode(text.encode()).decode()
    files = tuple((end.upper(), f"{figures.name}/{picture.name}.{end}") for end in ENDINGS)
    return _Shown(picture.name, picture.caption, picture.figure.get_figwidth(), address, files)


def _template() -> jinja2.Template:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("microsurf.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"signed": _signed, "grouped": _grouped}
    return environment.get_template("report.html.jinja")


def _grouped(value: int) -> str:
    """Thousands apart by thin spaces."""
    return f"{value:,}".replace(",", "\u202f")


def _signed(value: float, digits: int) -> str:
    """With its sign, a true minus; what rounds to zero has none."""
    text = f"{value:+.{digits}f}"
    return text[1:] if float(text) == 0 else text.replace("-", "−")


def _machine() -> str:
    """On what it ran, without its name."""
    return f"{platform.system()} {platform.machine()}, {memory.cores()} CPUs"


def _size(folder: Path) -> int:
    return sum(file.stat().st_size for file in folder.iterdir() if file.is_file())
