"""microsurf validate: the main job."""

import sys
import time
from contextlib import closing
from pathlib import Path
from typing import Any

import click

from .. import memory, model, report
from ..analysis import regression
from ..analysis.fitted_theory import prepare
from ..analysis.planning import Plan
from ..analysis.self_test import SelfTest, self_test
from ..analysis.stages import Run
from ..analysis.validation import Validation
from ..errors import InputError
from ..report import sections
from ..results import uncertainty
from ..scene import Accuracy, Scene, expectation
from ..scene.builtin import built_in_scenes
from ..scene.layers import refuse
from ..surface import StdFit
from ..trace.engine import AUTO
from . import scene_job, side_by_side
from .options import (
    INPUT,
    PATH,
    accuracy,
    allow_truncated_tail,
    as_json,
    check_tail,
    compose,
    dry_run,
    resume,
    say,
    seed,
    workers,
)
from .output import show, write
from .planned import planned

_ON_TOP = (
    "This is the measuring alone: walks, the budget, the discretisation error (--no-refine does "
    "without) and the report come on top."
)


@click.command("validate")
@click.argument("scene_files", type=INPUT, nargs=-1, metavar="[SCENE.toml …]")
@click.option("--out", type=PATH, default=Path("reports/latest"), show_default=True)
@accuracy
@click.option("--realisations", type=int, help="Instead of what the scenes ask for.")
@click.option(
    "--model",
    "user_brdf",
    metavar="MODULE:CALLABLE|TABLE.csv|mitsuba:PLUGIN,KEY=VALUE,…",
    help="A user BRDF in the model's place: f(i, o), a pair (f_specular, f_body) of order 1 or "
    "one array of all orders; a table; or a BSDF of Mitsuba, with what the scene says filled in.",
)
@click.option(
    "--baseline",
    "old",
    type=INPUT,
    metavar="REPORT.json",
    help="Tell what moved beyond its error since this report; it does not change the exit code.",
)
@click.option(
    "--refine/--no-refine",
    "refined",
    default=True,
    show_default=True,
    help="Measure the discretisation error: a dozen surfaces more for each scene.",
)
@resume
@click.option(
    "--self-test",
    "check_again",
    is_flag=True,
    help="Check microsurf itself now (invariants whatever the scene, digits of its formulas); "
    "without it the last result is remembered, for each version and machine.",
)
@allow_truncated_tail
@seed
@workers
@dry_run
@as_json
def validate_command(
    scene_files: tuple[Path, ...], out: Path, user_brdf: str | None, old: Path | None,
    refined: bool, resume: bool, check_again: bool, allow_truncated_tail: bool, seed: int,
    workers: int | None, dry_run: bool, as_json: bool, **given: Any,
) -> None:  # fmt: skip
    """Measure, predict, compare, and write the report; the built-in scenes by default.

    Example: microsurf validate my_scene.toml --out my_report

    A user BRDF: microsurf validate my_scene.toml --model mypackage:brdf

    A renderer's: microsurf validate my_scene.toml --model mitsuba:roughplastic,nonlinear=true

    Until an error is reached, with what that takes said before:
    microsurf validate my_scene.toml --standard-error 1e-3 --dry-run
    """
    files = scene_files or built_in_scenes()
    scenes = {file.stem: compose(file, choose_mesh=True, **given) for file in files}
    if len(scenes) < len(files):
        raise InputError("two scene files have the same name; rename one")
    before = None if old is None else (str(old), regression.read_report(old))
    brdf = None if user_brdf is None else _loaded(user_brdf, scenes)
    if brdf is not None and not scene_files:  # a mirror's spike is no f(i, o)
        scenes = {name: scene for name, scene in scenes.items() if model.has_values(scene)}
    broken = {} if brdf is None else _examined(brdf, scenes)
    for scene in scenes.values():
        check_tail(scene, allow_truncated_tail)
        memory.require_lobes(scene.surface.realisations, scene.light.angles)
    begin = time.perf_counter()
    prepared = _prepared(scenes)
    if dry_run:
        plans = _plans(scenes, seed, workers)
        click.echo(_ON_TOP, err=True)
        show(_planned(plans) if as_json else _costs(plans), as_json)
        return
    report.make_folders(out)  # before any work
    adaptive = {k: v for k, v in scenes.items() if v.accuracy.standard_error is not None}
    plans = _plans(adaptive, seed, workers)
    scenes |= {name: plans[name].begun(scene) for name, scene in adaptive.items()}
    run = Run(out, resume=resume)
    page = report.Report(out, list(scenes), seed)
    processes = scene_job.at_once(list(scenes.values()), workers)
    job = scene_job.SceneJob(
        scenes,
        prepared,
        {name: plan.scene.accuracy.paths for name, plan in plans.items()},
        None if brdf is None else (brdf, broken),
        run,
        page,
        {"seed": seed, "refined": refined},
        max((workers or memory.cores()) // processes, 1),
    )
    results = []
    with closing(
        side_by_side.in_order(job, list(scenes), processes, scene_job.compile_apart)
    ) as finished:
        for entry, drawn in finished:
            results.append(entry)
            page.add(entry, drawn)
            page.write_so_far()
    # The digits of the formulas take half a minute, and are shown with the main job alone.
    checked = _of_microsurf(
        run, seed, workers, digits=not scene_files, again=check_again, engine=given["engine"]
    )
    document = page.finish(checked.invariants, before, sections.of_all(results, checked))
    run.finish()
    unexpected = report.unexpected(document)
    values = {
        "scenes": list(scenes),
        "verdicts": _counts(results),
        "unexpected": len(unexpected),
        **_reached(results, adaptive),
        "broken": document["broken"] + [text for entry in results for text in entry.broken],
        "seconds": time.perf_counter() - begin,
        "out": str(out),
    }
    if as_json:
        values |= {"findings": unexpected, **_moved(document)}
    show(values, as_json)
    if not as_json:
        write("\n".join([*report.movements(document), f"\nreport: {out / 'report.html'}"]))
    for line in unexpected:
        click.echo(f"unexpected: {line}", err=True)
    if unexpected:
        sys.exit(1)


def _of_microsurf(
    run: Run, seed: int, workers: int | None, *, digits: bool, again: bool, engine: str | None
) -> SelfTest:
    """What holds whatever the scene: invariants, and how many digits of the formulas are right."""
    name = Accuracy(engine=engine).engine or AUTO
    return run.stages(seed=seed, digits=digits, again=again, engine=name).done(
        "self-test",
        lambda: self_test(seed, workers, digits=digits, again=again, progress=True, engine=name),
    )


def _loaded(user_brdf: str, scenes: dict[str, Scene]) -> model.UserBrdf:
    """What `--model` names; it is judged as one surface."""
    for scene in scenes.values():
        refuse(scene.layers, "--model")
    return model.load_user_brdf(user_brdf)


def _examined(brdf: model.UserBrdf, scenes: dict[str, Scene]) -> dict[str, list[str]]:
    """What is wrong with a user BRDF on each scene, when what there is to say of it is said."""
    broken = {name: model.examine(brdf, scene) for name, scene in scenes.items()}
    for scene in scenes.values():
        say(brdf.remarks(scene))
    return broken


def _prepared(scenes: dict[str, Scene]) -> dict[str, tuple[StdFit | None, list[str]]]:
    """What there is to say and to refuse of surfaces from files, before any is traced."""
    prepared = {name: prepare(scene) for name, scene in scenes.items()}
    for _, notes in prepared.values():
        say(notes)
    return prepared


def _costs(plans: dict[str, Plan]) -> dict[str, Any]:
    """What measuring takes; walks, budgets and the report come on top of the time."""
    return {
        "seconds": sum(plan.seconds for plan in plans.values()),
        "memory_bytes": max(plan.memory for plan in plans.values()),
    }


def _plans(scenes: dict[str, Scene], seed: int, workers: int | None) -> dict[str, Plan]:
    return {name: planned(scene, seed, workers, name) for name, scene in scenes.items()}


def _planned(plans: dict[str, Plan]) -> dict[str, Any]:
    """What `--dry-run --json` prints."""
    return {"scenes": {name: plan.as_json() for name, plan in plans.items()}, **_costs(plans)}


def _reached(results: list[Validation], adaptive: dict[str, Scene]) -> dict[str, Any]:
    """Whether the errors asked for were reached, if any were."""
    if not adaptive:
        return {}
    return {
        "reached": {
            entry.name: uncertainty.surplus(entry.measured, adaptive[entry.name]) <= 1
            for entry in results
            if entry.name in adaptive
        }
    }


def _counts(results: list[Validation]) -> dict[str, int]:
    verdicts = [row.verdict for entry in results for row in entry.comparisons]
    return {word: verdicts.count(word) for word in expectation.VERDICTS}


def _moved(document: dict[str, Any]) -> dict[str, Any]:
    """What `--baseline` adds to ``--json``."""
    against = document["baseline"]
    return {} if against is None else {"moved": against["moved"], "baseline": against}
