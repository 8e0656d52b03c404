"""Where a difference between geometry and theory comes from: terms that add up to it.

measured − predicted is split by substituting one thing after the other, in this order:

model       the prediction by the reference theory of the same assumptions (Smith): a fault of
            the prediction's own facet, or another masking than Smith's; of later orders what
            the fault of order 1 makes of them if every event has it
slopes      STD by the slopes the surfaces have, the tail a mesh can't hold left out
mesh        what a finer mesh would change
tile        a bound of what a larger tile would change: nothing is taken off for it, and the
            intervals of what follows do not hold it
losses      light that was lost
masking     Smith's masking and shadowing by the structure's own: all that is left of order 1;
            and what this makes of later orders, at the walk's rate: light that is let out
            less at first is met again
multiple    multiple scattering by the structure's own, or what the prediction's lacks: all that
            is left of later orders
il_assumption
            of a scene with two layers, which IL facets stand for up to here: both layers less IL
            facets on the same interfaces, paired
noise       of rays and of surfaces: nothing in the mean

Had masking been substituted before the slopes, the share of each would be another: by how much
is part of the uncertainty of both. Intervals are of 95 %.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ...stats import intervals
from .regions import FIRST, HIGHER, LOBES, TOTAL

Array = NDArray[np.float64]

TERMS = (
    "model", "slopes", "mesh", "tile", "losses", "masking", "multiple", "il_assumption", "noise",
)  # fmt: skip
_LAYERS = "il_assumption"


@dataclass(frozen=True)
class TermEstimate:
    """A number and the half width of its 95 % interval."""

    value: float
    half: float = 0.0

    def __sub__(self, other: "TermEstimate") -> "TermEstimate":
        """Difference of independent estimates."""
        return TermEstimate(self.value - other.value, float(np.hypot(self.half, other.half)))

    def __add__(self, other: "TermEstimate") -> "TermEstimate":
        """Sum of independent estimates."""
        return TermEstimate(self.value + other.value, float(np.hypot(self.half, other.half)))


NOTHING = TermEstimate(0.0)
Parts = Mapping[str, TermEstimate]


@dataclass(frozen=True)
class Case:
    """All that a budget of one incidence and Kd is made of; parts named as in `components`.

    Attributes
    ----------
    measured : mapping of arrays, shape (realisations,)
        Each part on each surface.
    ray_errors : mapping of float
        Standard errors of the rays, used where there is one surface.
    predicted, theory : mapping of Estimate
        The user BRDF; Smith with STD.
    slopes : mapping of Estimate
        What the slopes of the surfaces change about the latter, from the same random
        numbers: the sampling of ``theory`` is not in it.
    scattered : float
        What the first facets scatter of the light, with the slopes of the surfaces.
    mesh, tile : mapping of Estimate or None
        What a finer mesh and a larger tile change; None if that was not measured.
    lost : float
        Part of the light that was lost.
    expected : mapping of Estimate or None
        Later orders of ``theory`` if every event had the faults of order 1 of ``predicted``.
    exchange : mapping of float
        By how much the terms slopes and masking of a part depend on their order.
    layers : mapping of arrays, shape (realisations,)
        Each part of two layers; ``measured`` is then that of IL facets on their interfaces. None
        of a scene of IL facets.
    layers_ray_errors : mapping of float
        As ``ray_errors``, of the difference of both measurements: for noise it is a bound.

    """

    measured: Mapping[str, Array]
    ray_errors: Mapping[str, float]
    predicted: Parts
    theory: Parts
    slopes: Parts
    scattered: float
    mesh: Parts | None = None
    tile: Parts | None = None
    lost: float = 0.0
    expected: Parts | None = None
    exchange: Mapping[str, float] | None = None
    layers: Mapping[str, Array] | None = None
    layers_ray_errors: Mapping[str, float] = field(default_factory=dict)

    def with_mesh_slopes(self, q: str) -> TermEstimate:
        """Smith with the slopes of the surfaces."""
        return self.theory[q] + self.slopes[q]


@dataclass(frozen=True)
class Term:
    """One term of one quantity: its value in albedo and the ends of its 95 % interval."""

    quantity: str
    term: str
    value: float
    low: float
    high: float


def split(case: Case) -> dict[str, dict[str, Term]]:
    """Terms by quantity: parts of order 1, their lobes, later orders, the total.

    A term that was not measured (mesh, tile) is left out; the others add up to
    measured − predicted of each quantity.
    """
    first = {q: _first(case, q) for q in (*FIRST, *LOBES)}
    let_out = sum((first[q]["masking"] for q in FIRST), _Sum.nothing())
    parts: dict[str, dict[str, _Sum]] = dict(first)
    later = [q for q in HIGHER if q in case.measured and q in case.slopes]
    rates = {q: _met_again(case, q) for q in later}
    for q in later:
        parts[q] = _later(case, q, rates[q], let_out)
    adding = [parts[q] for q in (*FIRST, *HIGHER) if q in parts]
    parts[TOTAL] = {
        term: sum((part[term] for part in adding if term in part), _Sum.nothing())
        for term in TERMS
        if any(term in part for part in adding)
    }
    # What is not known of order 1 is passed on, with its sign.
    known = abs(1 - sum(rates.values())) * let_out.half
    parts[TOTAL]["masking"] = replace(parts[TOTAL]["masking"], half=known)
    rays = dict.fromkeys(TERMS, case.ray_errors)
    if case.layers is not None:
        rays |= dict.fromkeys((_LAYERS, "noise"), case.layers_ray_errors)
    return {
        q: {term: total.term(q, term, rays[term].get(q, 0.0)) for term, total in terms.items()}
        for q, terms in parts.items()
    }


@dataclass(frozen=True)
class _Sum:
    """Sum of a fixed part with its half width, and of one that differs between surfaces."""

    fixed: float
    half: float
    each: Array

    @classmethod
    def nothing(cls) -> "_Sum":
        return cls(0.0, 0.0, np.zeros(1))

    @classmethod
    def of(cls, estimate: TermEstimate) -> "_Sum":
        return cls(estimate.value, estimate.half, np.zeros(1))

    def __add__(self, other: "_Sum") -> "_Sum":
        return _Sum(
            self.fixed + other.fixed, float(np.hypot(self.half, other.half)), self.each + other.each
        )

    def term(self, quantity: str, name: str, ray_error: float) -> Term:
        count, spread = len(self.each), 0.0
        if count > 1:
            spread = (
                intervals.student(count - 1) * float(self.each.std(ddof=1)) / float(np.sqrt(count))
            )
        elif name in ("masking", "multiple", _LAYERS, "noise"):
            spread = intervals.normal() * ray_error
        value = self.fixed + float(self.each.mean())
        half = float(np.hypot(self.half, spread))
        if name == "noise":
            value, half = 0.0, spread
        low, high = value - half, value + half
        if name == "losses":
            low, high = min(2 * value, 0.0), 0.0
        return Term(quantity, name, value, low, high)


def _before(case: Case, q: str) -> dict[str, _Sum]:
    """Terms that do not depend on the surface's structure."""
    sums = {
        "model": _Sum.of(_model(case, q)),
        "slopes": _Sum.of(case.slopes[q]),
    }
    for term, parts in (("mesh", case.mesh), ("tile", case.tile)):
        if parts is not None:
            sums[term] = _Sum.of(parts[q])
    # What was lost would have left as the rest did; twice as much at the most.
    mean = float(np.mean(case.measured[q]))
    sums["losses"] = _Sum.of(TermEstimate(-case.lost * mean))
    return sums


