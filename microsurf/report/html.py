"""report.html, one self-contained file, and what lies beside it."""

import base64
import platform
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup, escape

from .. import memory
from ..analysis.validation import Validation
from ..files import whole_file
from ..invariants import Invariant
from ..results import albedos, uncertainty
from . import albedo_table, attachments, citations, json_document
from . import scene_figures as pictures
from .figures.figure import Picture, save
from .junit import to_junit
from .markdown import to_markdown
from .section import Section, Table

_CODE = re.compile(r"`([^`]+)`")


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


@dataclass(frozen=True)
class Drawn:
    """What a finished scene shows, its pictures written, and its figures for report.json."""

    figures: list[_Shown]
    parts: list[_Part]
    cites: list[str]
    document: dict[str, Any]


class Report:
    """A report that grows: each scene is drawn once, when it is finished, and the page written.

    report.html needs nothing beside it. Beside it lie, at the end, report.json, report.md and
    junit.xml, references.bib, constraints.txt; figures/, three files each; data/, results as
    netCDF; scenes/. The page is written last, so that it never speaks of what is not there.

    Parameters
    ----------
    out : Path
        The folder.
    names : sequence of str
        Of all scenes that will be added, in their order.
    seed : int
        That of all scenes.

    Raises
    ------
    InputError
        If the folder can't be made or written.
    MicrosurfError
        If there is no room, here and whenever something is added.

    """

    def __init__(self, out: Path, names: Sequence[str], seed: int) -> None:
        attachments.make_folders(out)
        self._out, self._seed, self._names = out, seed, list(names)
        self._slugs = attachments.slugs(names)
        self._room = attachments.DATA_BYTES
        self._entries: list[Validation] = []
        self._scenes: list[dict[str, Any]] = []
        self._drawn: list[dict[str, Any]] = []
        self._cited: list[str] = []

    def slug(self, name: str) -> str:
        """What the files of a scene are called by."""
        return self._slugs[self._names.index(name)]

    def draw(self, entry: Validation, further: Sequence[Section] = ()) -> Drawn:
        """Write a scene's pictures, those of further sections after its own.

        Any process may do that, at any time before `add`.
        """
        slug, figures = self.slug(entry.name), self._out / "figures"
        return Drawn(
            [_show(picture, figures) for picture in pictures.of_scene(entry, slug)],
            [_part(part, slug, figures) for part in further],
            [key for part in further for key in part.cites],
            json_document.of_scene(entry),
        )

    def add(self, entry: Validation, drawn: Drawn) -> None:
        """Take in the next scene, and write its results."""
        slug = self._slugs[len(self._entries)]
        files = attachments.attach(entry, slug, self._out, self._seed, self._room)
        self._room -= files.size
        self._drawn.append(
            {"entry": entry, "files": files, "figures": drawn.figures, "parts": drawn.parts}
        )
        self._cited += drawn.cites
        self._entries.append(entry)
        self._scenes.append(drawn.document)

    def write_so_far(self) -> None:
        """Write the page of the scenes that are finished; it says which are not."""
        content = json_document.of(self._scenes, self._seed)
        waiting = self._names[len(self._entries) :]
        page = self._page(content, [], (), self._references(), waiting)
        _write(self._out / "report.html", page)

    def finish(
        self,
        lasting: Iterable[Invariant] = (),
        old: tuple[str, dict[str, Any]] | None = None,
        of_all: Sequence[Section] = (),
    ) -> dict[str, Any]:
        """Write all; returns the document of report.json.

        Parameters
        ----------
        lasting : iterable of Invariant
            What must hold whatever the scene, see `invariants.global_invariants`.
        old : (str, dict), optional
            Name and document of a report to compare with, see `regression`.
        of_all : sequence of Section
            Further sections of the whole report, before the scenes.

        """
        content = json_document.of(self._scenes, self._seed, lasting, old)
        references = self._references([key for part in of_all for key in part.cites])
        page = self._page(content, pictures.of_all(self._entries), of_all, references)
        json_document.save(content, self._out / "report.json")
        for name, text in (
            ("report.md", to_markdown(content)),
            ("junit.xml", to_junit(content)),
            ("references.bib", citations.bibtex(references)),
            ("constraints.txt", attachments.constraints(content["libraries"])),
            ("report.html", page),
        ):
            _write(self._out / name, text)
        return content

    def _references(self, cited: Sequence[str] = ()) -> Any:
        return citations.collect(self._entries, [*cited, *self._cited])

    def _page(
        self,
        content: dict[str, Any],
        overview: Sequence[Picture],
        of_all: Sequence[Section],
        references: Any,
        waiting: Sequence[str] | None = None,
    ) -> str:
        out, figures = self._out, self._out / "figures"
        return (
            environment()
            .get_template("report.html.jinja")
            .render(
                document=content,
                machine=_machine(),
                quantities=albedos.QUANTITIES | uncertainty.LOBES,
                verdicts=albedos.QUANTITIES,
                overview=[_show(picture, figures) for picture in overview],
                parts=[_part(part, "all", figures) for part in of_all],
                scenes=[
                    {**drawn, "data": data}
                    for drawn, data in zip(self._drawn, content["scenes"], strict=True)
                ],
                waiting=waiting,
                references=references,
                megabytes={name: _size(out / name) / 1e6 for name in attachments.FOLDERS},
                bound=attachments.DATA_BYTES / 2**20,
            )
        )


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
    """Write the report of scenes that are all finished, see `Report`."""
    report = Report(out, [entry.name for entry in entries], seed)
    for entry in entries:
        report.add(entry, report.draw(entry, (of_scenes or {}).get(entry.name, ())))
    return report.finish(lasting, old, of_all)


def _write(path: Path, text: str) -> None:
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def _part(part: Section, where: str, figures: Path) -> _Part:
    shown = [_show(picture, figures) for picture in part.pictures]
    return _Part(f"{where}-{part.name}", part.title, part.paragraphs, part.tables, shown)


def _show(picture: Picture, figures: Path) -> _Shown:
    """Write a picture, and give it as the address of an image: nothing in it can run."""
    contents = save(picture, figures)
    shown, kind = ("svg", "svg+xml") if "svg" in contents else ("png", "png")
    address = f"data:image/{kind};base64," + base64.b64encode(contents[shown]).decode()
    files = tuple((end.upper(), f"{figures.name}/{picture.name}.{end}") for end in contents)
    return _Shown(picture.name, picture.caption, picture.figure.get_figwidth(), address, files)


@cache
def environment() -> jinja2.Environment:
    """Give what templates are read by, the same each time: it has compiled what it has read.

    All texts are escaped.
    """
    templates = jinja2.Environment(
        loader=jinja2.PackageLoader("microsurf.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    templates.filters |= {"signed": albedo_table.signed, "grouped": _grouped, "code": _with_code}
    templates.globals |= {"albedo_columns": albedo_table.columns, "marks": albedo_table.MARKS}
    return templates


def _grouped(value: int) -> str:
    """Thousands apart by thin spaces."""
    return f"{value:,}".replace(",", "\u202f")


def _with_code(text: str) -> Markup:
    """Escape a text; what stands between backticks in it becomes code."""
    return Markup(_CODE.sub(r"<code>\1</code>", str(escape(text))))  # noqa: S704 - escaped


def _machine() -> str:
    """On what it ran, without its name."""
    return f"{platform.system()} {platform.machine()}, {memory.cores()} CPUs"


def _size(folder: Path) -> int:
    return sum(file.stat().st_size for file in folder.iterdir() if file.is_file())
