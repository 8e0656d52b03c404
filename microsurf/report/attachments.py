"""What lies beside the page: scenes, results, references, versions; and how to do it again."""

import os
import re
import shlex
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from ..analysis.validation import Validation
from ..errors import InputError
from ..files import check_writable, whole_file
from ..results import datasets
from ..scene import Scene

FOLDERS = ("figures", "data", "scenes")
DATA_BYTES = 512 * 2**20
"""Results of a report take no more room than this; the rest is left out, and the page says so."""


_ARRAY = re.compile(r"\[\n((?:    [^\n]*,\n)+)\]")


@dataclass(frozen=True)
class Attached:
    """What lies beside the page for one scene; addresses are relative to it.

    ``toml`` is the scene as it was asked, ``command`` what does it again alone, from the
    report's folder, to the same bits. ``left_out`` says what there was no room for, ``size``
    what the results took of it in bytes.
    """

    slug: str
    toml: str
    command: str
    scene: str
    data: tuple[tuple[str, str], ...]
    left_out: int
    size: int


def make_folder(folder: Path) -> None:
    """Make a folder for what a command writes, before any work is done for it.

    Raises
    ------
    InputError
        If it can't be made or written.

    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"{folder}: can't be made a folder ({error.strerror}); choose another"
        ) from error
    check_writable(folder / "report.html")


def make_folders(out: Path) -> None:
    """Make the folder of a report, and those in it."""
    for folder in (out, *(out / name for name in FOLDERS)):
        make_folder(folder)


def slugs(names: Iterable[str]) -> list[str]:
    """Names that fit files and addresses, one for each name and no two the same."""
    names_used: list[str] = []
    for name in names:
        base = re.sub(r"[^A-Za-z0-9._-]+", "-", name).strip("._-")[:80] or "scene"
        slug, number = base, 2
        while slug.lower() in {other.lower() for other in names_used}:
            slug, number = f"{base}-{number}", number + 1
        names_used.append(slug)
    return names_used


def attach(entry: Validation, slug: str, out: Path, seed: int, room: int) -> Attached:
    """Write scenes/NAME.toml and data/NAME-*.nc of a scene, of at most ``room`` bytes."""
    toml = _asked(entry, out / "scenes")
    scene = f"scenes/{slug}.toml"
    with whole_file(out / scene) as temporary:
        temporary.write_text(toml, encoding="utf-8", newline="\n")
    data, left_out, size = [], 0, 0
    for label, dataset in {"measured": entry.measured, **entry.predicted}.items():
        name = f"data/{slug}-{slugs([label])[0]}.nc"
        if size + dataset.nbytes > room:
            left_out += 1
            continue
        datasets.save(dataset, out / name, rounded=True)
        size += dataset.nbytes
        data.append((label, name))
    again = ["microsurf", "validate", scene, "--seed", str(seed), "--out", f"again/{slug}"]
    return Attached(slug, toml, shlex.join(again), scene, tuple(data), left_out, size)


def _asked(entry: Validation, folder: Path) -> str:
    """The scene as it was measured, not as it was fitted; its file is named from ``folder``."""
    scene = Scene.from_toml(entry.measured.attrs["scene"])
    if scene.surface.file is not None:
        file = os.path.relpath(scene.surface.file, folder)
        scene = replace(scene, surface=replace(scene.surface, file=Path(file).as_posix()))
    return _ARRAY.sub(_on_one_line, scene.to_toml())


def _on_one_line(array: re.Match[str]) -> str:
    """Give an array as people write it; its items have no line breaks of their own."""
    return "[" + ", ".join(line.strip(" ,") for line in array[1].splitlines()) + "]"


def constraints(versions: Mapping[str, str]) -> str:
    """Text of constraints.txt: the versions that ran."""
    return "".join(f"{name}=={number}\n" for name, number in versions.items())