def _model(case: Case, q: str) -> TermEstimate:
    """Theory less prediction; of later orders less what order 1 lets expect of it."""
    if case.theory is case.predicted:
        return NOTHING
    if case.expected is None or q not in case.expected:
        return case.theory[q] - case.predicted[q]
    # Of the same walks: their sampling drops out but for the factor.
    off = case.theory[q].value - case.expected[q].value
    return TermEstimate(off, abs(case.theory[q].half - case.expected[q].half))


def _rest(case: Case, q: str, before: Mapping[str, _Sum]) -> _Sum:
    """What is left of measured − the theory with the slopes of the mesh on each surface."""
    explained = [before[term] for term in ("mesh", "losses") if term in before]
    fixed = (
        sum(explained_term.fixed for explained_term in explained) + case.with_mesh_slopes(q).value
    )
    half = float(
        np.linalg.norm(
            [case.with_mesh_slopes(q).half, *(explained_term.half for explained_term in explained)]
        )
    )
    return _Sum(0.0, half, np.asarray(case.measured[q], float) - fixed)


def _first(case: Case, q: str) -> dict[str, _Sum]:
    sums = _before(case, q)
    rest = _rest(case, q, sums)
    doubt = 0.0 if case.exchange is None else abs(case.exchange.get(q, 0.0))
    slopes = sums["slopes"]
    sums["slopes"] = _Sum(slopes.fixed, float(np.hypot(slopes.half, doubt)), slopes.each)
    sums["masking"] = _Sum(rest.fixed, float(np.hypot(rest.half, doubt)), rest.each)
    return sums | _measuring(case, q)


def _met_again(case: Case, q: str) -> float:
    """Return how much a later order grows with the light that goes on after order 1.

    That the odds of leaving change at every event as at the first was tried and fits no
    better over three structures, γ and angles.
    """
    goes_on = case.scattered - sum(case.with_mesh_slopes(q).value for q in FIRST)
    return case.with_mesh_slopes(q).value / goes_on if goes_on > 0 else 0.0


def _later(case: Case, q: str, rate: float, let_out: "_Sum") -> dict[str, _Sum]:
    sums = _before(case, q)
    rest = _rest(case, q, sums)
    of_order = NOTHING
    if case.expected is not None:
        of_order = case.expected[q] - case.predicted.get(q, NOTHING)
    masking = _Sum(0.0, rate * let_out.half, -rate * let_out.each)
    half = float(np.linalg.norm([rest.half, of_order.half, masking.half]))
    return sums | {
        "masking": masking,
        "multiple": _Sum(rest.fixed + of_order.value, half, rest.each - masking.each),
        **_measuring(case, q),
    }


def _measuring(case: Case, q: str) -> dict[str, _Sum]:
    """What a second layer changes, if there is one, and the spread of the measurement itself."""
    values = np.asarray(case.measured[q], float)
    if case.layers is None:
        return {"noise": _Sum(0.0, 0.0, values - values.mean())}
    layered = np.asarray(case.layers[q], float)
    return {
        _LAYERS: _Sum(0.0, 0.0, layered - values),
        "noise": _Sum(0.0, 0.0, layered - layered.mean()),
    }
