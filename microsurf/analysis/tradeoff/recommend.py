"""The cheapest method that is good enough for a scene, by measurement.

The reference is traced until its 95 % half-width is a quarter of the tolerance, or as far
as the effort goes; then methods are run from cheap to expensive until one of them stays below the
tolerance with 95 % confidence. Nothing is extrapolated: what could not be decided is called
so, with what deciding it would cost.
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ...errors import InputError
from ...scene import Scene
from ..ablation import Effect, contributions
from ..stages import Stages
from . import pareto
from .effort import EFFORTS, TradeoffEffort
from .methods import Run, methods_of, run_all
from .pareto import Error, MethodPoint
from .study import CHOICES, ReferenceDraws, bar, check, point, quantities_of, refer, squared

SHARE = 4
"""The reference's half-width is to be this part of the tolerance."""
_EXPLICIT = 2
"""Tier of the explicit methods, which are run by mesh, coarse to fine, and by rays."""
_FEW = 4
"""Surfaces of the reference at first: doubled until that is so."""


@dataclass(frozen=True)
class Judged:
    """A method that was run: what it costs and errs by, and the verdict against the tolerance.

    run : its draws. verdict : "holds" (below it with 95 % confidence), "fails" (all of the
    95 % interval lies above it) or "undecided".
    """

    run: Run
    point: MethodPoint
    error: Error
    verdict: str
    why: str


@dataclass(frozen=True)
class Recommendation:
    """What to use, None if nothing was shown to hold; what was tried, from cheap to expensive."""

    quantity: str
    tolerance: float
    chosen: Judged | None
    tried: list[Judged]
    skipped: list[str]
    reference: ReferenceDraws
    effects: list[Effect]
    note: str
    seconds: float

    @property
    def best(self) -> Judged:
        """The chosen method, or the one with the least error that was found."""
        return self.chosen or min(self.tried, key=lambda one: one.error.below)


def advise(
    scene: Scene,
    tolerance: float,
    quantity: str = "albedo",
    effort: TradeoffEffort = EFFORTS["quick"],
    *,
    seed: int = 0,
    effects: bool = True,
    progress: bool = False,
    stages: Stages | None = None,
) -> Recommendation:
    """Find the cheapest method whose error of a quantity stays below a tolerance.

    Parameters
    ----------
    scene : Scene
        Of a made surface. Of several angles and Kd the worst must hold.
    tolerance : float
        Relative, 1e−4 … 1.
    quantity : str
        "albedo", "peak" (the specular peak's height) or "lobe" (the body lobe over its
        bins, root of the sum of squares).
    effects : bool
        Whether to measure what each effect contributes.
    stages : Stages, optional
        Where finished methods are kept and found; nowhere without it.

    Raises
    ------
    InputError
        As `tradeoff`, or if the tolerance or the quantity can't be asked of the scene.

    """
    check(scene)
    _check(scene, tolerance, quantity)
    stages = stages or Stages()
    methods = methods_of(scene, effort)
    tried: list[Judged] = []
    with bar(len(methods) + effort.surfaces, progress=progress) as shown:
        wanted = quantity, tolerance / SHARE
        few = replace(effort, surfaces=min(_FEW, effort.surfaces))
        reference = refer(scene, few, seed, wanted=wanted, shown=shown, stages=stages)
        skipped = [method.name for method in methods]
        for tier in sorted({method.tier for method in methods}):
            of_tier = [method for method in methods if method.tier == tier]
            for run in run_all(scene, of_tier, seed, full=False, stages=stages):
                tried.append(_judge(run, reference, quantity, tolerance))
                skipped.remove(run.method.name)
                shown.update()
                # Means of several and finer meshes, which come next, are dearer than one draw.
                if run.method.tier == _EXPLICIT and run.method.averaged == 1 and _holds(tried[-1:]):
                    break
            # Dearer tiers hold nothing cheaper than this one does.
            if _holds(tried):
                break
        effects_found: list[Effect] = []
        if effects:
            work = partial(contributions, scene, quantity, seed=seed)
            effects_found = stages.done("effects", work)
        shown.update(shown.total - shown.n)
    tried.sort(key=lambda one: one.point.seconds)
    chosen = next((one for one in tried if one.verdict == "holds"), None)
    note = _note(reference, quantity, tolerance, tried, chosen)
    return Recommendation(
        quantity, tolerance, chosen, tried, skipped, reference, effects_found, note, stages.seconds
    )


def check_tolerance(tolerance: float) -> None:
    """Raise InputError for a tolerance that no method is judged by."""
    if not 1e-4 <= tolerance <= 1:
        raise InputError(f"tolerance = {tolerance:g}: must be 1e-4 … 1, relative")


def _check(scene: Scene, tolerance: float, quantity: str) -> None:
    check_tolerance(tolerance)
    if quantity not in CHOICES:
        raise InputError(f"quantity = {quantity!r}: must be one of {', '.join(CHOICES)}")
    if quantity not in quantities_of(scene):
        lacks = "interface, so no specular peak" if quantity == "peak" else "body lobe at its Kd"
        raise InputError(f"quantity = {quantity!r}: the scene has no {lacks}; ask for albedo")


def _holds(tried: list[Judged]) -> bool:
    return any(one.verdict == "holds" for one in tried)


def _judge(run: Run, reference: ReferenceDraws, quantity: str, tolerance: float) -> Judged:
    placed = point(run, squared(run, reference, [quantity])[quantity])
    error = pareto.error(placed.squared)
    if error.below <= tolerance:
        return Judged(run, placed, error, "holds", f"below {error.below:.2g} with 95 % confidence")
    if error.low > tolerance:
        return Judged(run, placed, error, "fails", f"above {error.low:.2g} with 95 % confidence")
    why = f"between {error.low:.2g} and {error.high:.2g}: not distinguished from {tolerance:g}"
    return Judged(run, placed, error, "undecided", why)


def _note(
    reference: ReferenceDraws,
    quantity: str,
    tolerance: float,
    tried: list[Judged],
    chosen: Judged | None,
) -> str:
    """What the reference did not reach, and what it would cost to decide."""
    cheaper = tried[: tried.index(chosen)] if chosen else tried
    open_ones = sum(one.verdict == "undecided" for one in cheaper)
    half, wanted = reference.half_width[quantity], tolerance / SHARE
    lines = []
    if chosen is None:
        lines.append("no method was shown to meet the tolerance")
    if half > wanted:
        more = int(np.ceil(reference.surfaces * (half / wanted) ** 2))
        seconds = reference.seconds * more / reference.surfaces
        lines.append(
            f"the reference is known to ±{half:.2g}, not to ±{wanted:.2g}: "
            f"that would take about {more} surfaces, {seconds:.0f} s of processor time"
        )
    if open_ones:
        lines.append(f"{open_ones} cheaper method{'s' * (open_ones > 1)} could not be decided")
    return "; ".join(lines)
