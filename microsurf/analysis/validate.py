"""The main job: measure and predict each scene, compare, and keep what the report shows."""

import time
from dataclasses import dataclass, field, replace
from typing import Any

import xarray as xr

from .. import invariants, model
from ..model import registry
from ..results import albedos
from ..scene import Scene
from ..surface import Heightfield, StdFit, surface_statistics, surfaces_of
from ..trace import measure
from . import comparison, omitted_effects
from .error_budget import assemble
from .error_budget.refinement import refine
from .fitted_theory import fit_as_json, fitted_scene, guarded, prepare
from .slope_masking import masking_by_slope
from .tradeoff.from_validation import frontier_of
from .tradeoff.study import Tradeoff
from .user_brdf import UserBrdfResult

WALKS = 1_000_000
"""Walks for each angle: a standard error of 5e−4 of an albedo at most, below what four
surfaces leave."""


@dataclass(frozen=True)
class Validation:
    """What one scene came to.

    Attributes
    ----------
    name : str
        Of the scene file.
    measured : xarray.Dataset
        The measurement, see `microsurf.results.datasets`.
    predicted : dict
        Predictions by the models that `model.registry` has compared, order 1 before all.
    comparisons : ComparisonTable
        Order 1 against the first model of order 1, the total against the first of all orders.
    invariants : list of Invariant
        What must hold whatever the surface, see `invariants.scene_invariants`.
    heightfield : Heightfield or None
        First realisation; None for a flat scene.
    statistics : dict
        Of its facet slopes, see `surface.surface_statistics`.
    fit : StdFit or None
        STD fitted to a surface that was not generated.
    notes : list of str
        What is assumed of a surface from a file, and what hints at a mistake in it.
    left_out : list of dict
        What the effects that the scene leaves out cost, see `omitted_effects.cost`.
    budget : list of Budget
        Where each difference comes from, see `budget.budget_of`; empty for a flat scene.
    masking : list of dict
        Masking and shadowing by facet slope, see `masking.masking_by_slope`; empty unless
        the scene was refined.
    frontier : Tradeoff or None
        What the models cost and how far they are off, see `frontier.frontier_of`; None unless
        the scene was refined.
    seconds : float
        All of it.
    user_brdf : UserBrdfResult or None
        A user BRDF against the theory; the comparisons are then the user BRDF's, see
        `validate_user_brdf.judge`.
    faults : list of str
        What is wrong with the user BRDF itself.

    """

    name: str
    scene: Scene
    measured: xr.Dataset
    predicted: dict[str, xr.Dataset]
    comparisons: comparison.ComparisonTable
    invariants: list[invariants.Invariant]
    heightfield: Heightfield | None = None
    statistics: dict[str, Any] = field(default_factory=dict)
    fit: StdFit | None = None
    left_out: list[dict[str, Any]] = field(default_factory=list)
    budget: list[assemble.Budget] = field(default_factory=list)
    masking: list[dict[str, Any]] = field(default_factory=list)
    frontier: Tradeoff | None = None
    seconds: float = 0.0
    user_brdf: UserBrdfResult | None = None
    faults: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @property
    def broken(self) -> list[str]:
        """Invariants that do not hold, and a user BRDF's faults; else empty."""
        return invariants.broken(self.invariants) + self.faults


