"""A measured BRDF fitted: parameters, intervals, distributions side by side, verdict."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...results.measured_brdf import MeasuredBrdf
from . import aperture as detector
from . import verdict as judged
from .held_out import HELD_OUT, Evidence, evidence, held_out, held_out_log_rms
from .intervals import Resampled, resample
from .later_orders import WALKS, fit_all_orders, possible
from .materials import MATERIALS, lobes
from .parameters import DISTRIBUTIONS, MOST_ETA, Layout
from .problem import Problem, incidences, problem_of, thinned
from .solve import Question, Solution, model, solve

Array = NDArray[np.float64]

_AT_BOUND = 1e-3  # of the range of a parameter


@dataclass(frozen=True)
class Fitted:
    """Parameters of one fit and their resampling; ``question`` says of what."""

    question: Question
    solution: Solution
    resampled: Resampled

    @property
    def brdf(self) -> Array:
        """BRDF of the fit at the measured pairs in sr⁻¹, shape (pairs, channels)."""
        q, s = self.question, self.solution
        modelled = lobes(q.problem, q.material, q.layout, s.vector)
        return model(q, modelled, s.vector, s.channel)


@dataclass(frozen=True)
class BrdfFit:
    """What was found of a measured BRDF.

    Attributes
    ----------
    measured : MeasuredBrdf
        The pairs fitted, with remarks.
    material, isotropic, aperture :
        What was asked; the full angle of the detector in degrees, or None.
    one_order, all_orders : Fitted
        STD by the closed form of order 1, and with later orders; None if not asked, if
        light does not walk in that material, or if the lobe is not resolved.
    rounds : int
        Rounds of the latter.
    others : mapping of str to Fitted
        Beckmann and GGX, order 1.
    held_out : tuple of float, held_out_log_rms : mapping of str to float
        Incidences not seen, in degrees, and what is left there; empty if too few are.
    held_out_all_orders : float or None
        The same of STD with all orders.
    evidence : mapping of str to Evidence
        Of Beckmann and of GGX against STD.
    verdict, reason : str
        One of fits, border, narrow, does not fit, and why.
    zones : list of Zone
        Measured against fitted light by zone.

    """

    measured: MeasuredBrdf
    material: str
    isotropic: bool
    aperture: float | None
    one_order: Fitted
    all_orders: Fitted | None
    rounds: int
    others: Mapping[str, Fitted]
    held_out: tuple[float, ...]
    held_out_log_rms: Mapping[str, float]
    held_out_all_orders: float | None
    evidence: Mapping[str, Evidence]
    verdict: str
    reason: str
    zones: list[judged.Zone]

    @property
    def best(self) -> Fitted:
        """The fit that stands: with all orders if it was made."""
        return self.all_orders or self.one_order


def fit_brdf(
    brdf: MeasuredBrdf,
    material: str = "interfaced-lambertian",
    *,
    isotropic: bool = True,
    aperture: float | None = None,
    orders: str = "all",
    hold_out: tuple[float, ...] = HELD_OUT,
    margin: float = judged.MARGIN,
    walks: int = WALKS,
    seed: int = 0,
) -> BrdfFit:
    """Fit a measured BRDF, all channels together.

    Parameters
    ----------
    brdf : MeasuredBrdf
        Pairs at three incidences or more.
    material : str
        One of MATERIALS.
    isotropic : bool
        One σ, or σ_x and σ_y with the azimuth of their axes.
    aperture : float, optional
        Full angle of the detector's cone in degrees, to average the mirror lobe over.
    orders : str
        "1": the closed form alone; "all": a second fit with all orders of scattering.
    hold_out : tuple of float
        Incidences in degrees to hold out of one more fit of each distribution.
    margin : float
        Relative departure of a zone's light that is still a fit, see `verdict`.
    walks, seed : int
        Random walks for each pair, of the later orders, and where their numbers begin.

    Raises
    ------
    InputError
        If one of these is not as described, or the pairs do not suffice.

    """
    if material not in MATERIALS:
        raise InputError(f"material = {material!r}: must be one of {', '.join(MATERIALS)}")
    if orders not in ("1", "all"):
        raise InputError(f"orders = {orders!r}: must be 1 or all")
    if not 0 < margin < 1:
        raise InputError(f"margin = {margin}: must be between 0 and 1")
    if not np.any(np.nanmean(brdf.values, axis=0) > 0):
        raise InputError(f"{brdf.source}: no channel has a mean value above 0: no light to fit")
    brdf = thinned(brdf)
    azimuths = int(incidences(brdf, isotropic=False).max() - incidences(brdf, isotropic=True).max())
    if not isotropic and azimuths == 0:
        raise InputError(
            f"{brdf.source}: light comes from one azimuth at each θ_i: an anisotropic fit needs "
            "several; fit it as isotropic"
        )
    if isotropic and azimuths > 0:
        brdf = brdf.remarked(
            "light comes from several azimuths, which an isotropic fit takes for one: is there a "
            "lay? compare with --anisotropic"
        )
    cone = None if aperture is None else detector.cone(brdf.detector, aperture)
    problem = problem_of(brdf, isotropic=isotropic, cone=cone)
    narrow = () if cone is not None else judged.unresolved(problem)
    out = np.zeros(len(problem.i), bool)
    if narrow:
        out = judged.from_mirror(problem) < judged.resolution(problem, narrow) - 1e-6
    fits = _distributions(problem.select(~out), material, isotropic)
    fitted = {name: Fitted(*solved, resample(*solved)) for name, solved in fits.items()}
    one = fitted.pop("std")
    every, rounds = None, 0
    # Later orders of a lobe that is not resolved are not known either.
    if orders == "all" and not narrow and possible(one.question):
        question, solution, rounds = fit_all_orders(*fits["std"], walks, seed)
        fits["all orders"] = question, solution
        every = Fitted(question, solution, resample(question, solution))
    best = every or one
    mask, angles = held_out(best.question.problem, hold_out)
    rms = {name: held_out_log_rms(*solved, mask) for name, solved in fits.items()} if angles else {}
    all_orders_rms = rms.pop("all orders", None)
    rows = judged.zones(problem, _everywhere(best, problem, out), margin, out if narrow else None)
    verdict, reason = _judge(best, rows, narrow)
    return BrdfFit(
        brdf.select(~out), material, isotropic, aperture, one, every, rounds, fitted,
        tuple(angles), rms,
        all_orders_rms,
        {name: evidence(solved.resampled, one.resampled) for name, solved in fitted.items()},
        verdict, reason, rows,
    )  # fmt: skip


def _distributions(
    problem: Problem, material: str, isotropic: bool
) -> dict[str, tuple[Question, Solution]]:
    """Fit Beckmann, GGX, and STD, which starts from both as well."""
    solutions: dict[str, tuple[Question, Solution]] = {}
    for name, eta in DISTRIBUTIONS.items():
        layout = Layout(MATERIALS[material].optics, eta, isotropic)
        question = Question(problem, MATERIALS[material], layout)
        index = 1 if isotropic else 3
        known = [
            np.insert(solution.vector, index, float(DISTRIBUTIONS[other] or 0))
            for other, (_, solution) in solutions.items()
            if eta is None
        ]
        solutions[name] = question, solve(question, known)
    return solutions


def _everywhere(fit: Fitted, problem: Problem, out: NDArray[np.bool_]) -> Array:
    """BRDF of a fit at all pairs, also those it did not see: there without later orders."""
    values = np.zeros(problem.logs.shape)
    values[~out] = fit.brdf
    return values


def _judge(fit: Fitted, rows: list[judged.Zone], narrow: tuple[float, ...]) -> tuple[str, str]:
    if where := judged.said(rows):
        return judged.DOES_NOT_FIT, where
    if narrow:
        shown = ", ".join(f"{angle:.0f}°" for angle in narrow)
        return judged.NARROW, (
            f"at θ_i = {shown} one pair at the mirror direction outshines all others ten times: "
            "γ and σ are not known, the lobe is narrower than the instrument tells; the rest fits"
        )
    if at := _borders(fit):
        return judged.BORDER, f"{at} ended at the border of what may be"
    return judged.FITS, "no zone of light departs by more than the margin"


def _borders(fit: Fitted) -> str:
    layout, vector = fit.question.layout, fit.solution.vector
    low, high = layout.bounds
    borders = []
    for k, name in enumerate(layout.names):
        room = _AT_BOUND * (high[k] - low[k])
        # η = 0 is Beckmann, a distribution like others and no border.
        if vector[k] > high[k] - room or (name != "eta" and vector[k] < low[k] + room):
            borders.append({"eta": f"γ → {1 + 1 / MOST_ETA:.2f}", "log_sigma": "σ"}.get(name, name))
    return " and ".join(borders)
