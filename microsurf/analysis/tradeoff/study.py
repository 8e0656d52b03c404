"""Speed against accuracy: every method's cost and its error against one explicit reference.

The reference is traced on surfaces of a finer mesh, which no method shares, and has
an error of its own that is in every interval. Errors of several angles and Kd: the largest
counts. Costs are processor seconds for an angle.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from ... import seeds
from ...errors import InputError
from ...results import peak
from ...scene import Scene, Surface
from ...scene.layers import refuse
from ..stages import Stages
from . import pareto
from .effort import EFFORTS, TradeoffEffort
from .methods import Draws, Place, Run, joined, methods_of, run_all, timed, trace_surfaces
from .pareto import MethodPoint, Squared

Array = NDArray[np.float64]

QUANTITIES = {
    "albedo": "total albedo, relative",
    "peak": "specular peak's height, relative",
    "lobe": "body lobe over its bins, relative",
    "position": "specular peak's position, degrees",
    "width": "specular peak's width, degrees",
}
CHOICES = ("albedo", "peak", "lobe")
"""Those that a tolerance can be given for."""
_DEGREES = ("position", "width")
_LEAST_TILE = 32
"""Side of the reference's tile in correlation lengths, at least."""
_JITTER = 1.1
"""Factor by which costs vary from run to run beyond what repeats within one show."""


@dataclass(frozen=True)
class ReferenceDraws:
    """Draws of the explicit reference by place, and what they are of.

    ``half_width`` is that of its 95 % interval, by quantity, relative; of its surfaces alone:
    the error of its mesh is not in it.
    """

    draws: dict[Place, Draws]
    surface: Surface
    paths: int
    seconds: float
    rough: bool = True
    half_width: dict[str, float] = field(default_factory=dict)

    @property
    def surfaces(self) -> int:
        """How many were traced."""
        return len(next(iter(self.draws.values())).albedo)

    @cached_property
    def widths(self) -> dict[Place, float]:
        """Of the weights that cuts of specular peaks are taken with, in degrees."""
        return {
            index: peak.weight_width(draws.specular.mean(axis=0))
            for index, draws in self.draws.items()
        }

    @cached_property
    def peaks(self) -> dict[Place, Array]:
        """Jackknife pseudo-values of the figures of the specular peak, shape (R, 3)."""
        return _peaks(self.draws, self.widths, averaged=True)

    @property
    def text(self) -> str:
        """What it is of, for people."""
        of_what = f"{self.surfaces} times one flat facet"
        if self.rough:
            of_what = f"{self.surfaces} surfaces of {self.surface.cells}² cells, "
            of_what += f"L = {self.surface.correlation:g}"
        return f"reference: {of_what}, {self.paths} rays each"


@dataclass(frozen=True)
class Tradeoff:
    """Every method's run, and by quantity its points and which are dominated by which."""

    scene: Scene
    reference: ReferenceDraws
    runs: list[Run]
    points: dict[str, list[MethodPoint]]
    dominated: dict[str, dict[str, str]]
    seconds: float


def tradeoff(
    scene: Scene,
    effort: TradeoffEffort = EFFORTS["quick"],
    *,
    seed: int = 0,
    progress: bool = False,
    stages: Stages | None = None,
) -> Tradeoff:
    """Run every method on a scene.

    ``stages``: where finished methods are kept and found; nowhere without it.

    Raises
    ------
    InputError
        If the scene reflects nothing, or its surface comes from a file.

    """
    check(scene)
    stages = stages or Stages()
    methods = methods_of(scene, effort)
    runs = []
    with bar(len(methods) + effort.surfaces, progress=progress) as shown:
        reference = refer(scene, effort, seed, shown=shown, stages=stages)
        for run in run_all(scene, methods, seed, stages=stages):
            runs.append(run)
            shown.update()
    return replace(judged(scene, reference, runs), seconds=stages.seconds)


def judged(scene: Scene, reference: ReferenceDraws, runs: list[Run]) -> Tradeoff:
    """Points of all runs by quantity, and which are dominated; seconds are those of the runs."""
    names = quantities_of(scene)
    errors = [squared(run, reference, names) for run in runs]
    points = {
        name: [point(run, of[name]) for run, of in zip(runs, errors, strict=True)] for name in names
    }
    dominated = {name: pareto.dominated(of) for name, of in points.items()}
    seconds = sum(scene.light.angles * sum(run.seconds) for run in runs)
    return Tradeoff(scene, reference, runs, points, dominated, seconds)


def check(scene: Scene) -> None:
    """Refuse what the trade-off is not for."""
    refuse(scene.layers, "the trade-off of methods")
    if not (scene.requires.interface or scene.requires.substrate):
        raise InputError(
            "material.n = 1 without a substrate: nothing is reflected; give kd > 0 or n > 1"
        )
    if scene.surface.file is not None:
        raise InputError(
            f"surface.file = {scene.surface.file}: trade-offs are for generated surfaces; "
            "fit the file (`microsurf validate`) and give its gamma and sigma"
        )


