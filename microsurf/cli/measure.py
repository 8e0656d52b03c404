"""microsurf measure: ray-trace a surface."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click
import numpy as np
import xarray as xr

from .. import memory
from ..errors import InputError, MicrosurfError
from ..files import behind_links, check_writable
from ..results import albedos, datasets, detector, uncertainty
from ..scene import Scene
from ..surface import FORMATS, endings_text, layered_mesh, notes_on_file
from ..trace import checkpoint, measure
from ..trace.cluster import WorkerPool, connected
from .options import (
    INPUT,
    PATH,
    Listing,
    accuracy,
    allow_truncated_tail,
    as_json,
    check_described,
    check_from_file,
    check_tail,
    compose,
    dry_run,
    generated,
    light,
    material,
    of_file,
    roughness,
    say,
    seed,
    workers,
)
from .output import check_ending, show
from .planned import planned


@click.command("measure")
@click.argument("scene_file", type=INPUT, required=False, metavar="[SCENE.toml]")
@click.option(
    "--surface",
    "surface_file",
    type=INPUT,
    cls=Listing,
    listing=lambda: [
        "Trace this heightfield instead of a generated one",
        *(f"{endings_text(f.endings)}: {f.label}" for f in FORMATS.values() if f.read),
    ],
)
@of_file
@roughness
@material
@generated
@light
@accuracy
@click.option("--realisations", type=int, help="Surfaces of the same kind. Default 4.")
@allow_truncated_tail
@seed
@workers
@click.option("--scheduler", metavar="tcp://HOST:PORT", help="Work on a dask cluster instead.")
@click.option("--out", type=PATH, help="Write the result as FILE.nc.")
@click.option("--resume", is_flag=True, help="Go on with a run to --out that was killed.")
@dry_run
@as_json
def measure_command(
    scene_file: Path | None, seed: int, workers: int | None, scheduler: str | None,
    out: Path | None, resume: bool, allow_truncated_tail: bool, dry_run: bool,
    as_json: bool, **given: Any,
) -> None:  # fmt: skip
    """Ray-trace a surface and print its albedos with their standard errors.

    Example: microsurf measure --gamma 2 --sigma 0.5 --n 1.5 --kd 0.8 --theta 60

    \b
    Until an error is reached, with what that takes said before; on the machines of
    a cluster; gone on with if killed (what is finished lies in m.nc.parts):
      microsurf measure scene.toml --standard-error 1e-3 --dry-run
      microsurf measure scene.toml --standard-error 1e-3 --out m.nc
      microsurf measure scene.toml --scheduler tcp://localhost:8786 --out m.nc
      microsurf measure scene.toml --standard-error 1e-3 --out m.nc --resume
    """  # noqa: D301 - click keeps the lines after \b as they are
    if given["surface_file"] is None:
        check_described(scene_file, given)
    scene = compose(scene_file, choose_mesh=True, **given)
    check_from_file(scene, given)
    stated = {**check_tail(scene, allow_truncated_tail), **say(notes_on_file(scene))}
    memory.require_lobes(scene.surface.realisations, scene.light.angles)
    parts = None
    if out is not None:
        check_ending(out, ".nc")
        check_writable(out)
        target = behind_links(out)  # the work items must lie on the same disk
        parts = target.with_name(f"{target.name}.parts")
    elif resume:
        raise InputError("--resume: goes with --out FILE.nc, beside which the work items lie")
    of_layers: dict[str, Any] = {}
    if scene.layers is not None:
        # Surfaces that cross are refused before any work.
        of_layers = {"layers": layered_mesh(scene, seed, 0).report()}
    surface_paths = None
    if dry_run or scene.accuracy.standard_error is not None:
        planned_run = planned(scene, seed, workers)
        if dry_run:
            show(planned_run.as_json(), as_json)
            return
        scene, surface_paths = planned_run.begun(scene), planned_run.scene.accuracy.paths
    with _pool(scheduler, workers) as pool:
        measured = measure(
            scene,
            seed=seed,
            workers=pool.workers if pool else workers,
            executor=pool.executor if pool else None,
            checkpoint=parts,
            resume=resume,
            surface_paths=surface_paths,
            progress=True,
        )
    paths = float(measured.paths.sum())
    values = {
        **albedos.figures(measured),
        **albedos.losses(measured),
        "paths": int(paths),
        "light_rays": int(measured.light_rays.sum()),
        "rays": int(measured.attrs["rays"]),
        "grazes": int(measured.attrs["grazes"]),
        "leaks": int(measured.leaks.sum()),
        "seconds": measured.attrs["seconds"],
        "paths_per_second": paths / measured.attrs["seconds"],
        "engine": measured.attrs["engine"],
        "embree_ratio": measured.attrs["embree_ratio"],
        **of_layers,
        **stated,
    }
    errors = uncertainty.as_json(measured, scene)
    values["errors"] = errors if as_json else _for_people(errors)
    if scene.accuracy.standard_error is not None:
        values |= _reached(measured, scene)
        _say(values, scene)
    if out is not None and parts is not None:
        _save(measured, out, parts)
        values["file"] = str(out)
    show(values, as_json)


def _for_people(errors: list[dict[str, Any]]) -> str:
    """What to buy next for the total albedo, the worst angle and Kd."""
    totals = [row for row in errors if row["quantity"] == "total"]
    if not totals:
        return "none: nothing is reflected"
    worst = max(totals, key=lambda row: row["error"] / (row["mean"] or 1.0))
    return f"total albedo at {worst['theta_i']:g}°: {worst['advice']}"


@contextmanager
def _pool(scheduler: str | None, workers: int | None) -> Iterator[WorkerPool | None]:
    """Workers of a cluster, or None: threads."""
    if scheduler is None:
        yield None
        return
    if workers is not None:
        raise InputError(
            f"--workers {workers} and --scheduler {scheduler}: give one of both; "
            "a cluster has the workers that were started for it"
        )
    with connected(scheduler) as pool:
        yield pool


def _save(measured: xr.Dataset, out: Path, parts: Path) -> None:
    """Write the result, then remove the work items; killed in between, it leaves no half file."""
    whole, out = parts / checkpoint.RESULT, behind_links(out)
    datasets.save(measured, whole)
    try:
        whole.replace(out)
    except OSError as error:
        raise MicrosurfError(
            f"{out}: could not be written ({error.strerror}); "
            "what is finished is kept, start again with --resume"
        ) from error
    checkpoint.clear(parts)


def _reached(measured: xr.Dataset, scene: Scene) -> dict[str, Any]:
    """What a run that was asked for an error came to; lists as in `albedos.figures`."""

    def lobes(kd: float) -> list[float]:
        """Greater error of both lobes at each angle."""
        kinds = [measured.microsurf.lobe_error(kind, kd=kd) for kind in detector.KINDS]
        return list(np.max([errors.values.ravel() for errors in kinds], axis=0).tolist())

    paths = measured.paths.sum("realisation").values.ravel()
    by_angle = list(zip(*map(lobes, scene.material.kd), strict=True))
    return {
        "lobe_error": _listed([_listed(list(row)) for row in by_angle]),
        "realisations": measured.sizes["realisation"],
        "paths_by_angle": _listed(paths.astype(int).tolist()),
        "reached": uncertainty.surplus(measured, scene) <= 1,
    }


def _listed(values: list[Any]) -> Any:
    return values[0] if len(values) == 1 else values


def _say(values: dict[str, Any], scene: Scene) -> None:
    """Tell on stderr whether the error asked for was reached."""
    error, lobe = scene.accuracy.standard_error, scene.accuracy.lobe_error
    albedo, lobes = (np.max(values[key]) for key in ("albedo_se", "lobe_error"))
    click.echo(
        f"{'reached' if values['reached'] else 'NOT reached'}: "
        f"standard error of albedos {albedo:.2g} (asked {error:g}), "
        f"of lobes {lobes:.2g} of themselves (asked {lobe or error:g}), "
        f"with {values['paths']:.3g} paths on {values['realisations']} realisations",
        err=True,
    )
