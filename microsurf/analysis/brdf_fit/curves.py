"""Lobes of a fit in the plane of incidence, as curves."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import aperture
from .fit import BrdfFit, Fitted
from .later_orders import correction
from .materials import lobes
from .problem import Problem, collected
from .solve import Question, model

Array = NDArray[np.float64]

_STEP = 1.0  # degrees
_IN_PLANE = 6.0  # degrees of azimuth from it
_WALKS = 2000


class Curve(NamedTuple):
    """One incidence, in degrees: signed θ_o, positive on the mirror side, and mean f cosθ_o.

    Of what was measured within 6° of azimuth of the plane, and of the fit; means over
    channels in sr⁻¹.
    """

    theta_i: float
    measured_at: Array
    measured: Array
    fitted_at: Array
    fitted: Array


def curves(fit: BrdfFit, most: int = 4) -> list[Curve]:
    """Return curves at some incidences, evenly picked among those measured in the plane."""
    problem = fit.best.question.problem
    theta = np.degrees(np.arccos(np.clip(problem.i[:, 2], -1, 1)))
    azimuth = np.arctan2(problem.o[:, 1], problem.o[:, 0]) - np.arctan2(
        problem.i[:, 1], problem.i[:, 0]
    )
    cosine, steep = np.cos(azimuth), np.arccos(np.clip(problem.o[:, 2], -1, 1))
    plane = (np.abs(cosine) > np.cos(np.radians(_IN_PLANE))) | (steep < np.radians(1))
    angles_there = np.unique(np.round(theta[plane], 1))
    shown = angles_there[np.unique(np.linspace(0, len(angles_there) - 1, most).round().astype(int))]
    level = np.mean(np.expm1(problem.logs), axis=1)
    rows = []
    for angle in shown:
        mine = plane & (np.abs(theta - angle) < 0.051)
        signed = np.degrees(steep[mine]) * np.where(cosine[mine] > 0, -1, 1)
        order = np.argsort(signed)
        i = problem.i[np.flatnonzero(mine)[0]]
        at, values = _fitted(fit, fit.best, i)
        rows.append(Curve(float(angle), signed[order], level[mine][order], at, values))
    return rows


def _fitted(fit: BrdfFit, of: Fitted, i: Array) -> tuple[Array, Array]:
    at = np.arange(-88.0, 88.0 + _STEP / 2, _STEP)
    across = np.hypot(i[0], i[1])
    forward = np.array([-1.0, 0, 0]) if across == 0 else np.array([-i[0], -i[1], 0]) / across
    angle = np.radians(at)[:, None]
    o = np.sin(angle) * forward + np.cos(angle) * np.array([0.0, 0, 1])
    channels = of.question.problem.logs.shape[1]
    cone = None if fit.aperture is None else aperture.cone(o, fit.aperture)
    light = np.tile(i, (len(o), 1))
    problem = Problem(
        light,
        o,
        collected(light, o, cone),
        o[:, 2],
        np.zeros((len(o), channels)),
        np.ones((len(o), channels), bool),
        np.zeros(len(o), np.intp),
    )
    question = Question(problem, of.question.material, of.question.layout)
    if of is fit.all_orders:
        question = replace(question, later=correction(question, of.solution, _WALKS, 0))
    modelled = lobes(problem, question.material, question.layout, of.solution.vector)
    values = model(question, modelled, of.solution.vector, of.solution.channel)
    return at, np.asarray(np.mean(values * problem.cosine[:, None], axis=1))