def quantities_of(scene: Scene) -> list[str]:
    """Those of QUANTITIES that are not zero by the scene's material."""
    needs = scene.requires
    there = {"albedo": True, "lobe": needs.substrate and min(scene.material.kd) > 0}
    return [name for name in QUANTITIES if there.get(name, needs.interface)]


def bar(total: int, *, progress: bool) -> "tqdm[None]":
    """A progress bar on standard error, if that is a terminal."""
    return tqdm(total=total, disable=None if progress else True, desc="methods", unit="step")


def reference_seed(seed: int, batch: int) -> int:
    """Seed of a batch of reference surfaces, unrelated to those of the methods."""
    return seeds.derived(seed, seeds.REFERENCES, batch)


def refer(
    scene: Scene,
    effort: TradeoffEffort,
    seed: int,
    *,
    wanted: tuple[str, float] | None = None,
    shown: "tqdm[None] | None" = None,
    stages: Stages | None = None,
) -> ReferenceDraws:
    """Trace the reference; with ``wanted`` (quantity, half-width) as many surfaces as it takes.

    Surfaces are added by as many as there are, up to the effort's most: whether that was
    enough stands in ``half_width``.
    """
    surface = scene.surface
    if scene.requires.roughness:
        length = surface.correlation * effort.finer
        # On a smaller tile: as many cells tell more of a finer mesh than of one surface.
        cells = round(max(surface.cells * effort.cells * effort.finer / 2, _LEAST_TILE * length))
        surface = replace(surface, cells=cells, correlation=length)
    stages = stages or Stages()
    seconds = 0.0
    parts: list[dict[Place, Draws]] = []
    count = effort.surfaces
    while True:
        batch = reference_seed(seed, len(parts))
        work = partial(trace_surfaces, scene, surface, effort.paths, count, batch)
        traced, spent = stages.done(f"reference-{len(parts)}", partial(timed, work))
        parts.append(traced)
        seconds += spent
        if shown is not None:
            shown.update(count if len(parts) == 1 else 0)
        draws = joined(parts)
        reference = ReferenceDraws(draws, surface, effort.paths, seconds, scene.requires.roughness)
        reference = with_half_widths(scene, reference)
        if wanted is None or reference.half_width[wanted[0]] <= wanted[1]:
            return reference
        count = min(reference.surfaces, effort.most - reference.surfaces)
        if count < 1:
            return reference


def with_half_widths(scene: Scene, reference: ReferenceDraws) -> ReferenceDraws:
    """The reference with its own uncertainty, by quantity."""
    half_widths = {
        name: max(pareto.half_width(of) for of in _values(reference.draws, reference.peaks, name))
        for name in quantities_of(scene)
        if name not in _DEGREES
    }
    return replace(reference, half_width=half_widths)


def squared(run: Run, reference: ReferenceDraws, names: Iterable[str]) -> dict[str, Squared]:
    """E² of a method by quantity; see `analysis.tradeoff.pareto`."""
    # One run is what a user gets; of a mean of several only the jackknife knows.
    peaks = _peaks(run.draws, reference.widths, averaged=run.method.averaged > 1)
    return {
        name: pareto.squared(
            list(
                zip(
                    _values(run.draws, peaks, name, reference.draws),
                    _values(reference.draws, reference.peaks, name),
                    strict=True,
                )
            ),
            run.method.averaged,
            absolute=name in _DEGREES,
        )
        for name in names
    }


def _values(
    draws: Mapping[Place, Draws],
    peaks: Mapping[Place, Array],
    name: str,
    places: Iterable[Place] | None = None,
) -> list[Array]:
    """Draws of a quantity by place, in the order of ``places``, which are by default all."""
    if name in ("albedo", "lobe"):
        return [getattr(draws[index], name) for index in places or draws]
    which = ("peak", *_DEGREES).index(name)
    return [peaks[index][:, [which]] for index in places or draws]


def _peaks(
    draws: Mapping[Place, Draws], widths: Mapping[Place, float], *, averaged: bool
) -> dict[Place, Array]:
    """Height, position and width of the specular peak of each draw by place, shape (K, 3).

    ``averaged``: jackknife pseudo-values, for those of the mean of all.
    """
    by_place = {}
    for index, width in widths.items():
        cuts = peak.cut(draws[index].specular, width)
        by_place[index] = (
            pareto.pseudo_values(cuts, peak.figures)
            if averaged
            else np.array([peak.figures(cut) for cut in cuts])
        )
    return by_place


def point(run: Run, squared_error: Squared) -> MethodPoint:
    """A method's place among others: median cost, its range widened by what repeats do not show."""
    cost = np.array(run.seconds)
    ends = float(cost.min()) / _JITTER, float(cost.max()) * _JITTER
    return MethodPoint(run.method.name, float(np.median(cost)), *ends, squared_error)
