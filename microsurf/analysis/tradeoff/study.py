"""Speed against accuracy: every method's cost and its error against one explicit reference.

The reference is traced on surfaces of a finer mesh, which no method shares, and has
an error of its own that is in every interval. Errors of several angles and Kd: the largest
counts. Costs are processor seconds for an angle.
"""

from dataclasses import dataclass, field, replace
from functools import partial

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
    points = {
        name: [point(run, squared(run, reference, name)) for run in runs]
        for name in quantities_of(scene)
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
        name: max(pareto.half_width(other) for _, other in _pairs(None, reference, name))
        for name in quantities_of(scene)
        if name not in _DEGREES
    }
    return replace(reference, half_width=half_widths)


def squared(run: Run, reference: ReferenceDraws, name: str) -> Squared:
    """E² of one quantity of a method; see `analysis.tradeoff.pareto`."""
    pairs = _pairs(run, reference, name)
    return pareto.squared(pairs, run.method.averaged, absolute=name in _DEGREES)


def _pairs(run: Run | None, reference: ReferenceDraws, name: str) -> list[tuple[Array, Array]]:
    """Draws of a quantity of the method (none without one) and of the reference, by place."""
    pairs = []
    for index, of_reference in reference.draws.items():
        of_method = of_reference if run is None else run.draws[index]
        if name in ("albedo", "lobe"):
            pairs.append((getattr(of_method, name), getattr(of_reference, name)))
            continue
        width = peak.weight_width(of_reference.specular.mean(axis=0))
        cuts, theirs = (peak.cut(d.specular, width) for d in (of_method, of_reference))
        figure = _Figure(("peak", *_DEGREES).index(name))
        theirs = pareto.pseudo_values(theirs, figure)
        # One run is what a user gets; of a mean of several only the jackknife knows.
        if run is None or run.method.averaged > 1:
            mine = pareto.pseudo_values(cuts, figure)
        else:
            mine = np.array([figure(cut) for cut in cuts])
        pairs.append((mine, theirs))
    return pairs


@dataclass(frozen=True)
class _Figure:
    """One figure of a cut, as an array of one."""

    which: int

    def __call__(self, cut: Array) -> Array:
        return peak.figures(cut)[[self.which]]


def point(run: Run, squared_error: Squared) -> MethodPoint:
    """A method's place among others: median cost, its range widened by what repeats do not show."""
    cost = np.array(run.seconds)
    ends = float(cost.min()) / _JITTER, float(cost.max()) * _JITTER
    return MethodPoint(run.method.name, float(np.median(cost)), *ends, squared_error)
