"""Convergence as a measurement: what mesh, tile, realisations and rays leave as error.

Around a scene's own settings one thing is varied at a time:

mesh
    cells for each correlation length, at the same tile in correlation lengths. Every
    step makes new surfaces of the same kind: the random field is drawn cell by cell, so
    one seed gives unrelated surfaces on two meshes, and nothing could be paired.
tile
    cells at the same correlation length; new surfaces again, more of them on small tiles.
realisations
    the first m of the same surfaces, compared with all of them; and the spread of means
    over groups of m that share none.
rays
    independent repeats on one and the same surface: how they spread, beside what the
    batches of each claim.

Differences are to the finest step and have 95 % intervals. An order of convergence is
given only where `trend.order` finds the data to allow it. Nothing is extrapolated.
"""

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from tqdm import tqdm

from ... import memory, seeds
from ...errors import InputError
from ...results import albedos
from ...scene import Scene, Surface
from ...scene.layers import refuse
from ...stats.convergence_order import difference, mean_of, order, part_and_whole, power
from ...stats.variance_components import components_of
from ...surface import surface_of
from ...trace import measure
from ..stages import Stages
from .steps import EFFORTS, ConvergenceEffort, mesh_steps, own, ray_counts, tile_steps

Row = dict[str, Any]
Array = NDArray[np.float64]


@dataclass
class Convergence:
    """Rows of each study, orders of convergence, powers, and what the scene's settings leave.

    ``note`` says in a line what could not be varied, or is empty.
    """

    mesh: list[Row] = field(default_factory=list)
    tile: list[Row] = field(default_factory=list)
    realisations: list[Row] = field(default_factory=list)
    rays: list[Row] = field(default_factory=list)
    orders: list[Row] = field(default_factory=list)
    powers: list[Row] = field(default_factory=list)
    left: list[Row] = field(default_factory=list)
    note: str = ""
    seconds: float = 0.0


def converge(
    scene: Scene,
    effort: ConvergenceEffort = EFFORTS["quick"],
    *,
    seed: int = 0,
    workers: int | None = None,
    progress: bool = False,
    stages: Stages | None = None,
) -> Convergence:
    """Vary mesh, tile, realisations and rays of a scene.

    ``stages``: where finished steps are kept and found; nowhere without it.

    Raises
    ------
    InputError
        As `measure`, or if the scene reflects nothing.

    """
    check(scene)
    places = list(_places(scene))
    stages = stages or Stages()
    convergence = Convergence()
    counts = ray_counts(scene, effort)
    varied = scene.requires.roughness and scene.surface.file is None
    meshes, tiles = (mesh_steps(scene, effort), tile_steps(scene, effort)) if varied else ([], [])
    if not varied:
        what = f"of {scene.surface.file}" if scene.requires.roughness else "flat"
        convergence.note = f"one surface, {what}: mesh, tile and realisations can't vary, rays do"
    elif max(step.cells for step in meshes) == scene.surface.cells:
        convergence.note = (
            f"no finer mesh than {scene.surface.cells} cells was made with this effort"
        )
    with tqdm(
        total=len(set(meshes + tiles)) + len(counts), disable=None if progress else True,
        desc="convergence", unit="step",
    ) as bar:  # fmt: skip
        done: dict[Surface, _Seen] = {}
        paths = min(effort.paths, scene.accuracy.paths)
        for k, step in enumerate(dict.fromkeys(meshes + tiles)):
            step_scene = replace(
                scene, surface=step, accuracy=scene.accuracy.with_paths(paths), expect={}
            )
            memory.require_lobes(step.realisations, scene.light.angles)
            traced = partial(measure, step_scene, seed=_seed(seed, k), workers=workers)
            done[step] = stages.done(f"step-{k}", partial(_seen, traced, places))
            bar.update()
        rays = []
        for k, count in enumerate(counts):
            seeds_of = seed, _seed(seed, 100 + k)
            repeats = partial(_repeat, scene, count, effort.repeats, seeds_of, workers)
            rays.append((count, stages.done(f"rays-{k}", partial(_seen, repeats, places))))
            bar.update()
    for case in places:
        for study, steps in (("mesh", meshes), ("tile", tiles)):
            _vary(convergence, study, case, [(step, done[step][case][0]) for step in steps])
        at = done[own(scene, effort)][case] if varied else None
        if at is not None:
            _realisations(convergence, case, at[0])
        _rays(convergence, case, [(count, values[case]) for count, values in rays])
        convergence.left.append(_left(convergence, case, scene, at))
    for row in (*convergence.mesh, *convergence.tile, *convergence.realisations):
        row["paths"] = paths  # for each angle and surface
    convergence.seconds = stages.seconds
    return convergence


@dataclass(frozen=True)
class _Place:
    """A quantity at one incidence."""

    quantity: str
    theta_i: float
    phi_i: float
    kd: float
    n: float

    @property
    def labels(self) -> Row:
        row = asdict(self)
        del row["n"]
        return row


_Values = tuple[Array, Array]
"""A quantity on each realisation, and the standard errors of its rays."""
_Seen = dict[_Place, _Values]


def check(scene: Scene) -> None:
    """Refuse what the study is not for."""
    refuse(scene.layers, "the study of convergence")
    if not list(_places(scene)):
        raise InputError(
            "material.n = 1 without a substrate: nothing is reflected; give kd > 0 or n > 1"
        )


def _places(scene: Scene) -> Iterator[_Place]:
    """All of them but those that are zero: no interface, no substrate, or neither."""
    interface = scene.requires.interface
    for name, theta, phi, kd in product(
        albedos.QUANTITIES, scene.light.theta, scene.light.phi, scene.material.kd
    ):
        there = {"specular": interface, "body": kd > 0, "total": interface or kd > 0}
        if there[name]:
            yield _Place(name, theta, phi, kd, scene.material.n)