def validate_scene(
    name: str,
    scene: Scene,
    *,
    seed: int = 0,
    workers: int | None = None,
    progress: bool = False,
    refined: bool = False,
    surface_paths: int | None = None,
    prepared: tuple[StdFit | None, list[str]] | None = None,
) -> Validation:
    """Measure, predict and compare one scene.

    A surface that comes from a file is compared with the STD fitted to its facet
    slopes by maximum likelihood. ``refined``: the discretisation error is measured too,
    on a dozen more surfaces, masking by facet slope, and what the models cost.
    ``surface_paths``: see `measure`. ``prepared``: what `prepare` gave, if it was asked.
    """
    begin = time.perf_counter()
    surfaces = None
    if scene.requires.roughness and not _grows(scene):
        surfaces = list(surfaces_of(scene, seed))
    fit, notes = prepared or prepare(scene)
    theory = scene if fit is None else fitted_scene(scene, fit)
    measured = measure(
        scene,
        surfaces,
        seed=seed,
        workers=workers,
        surface_paths=surface_paths,
        progress=progress,
    )
    if scene.requires.roughness and surfaces is None:
        count = measured.sizes["realisation"]  # as many as the error took
        taken = replace(scene, surface=replace(scene.surface, realisations=count))
        surfaces = list(surfaces_of(taken, seed))
    predicted, seconds = {}, {}
    for key in _models(scene):
        clock = time.process_time()
        predicted[key] = model.predict(theory, key)
        seconds[key] = time.process_time() - clock
    first = next(iter(predicted.values()))
    walked = {}
    if scene.requires.roughness and scene.requires.multiple_scattering:
        walked = {
            key: model.walk(theory, key, walks=WALKS, seed=seed, workers=workers, progress=progress)
            for key in registry.compared(registry.all_orders())
        }
    predicted |= walked
    all_orders = next(iter(walked.values()), None)
    terms, by_slope = [], []
    if surfaces:
        if refined:
            by_slope = masking_by_slope(theory, surfaces, seed=seed, workers=workers)
        cases = assemble.cases_of(
            theory,
            measured,
            (first, all_orders),
            surfaces,
            refinement=refine(scene, measured, seed=seed, workers=workers, progress=progress)
            if refined
            else None,
            exchange=assemble.exchange_of(by_slope),
            walks=min(assemble.WALKS, scene.accuracy.paths * len(surfaces)),
            seed=seed,
        )
        terms = assemble.budget_of(cases)
    frontier = None
    if refined:
        timed = {key: (predicted[key], spent) for key, spent in seconds.items()}
        frontier = frontier_of(theory, measured, timed, seed=seed)
    roughness = theory.roughness
    comparisons = comparison.compare(measured, first, theory, all_orders)
    if fit is not None:
        comparisons = guarded(comparisons, fit)
    return Validation(
        name=name,
        scene=theory,
        measured=measured,
        predicted=predicted,
        comparisons=comparisons,
        invariants=invariants.scene_invariants(
            measured, predicted, surfaces or [], theory.material
        ),
        heightfield=surfaces[0] if surfaces else None,
        statistics=surface_statistics(
            surfaces[0], roughness.gamma, roughness.sigma_x, roughness.sigma_y
        )
        if surfaces
        else {},
        fit=fit,
        notes=notes,
        left_out=omitted_effects.cost(
            scene, measured, surfaces, seed=seed, workers=workers, progress=progress
        ),
        budget=terms,
        masking=by_slope,
        frontier=frontier,
        seconds=time.perf_counter() - begin,
    )


def _grows(scene: Scene) -> bool:
    """Whether surfaces are added until an error is reached."""
    return scene.accuracy.standard_error is not None and scene.surface.file is None


def _models(scene: Scene) -> tuple[str, ...]:
    return registry.compared(registry.order_one()) if scene.requires.roughness else ("flat",)


def as_json(entry: Validation) -> dict[str, Any]:
    """The figures of one scene for report.json."""
    material = entry.scene.material
    return {
        "name": entry.name,
        "title": entry.scene.title,
        "comparisons": [{**vars(row), "unexpected": row.unexpected} for row in entry.comparisons],
        "broken": entry.broken,
        "invariants": invariants.as_rows(entry.invariants),
        "measured": {
            **albedos.figures(entry.measured, material.n, material.kd),
            **albedos.losses(entry.measured),
            "paths": int(entry.measured.paths.sum()),
            "rays": int(entry.measured.attrs["rays"]),
            "tracing_seconds": entry.measured.attrs["seconds"],
            "embree_ratio": entry.measured.attrs["embree_ratio"],
        },
        "predicted": {
            key: albedos.figures(prediction, material.n, material.kd)
            for key, prediction in entry.predicted.items()
        },
        "surface": entry.statistics,
        "fit": None if entry.fit is None else fit_as_json(entry.fit),
        "notes": entry.notes,
        "left_out": entry.left_out,
        "budget": assemble.rows(entry.budget),
        "masking": entry.masking,
        "user_brdf": None if entry.user_brdf is None else entry.user_brdf.as_json(),
        "seconds": entry.seconds,
    }
