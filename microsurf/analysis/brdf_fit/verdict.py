"""Whether a fit describes what was measured: fits, border, narrow, or does not fit.

Around the mirror direction of each incidence lie five zones. In each, measured and fitted
light is compared as everywhere in this project: it *holds*, *departs* or is *undecided*
against a margin, by its interval. The difference is relative to the fitted light, but at
least to half of the brightest zone of the incidence: the metric of the fit gives little weight
to the dark, so the verdict must not ask for more.

A lobe is *unresolved* where one pair at the mirror direction outshines all others of its
incidence ten times: its width is then the instrument's, or less. Such pairs are left out and
the rest is fitted again: if that holds, the verdict is *narrow*.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...stats import intervals
from ..comparison import decide
from .problem import Problem

Array = NDArray[np.float64]

MARGIN = 0.15
"""Relative departure of a zone's light that is still called a fit."""
FITS, BORDER, NARROW, DOES_NOT_FIT = "fits", "border", "narrow", "does not fit"
ZONES = ("mirror", "shoulder", "forward", "side", "back")
"""Within 15° of the mirror direction, 15–35° from it, and beyond that by azimuth."""

_PEAK, _SHOULDER = 15.0, 35.0
_FORWARD = 0.3  # cosine of the azimuth from which a direction is forward or back
_BRIGHT = 0.5
_OUTSHINES = 10.0
_UNRESOLVED = 2  # incidences from which on a lobe is
_LEAST = 3  # pairs of a zone, for an interval


@dataclass(frozen=True)
class Zone:
    """Light of one zone at one incidence.

    theta_i in degrees; measured and fitted: mean f cosθ_o in sr⁻¹; effect: relative
    difference, see the module, with its interval [low, high] from the scatter of its pairs,
    simultaneous over all zones.
    """

    theta_i: float
    zone: str
    pairs: int
    measured: float
    fitted: float
    effect: float
    low: float
    high: float
    verdict: str


def from_mirror(problem: Problem) -> Array:
    """Angle of each detector direction from the mirror direction in degrees, shape (pairs,)."""
    mirror = problem.i * [-1, -1, 1]
    half = np.minimum(np.linalg.norm(problem.o - mirror, axis=1) / 2, 1)
    return np.asarray(np.degrees(2 * np.arcsin(half)))


def zones(
    problem: Problem, fitted: Array, margin: float, left_out: Array | None = None
) -> list[Zone]:
    """Compare all zones.

    Parameters
    ----------
    problem : Problem
        What was measured.
    fitted : array, shape (pairs, channels)
        BRDF of the fit in sr⁻¹.
    margin : float
        Relative departure that is still a fit.
    left_out : array of bool, shape (pairs,), optional
        Pairs that the fit did not see: they count for what is bright, and are not compared.

    """
    known = problem.known
    measured = np.sum(np.where(known, np.expm1(problem.logs), 0), axis=1)
    modelled = np.sum(np.where(known, fitted * problem.cosine[:, None], 0), axis=1)
    channels = np.maximum(np.count_nonzero(known, axis=1), 1)
    measured, modelled = measured / channels, modelled / channels
    zone = _places(problem)
    kept = np.ones(len(zone), bool) if left_out is None else np.logical_not(left_out)
    rows = []
    for group in np.unique(problem.groups):
        here = problem.groups == group
        means = [
            measured[here & (zone == k)].mean() if np.any(here & (zone == k)) else 0.0
            for k in range(len(ZONES))
        ]
        for k, name in enumerate(ZONES):
            mine = here & (zone == k) & kept
            if np.count_nonzero(mine) >= _LEAST and max(means) > 0:
                theta = float(np.degrees(np.arccos(problem.i[here, 2].mean())))
                least = _BRIGHT * max(means)
                rows.append((theta, name, measured[mine], modelled[mine], least))
    return [_zone(*row, margin, len(rows)) for row in rows]


def _places(problem: Problem) -> NDArray[np.intp]:
    off = from_mirror(problem)
    across = np.linalg.norm(problem.i[:, :2], axis=1) * np.linalg.norm(problem.o[:, :2], axis=1)
    toward = np.sum(problem.i[:, :2] * problem.o[:, :2], axis=1) / np.maximum(across, 1e-12)
    beyond = np.where(toward < -_FORWARD, 2, np.where(toward > _FORWARD, 4, 3))
    return np.where(off <= _PEAK, 0, np.where(off <= _SHOULDER, 1, beyond))


def _zone(
    theta: float, name: str, measured: Array, fitted: Array, least: float, margin: float,
    family: int,
) -> Zone:  # fmt: skip
    pairs, scale = len(measured), max(float(fitted.mean()), least)
    difference = (measured - fitted) / scale
    effect = float(difference.mean())
    half = float(intervals.half_width_of_mean(difference, 1 - 0.05 / max(family, 1)))
    low, high = effect - half, effect + half
    return Zone(
        theta, name, pairs, float(measured.mean()), float(fitted.mean()), effect, low, high,
        decide(low, high, margin),
    )  # fmt: skip


def departing(rows: list[Zone]) -> list[Zone]:
    """Zones that depart, the largest departure first."""
    departures = [row for row in rows if row.verdict == "departs"]
    return sorted(departures, key=lambda row: -abs(row.effect))


def unresolved(problem: Problem) -> tuple[float, ...]:
    """Incidences in degrees at which one pair at the mirror direction outshines all others."""
    level = np.sum(np.expm1(problem.logs), axis=1)
    off, groups = from_mirror(problem), []
    for group in np.unique(problem.groups):
        mine = np.flatnonzero(problem.groups == group)
        if len(mine) < _LEAST:
            continue
        order = mine[np.argsort(-level[mine])]
        if off[order[0]] <= _PEAK and level[order[0]] > _OUTSHINES * max(level[order[1]], 0.0):
            groups.append(float(np.degrees(np.arccos(problem.i[order[0], 2]))))
    return tuple(groups) if len(groups) >= _UNRESOLVED else ()


def resolution(problem: Problem, incidences: tuple[float, ...]) -> float:
    """Angle in degrees from the mirror direction at which the next pairs of these lie.

    The median over unresolved incidences of the second smallest angle: nearer than that a
    lobe has one pair.
    """
    off, theta = from_mirror(problem), np.degrees(np.arccos(problem.i[:, 2]))
    nearest = []
    for incidence in incidences:
        mine = np.sort(off[np.abs(theta - incidence) < 1e-6])
        nearest.append(mine[1] if len(mine) > 1 else _PEAK)
    return float(np.median(nearest))


def said(rows: list[Zone], most: int = 3) -> str:
    """Say what departs and where, in words; empty if nothing does."""
    return "; ".join(
        f"at θ_i = {row.theta_i:.0f}° the {row.zone} zone measures "
        f"{row.measured:.3g} sr⁻¹ and {row.fitted:.3g} are fitted"
        for row in departing(rows)[:most]
    )
