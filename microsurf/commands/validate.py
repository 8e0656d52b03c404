"""microsurf validate: the main job."""

import sys
import time
from pathlib import Path
from typing import Any

import click

from .. import expectation, memory, report
from ..errors import InputError
from ..invariants import broken as broken_of
from ..invariants import global_invariants
from ..validate import validate_scene
from .options import PATH, as_json, compose, seed, workers
from .output import show, write


def built_in_scenes() -> list[Path]:
    """Scene files that come with microsurf, in the order of their names."""
    here = Path(__file__).parent.parent
    folder = here / "scenes"
    if not folder.is_dir():  # a checkout, not an installed package
        folder = here.parent / "validation" / "scenes"
    return sorted(folder.glob("*.toml"))


@click.command("validate")
@click.argument("scene_files", type=PATH, nargs=-1, metavar="[SCENE.toml …]")
@click.option("--out", type=PATH, default=Path("reports/latest"), show_default=True)
@click.option("--paths", type=int, help="Instead of what the scenes ask for.")
@click.option("--realisations", type=int, help="Instead of what the scenes ask for.")
@seed
@workers
@as_json
def validate_command(
    scene_files: tuple[Path, ...], out: Path, seed: int, workers: int | None, as_json: bool,
    **given: Any,
) -> None:  # fmt: skip
    """Measure, predict, compare, and write the report; the built-in scenes by default.

    Example: microsurf validate my_scene.toml --out my_report
    """
    files = scene_files or built_in_scenes()
    scenes = {file.stem: compose(file, **given) for file in files}
    if len(scenes) < len(files):
        raise InputError("two scene files have the same name; rename one")
    for asked in scenes.values():
        memory.require_lobes(asked.surface.realisations, asked.light.angles)
    begin = time.perf_counter()
    report.make_folders(out)
    results = [
        validate_scene(name, asked, seed=seed, workers=workers, progress=True)
        for name, asked in scenes.items()
    ]
    lasting = global_invariants(seed, workers, progress=True)
    report.write(results, out, seed)
    rows = [row for entry in results for row in entry.comparisons]
    unexpected = [row for row in rows if row.unexpected]
    broken = broken_of(lasting) + [text for entry in results for text in entry.broken]
    values = {
        "scenes": list(scenes),
        "verdicts": {
            word: sum(row.verdict == word for row in rows) for word in expectation.VERDICTS
        },
        "unexpected": len(unexpected) + len(broken),
        "broken": broken,
        "seconds": time.perf_counter() - begin,
        "out": str(out),
    }
    show(values, as_json)
    if not as_json:
        write(f"\nreport: {out / 'report.html'}")
    if unexpected or broken:
        sys.exit(1)