def _seed(seed: int, step: int) -> int:
    """Seed of a step: its surfaces and rays are unrelated to those of other steps."""
    return seeds.derived(seed, seeds.CONVERGENCE, step)


def _repeat(
    scene: Scene, paths: int, repeats: int, seeds: tuple[int, int], workers: int | None
) -> xr.Dataset:
    """Independent rays on the scene's first surface, as realisations."""
    surfaces = None
    if scene.requires.roughness:
        surfaces = [surface_of(scene, seeds[0], 0)] * repeats
    surface = replace(scene.surface, realisations=repeats)
    step_scene = replace(
        scene, surface=surface, accuracy=scene.accuracy.with_paths(paths), expect={}
    )
    return measure(step_scene, surfaces, seed=seeds[1], workers=workers)


def _seen(trace: Callable[[], xr.Dataset], places: list[_Place]) -> _Seen:
    """Each quantity on each realisation; the lobes, which are large, need not be kept."""
    dataset = trace()
    return {
        case: (
            _of(dataset.microsurf.albedo, case),
            _of(dataset.microsurf.ray_error, case),
        )
        for case in places
    }


def _of(figure: Callable[..., xr.DataArray], case: _Place) -> Array:
    values = figure(**albedos.SELECTED[case.quantity], n=case.n, kd=case.kd)
    return np.asarray(values.sel(theta_i=case.theta_i, phi_i=case.phi_i).values)


def _vary(
    convergence: Convergence, study: str, case: _Place, steps: list[tuple[Surface, Array]]
) -> None:
    """Rows of one quantity over the steps of mesh or tile, and its order of convergence."""
    if not steps:
        return
    means = [mean_of(values) for _, values in steps]
    rows = getattr(convergence, study)
    for (step, _), mean in zip(steps, means, strict=True):
        apart = difference(mean, means[-1])
        if mean is means[-1]:
            apart = replace(apart, value=0.0, low=0.0, high=0.0)
        size = {"cells": step.cells, "correlation": step.correlation}
        size |= {"tile": step.cells / step.correlation, "realisations": mean.count}
        known = {"value": mean.value, "error": mean.error}
        rows.append(size | case.labels | known | _named("difference", apart))
    exponent = order(means[-3], means[-2], means[-1]) if len(means) >= 3 else None
    row = {"study": study, **case.labels, "order": None, "low": None, "high": None}
    convergence.orders.append(row if exponent is None else row | _named("order", exponent))


def _named(name: str, estimate: Any) -> Row:
    row = asdict(estimate)
    return {name: row.pop("value"), **row}


def _realisations(convergence: Convergence, case: _Place, values: Array) -> None:
    """Parts of the same surfaces against all of them, and means of groups that share none."""
    sizes, deviations, dofs = [], [], []
    part = 1
    while part <= len(values):
        row: Row = {"realisations": part, **case.labels, "value": float(values[:part].mean())}
        row |= _named("difference", part_and_whole(values, part))
        groups = values[: len(values) // part * part].reshape(-1, part).mean(axis=1)
        row |= {"groups": len(groups), "deviation": None}
        if len(groups) > 2:
            row["deviation"] = float(groups.std(ddof=1))
            sizes.append(part)
            deviations.append(row["deviation"])
            dofs.append(len(groups) - 1)
        convergence.realisations.append(row)
        part *= 2
    _power(convergence, "realisations", case, power(sizes, deviations, dofs))


def _rays(convergence: Convergence, case: _Place, steps: list[tuple[int, _Values]]) -> None:
    """Spread of repeats on one surface against the number of paths of each."""
    finest = mean_of(steps[-1][1][0])
    for count, (of_one, errors) in steps:
        mean = mean_of(of_one)
        row = {"paths": count, "repeats": mean.count, **case.labels, "value": mean.value}
        claimed = float(np.sqrt((errors**2).mean()))
        row |= {"deviation": float(of_one.std(ddof=1)), "claimed": claimed}
        apart = difference(mean, finest)
        if count == steps[-1][0]:
            apart = replace(apart, value=0.0, low=0.0, high=0.0)
        convergence.rays.append(row | _named("difference", apart))
    deviations = [float(of_one.std(ddof=1)) for _, (of_one, _) in steps]
    dof = [len(of_one) - 1 for _, (of_one, _) in steps]
    exponent = power([count for count, _ in steps], deviations, dof)
    _power(convergence, "rays", case, exponent)


def _power(convergence: Convergence, study: str, case: _Place, exponent: Any) -> None:
    row = {"study": study, **case.labels, "power": None, "low": None, "high": None}
    convergence.powers.append(row if exponent is None else row | _named("power", exponent))


def _left(convergence: Convergence, case: _Place, scene: Scene, at: _Values | None) -> Row:
    """What the scene's own settings leave of one quantity, relative to it."""
    rays = convergence.rays[-1]
    # A flat scene's realisations are one surface, traced again.
    count = scene.surface.realisations if scene.surface.file is None else 1
    row: Row = {**case.labels, "rays_paths": rays["paths"]}
    row["rays"] = rays["deviation"] / float(np.sqrt(count) * rays["value"])
    if at is None:
        return row
    values, errors = at
    between = components_of(values, errors**2).between
    row["realisations"] = between / float(np.sqrt(count) * values.mean())
    for study in ("mesh", "tile"):
        rows = [r for r in getattr(convergence, study) if r.items() >= case.labels.items()]
        mine = next(r for r in rows if r["cells"] == scene.surface.cells)
        finest = rows[-1]["value"]
        row[study] = mine["difference"] / finest
        row |= {f"{study}_{end}": mine[end] / finest for end in ("low", "high")}
    return row
