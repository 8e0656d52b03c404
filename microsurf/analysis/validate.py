"""The main job: measure and predict each scene, compare, and keep what the report shows."""

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from .. import invariants
from ..model import registry
from ..scene import Scene
from ..surface import Heightfield, StdFit, all_surfaces_of, surface_statistics
from ..trace import measure
from . import comparison, omitted_effects, predictions, two_layers
from .error_budget import assemble
from .error_budget.refinement import refine
from .fitted_theory import fitted_scene, prepare, turn_of
from .slope_masking import masking_by_slope
from .stages import Stages
from .tradeoff.from_validation import frontier_of
from .validation import Validation

if TYPE_CHECKING:
    import xarray as xr

WALKS = 1_000_000
"""Walks for each angle: a standard error of 5e−4 of an albedo at most, below what four
surfaces leave."""


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
    stages: Stages | None = None,
) -> Validation:
    """Measure, predict and compare one scene.

    A surface that comes from a file is compared with the STD fitted to its facet
    slopes by maximum likelihood. ``refined``: the discretisation error is measured too,
    on a dozen more surfaces, masking by facet slope, and what the models cost.
    ``surface_paths``: see `measure`. ``prepared``: what `prepare` gave, if it was asked.
    ``stages``: where finished stages are kept and found; nowhere without it.

    Of a scene with two layers the theories predict interfaced-Lambertian facets on the interface.
    The budget measures these too, on the same interfaces, and has what they leave as a term.
    """
    stages = stages or Stages()
    run: dict[str, Any] = {"seed": seed, "workers": workers, "progress": progress}
    surfaces = _Surfaces(scene, seed, workers)
    fit, notes = prepared or prepare(scene)
    judged = scene if fit is None else fitted_scene(scene, fit)
    theory, facets = (replace(one, layers=None) for one in (judged, scene))
    turn = 0.0 if fit is None else turn_of(fit)
    rough = theory.requires.roughness
    along = rough and turn == 0  # axes along x and y, which looking at facets takes for granted
    measured = stages.done(
        "measured",
        lambda: measure(
            scene,
            surfaces.made() if rough and not _grows(scene) else None,
            surface_paths=surface_paths,
            **run,
        ),
    )
    surfaces.count = measured.sizes["realisation"]  # as many as the error took
    predicted, seconds = stages.done(
        "predicted", lambda: predictions.order_one(theory, predictions.models_of(scene), turn)
    )
    first = next(iter(predicted.values()))
    walked: dict[str, xr.Dataset] = {}
    if rough and scene.requires.multiple_scattering:
        walked = {
            key: stages.done(
                f"walk-{number}",
                partial(predictions.all_orders, theory, key, turn, WALKS, run),
            )
            for number, key in enumerate(registry.compared(registry.all_orders()))
        }
    predicted |= walked
    all_orders = next(iter(walked.values()), None)
    predicted |= two_layers.walked(judged, turn, run, stages)
    by_slope: list[dict[str, Any]] = []
    terms: list[assemble.Budget] = []
    if along:
        refinement = None
        alone = measured
        if scene.layers is not None:
            alone = stages.done("facets", lambda: measure(facets, surfaces.made(), **run))
        if refined:
            by_slope = stages.done(
                "masking",
                lambda: masking_by_slope(theory, surfaces.made(), seed=seed, workers=workers),
            )
            refinement = stages.done("refinement", lambda: refine(facets, alone, **run))
        terms = stages.done(
            "budget",
            lambda: assemble.budget_of(
                assemble.cases_of(
                    theory,
                    alone,
                    (first, all_orders),
                    surfaces.made(),
                    layers=None if scene.layers is None else measured,
                    refinement=refinement,
                    exchange=assemble.exchange_of(by_slope),
                    walks=min(assemble.WALKS, scene.accuracy.paths * surfaces.count),
                    seed=seed,
                )
            ),
        )
    frontier = None
    if refined and turn == 0:
        timed = {key: (predicted[key], spent) for key, spent in seconds.items()}
        frontier = stages.done("frontier", lambda: frontier_of(theory, measured, timed, seed=seed))
    comparisons = comparison.compare(measured, first, theory, all_orders)
    heightfield, statistics = (
        stages.done("surface", lambda: _first(surfaces.made()[0], theory)) if along else (None, {})
    )
    held = stages.done(
        "invariants",
        lambda: invariants.scene_invariants(
            measured, predicted, surfaces.made() if rough else [], theory.material
        ),
    )
    if scene.requires.roughness:
        agreement = stages.done(
            "second-engine",
            lambda: invariants.second_engine(
                scene, surfaces.made()[0] if rough else None, seed=seed, workers=workers
            ),
        )
        held = [*held, agreement]
    if scene.layers is not None:
        chord = stages.done(
            "mean-chord",
            lambda: invariants.mean_chord(scene, surfaces.made()[0] if rough else None, seed=seed),
        )
        held = [*held, chord]
    return Validation(
        name=name,
        scene=judged,
        measured=measured,
        predicted=predicted,
        comparisons=comparisons,
        invariants=held,
        heightfield=heightfield,
        statistics=statistics,
        fit=fit,
        notes=notes,
        left_out=stages.done(
            "left-out",
            lambda: omitted_effects.cost(
                scene, measured, surfaces.made() if rough else None, **run
            ),
        ),
        budget=terms,
        masking=by_slope,
        layers=two_layers.summary(judged, seed, measured, predicted),
        frontier=frontier,
        seconds=stages.seconds,
    )


class _Surfaces:
    """The surfaces of a scene, made when first asked for: not at all if no stage wants them."""

    def __init__(self, scene: Scene, seed: int, workers: int | None) -> None:
        self._scene, self._seed, self._workers = scene, seed, workers
        self._made: list[Heightfield] = []
        self.count = scene.surface.realisations

    def made(self) -> list[Heightfield]:
        """All of them."""
        if not self._made:
            surface = replace(self._scene.surface, realisations=self.count)
            self._made = all_surfaces_of(
                replace(self._scene, surface=surface), self._seed, self._workers
            )
        return self._made


def _first(surface: Heightfield, theory: Scene) -> tuple[Heightfield, dict[str, Any]]:
    """The surface that is shown, and the statistics of its slopes."""
    rough = theory.roughness
    slopes = surface_statistics(surface, rough.gamma, rough.sigma_x, rough.sigma_y)
    return surface, slopes


def _grows(scene: Scene) -> bool:
    """Whether surfaces are added until an error is reached."""
    return scene.accuracy.standard_error is not None and scene.surface.file is None
