"""The error budget of a scene: its measurement against its prediction, split into causes.

The arithmetic and the order of substitution are in `terms`; here is what it needs: the
theory with the slopes that the surfaces have, and the errors of mesh and tile.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...model.mesh_slopes.higher_orders import BATCHES, order_change
from ...model.mesh_slopes.order_one import first_order_change
from ...model.mesh_slopes.slopes import Slopes
from ...physics.facet import body_weight
from ...results import albedos as summary
from ...results import datasets, detector
from ...scene import Scene
from ...stats import intervals
from ...surface import Heightfield, facet_slopes
from .estimates import Estimates, at, parts_of, ray_errors_of, walked_parts
from .refinement import Refinement
from .regions import FIRST, HIGHER, components, of_order_one
from .terms import TERMS, Case, Term, TermEstimate, split

Array = NDArray[np.float64]

WALKS = 400_000
"""Behind the slopes' effect on later orders, for each angle: 1e−4 of an albedo, about."""
_SEEDS = 4
"""Runs of the paired difference of order 1: its error is their spread."""


@dataclass(frozen=True)
class Budget:
    """Terms of one incidence and Kd, by quantity, and what they add up to."""

    theta_i: float
    phi_i: float
    kd: float
    predicted: Mapping[str, float]
    terms: Mapping[str, Mapping[str, Term]]


def slopes_of(surfaces: Sequence[Heightfield], scene: Scene) -> Slopes:
    """Slopes of all facets of all surfaces together."""
    rough = scene.roughness
    rho = []
    for surface in surfaces:
        p, q = facet_slopes(surface)
        rho.append(np.hypot(p / rough.sigma_x, q / rough.sigma_y).ravel())
    return Slopes(np.sort(np.concatenate(rho)), rough.sigma_x, rough.sigma_y)


def budget_of(cases: Mapping[tuple[float, float, float], Case]) -> list[Budget]:
    """Split measured − predicted of what `cases_of` gathered: one for each angle and Kd."""
    return [Budget(*index, _sizes(case), split(case)) for index, case in cases.items()]


def _sizes(case: Case) -> dict[str, float]:
    """What was predicted, and in all."""
    sizes = {q: estimate.value for q, estimate in case.predicted.items()}
    sizes["total"] = sum(sizes[q] for q in (*FIRST, *HIGHER) if q in sizes)
    return sizes


def cases_of(
    scene: Scene,
    measured: xr.Dataset,
    predicted: tuple[xr.Dataset, xr.Dataset | None],
    surfaces: Sequence[Heightfield],
    *,
    theory: tuple[xr.Dataset, xr.Dataset | None] | None = None,
    refinement: Refinement | None = None,
    exchange: Mapping[float, Mapping[str, float]] | None = None,
    layers: xr.Dataset | None = None,
    walks: int = WALKS,
    seed: int = 0,
) -> dict[tuple[float, float, float], Case]:
    """Gather what is to be split for every angle and Kd.

    Parameters
    ----------
    scene : Scene
        With the roughness that the prediction has; σ > 0.
    measured : Dataset
        On ``surfaces``.
    predicted : (Dataset, Dataset or None)
        Order 1 of a model, and all orders of a walk (None if the scene has one order).
    surfaces : sequence of Heightfield
        One for each realisation.
    theory : (Dataset, Dataset or None), optional
        Smith's, if ``predicted`` is another's.
    refinement : Refinement, optional
        What mesh and tile leave; without it these terms are absent.
    exchange : mapping by θ_i, optional
        See `exchange_of`.
    layers : Dataset, optional
        Two layers measured on ``surfaces`` as interfaces; ``measured`` and ``predicted`` are then
        of IL facets.
    walks, seed : int
        Of the walk with the surfaces' slopes.

    Returns
    -------
    dict of Case
        By θ, φ and Kd.

    """
    slopes = slopes_of(surfaces, scene)
    n = scene.material.n
    later = None
    if scene.requires.multiple_scattering and predicted[1] is not None:
        later = order_change(scene, slopes, walks=walks, seed=seed).change
    lost = summary.lost_light(measured).values
    alone = measured.sizes["realisation"] == 1  # of several their spread is the error
    of_kd = {
        kd: _OfKd(
            measured=components(measured, n, kd),
            ray_errors=ray_errors_of(measured, n, kd) if alone else {},
            predicted=parts_of(predicted, n, kd),
            theory=None if theory is None else parts_of(theory, n, kd),
            layers=None if layers is None else components(layers, n, kd),
            layers_ray_errors={} if layers is None or not alone else ray_errors_of(layers, n, kd),
        )
        for kd in scene.material.kd
    }
    cases = {}
    for t, theta in enumerate(scene.light.theta):
        for p, phi in enumerate(scene.light.phi):
            changes = [
                first_order_change(scene, slopes, theta, phi, _SEEDS * seed + k)
                for k in range(_SEEDS)
            ]
            for kd, of in of_kd.items():
                weight = float(body_weight(n, kd))
                albedos_by_order = at(of.predicted, (t, p))
                ideal = albedos_by_order if of.theory is None else at(of.theory, (t, p))
                effect = _of_slopes([of_order_one(c[0], weight) for c in changes])
                if later is not None:
                    walked = _later(later.isel(theta_i=t, phi_i=p), n, kd)
                    effect |= {q: walked[q] for q in HIGHER if q in ideal}
                mirrored = float(np.mean([c[2][0] for c in changes]))
                cases[theta, phi, kd] = Case(
                    measured={q: v[:, t, p] for q, v in of.measured.items()},
                    ray_errors={q: float(v[t, p]) for q, v in of.ray_errors.items()},
                    predicted=albedos_by_order,
                    theory=ideal,
                    slopes=effect,
                    scattered=mirrored + weight * (1 - mirrored),
                    mesh=None if refinement is None else refinement.parts("mesh", kd, (t, p)),
                    tile=None if refinement is None else refinement.parts("tile", kd, (t, p)),
                    lost=float(lost[t, p]),
                    expected=None
                    if theory is None
                    else _expected(albedos_by_order, ideal, theory[1], n, kd, (t, p)),
                    exchange=None if exchange is None else exchange.get(theta),
                    **of.layers_at((t, p)),
                )
    return cases


@dataclass(frozen=True)
class _OfKd:
    """What one Kd makes of results, by part, for all angles; see `Case` and `cases_of`.

    ``measured``, ``layers``: shape (realisation, theta_i, phi_i). Errors: (theta_i, phi_i).
    """

    measured: Mapping[str, Array]
    ray_errors: Mapping[str, Array]
    predicted: Estimates
    theory: Estimates | None
    layers: Mapping[str, Array] | None
    layers_ray_errors: Mapping[str, Array]

    def layers_at(self, index: tuple[int, int]) -> dict[str, Any]:
        """What a `Case` holds of two layers; IL facets on one surface have errors of rays too."""
        if self.layers is None:
            return {}
        return {
            "layers": {q: v[:, *index] for q, v in self.layers.items()},
            "layers_ray_errors": {
                q: float(np.hypot(self.layers_ray_errors[q][index], v[index]))
                for q, v in self.ray_errors.items()
            },
        }


def exchange_of(by_slope: Sequence[Mapping[str, Any]]) -> dict[float, dict[str, float]]:
    """By how much slopes and masking of the specular order 1 depend on who is substituted first.

    Out of rows of `masking.masking_by_slope`: with shares s of the slopes and contributions c
    the slopes' term is Σ (s − s_STD) c with Smith's c, or with the measured ones.
    """
    exchanges: dict[float, float] = {}
    for row in by_slope:
        shift = row["share"] - row["share_std"]
        apart = shift * (row["specular"] - row["specular_smith"])
        exchanges[row["theta_i"]] = exchanges.get(row["theta_i"], 0.0) + apart
    return {theta: {FIRST[0]: value} for theta, value in exchanges.items()}


def _expected(
    predicted: Mapping[str, TermEstimate],
    ideal: Mapping[str, TermEstimate],
    walk: xr.Dataset | None,
    n: float,
    kd: float,
    index: tuple[int, int],
) -> dict[str, TermEstimate]:
    """Return later orders of a theory whose every event has the user BRDF's faults of order 1.

    Orders of b body events have the ratio of the body b times, that of mirroring else.
    """
    if walk is None:
        return {}
    ratios = [predicted[q].value / ideal[q].value if ideal[q].value > 0 else 1.0 for q in FIRST]
    mirrored, body = ratios
    flux = walk.flux
    b = detector.BODY_EVENTS[: flux.sizes["body_events"]]
    others = np.maximum(flux.order.values[:, None] - b, 0)
    factor = xr.DataArray(mirrored**others * body**b, dims=("order", "body_events"))
    walked = at(walked_parts(walk.assign(flux=flux * factor), n, kd), index)
    return {q: walked[q] for q in HIGHER if q in walked}


def _of_slopes(runs: Sequence[Mapping[str, Any]]) -> dict[str, TermEstimate]:
    """What slopes change of each part: mean of independent runs, its error from their spread."""
    estimates = {}
    for q in runs[0]:
        values = np.array([run[q] for run in runs])
        estimates[q] = TermEstimate(
            float(values.mean()), float(intervals.half_width_of_mean(values))
        )
    return estimates


def _later(change: xr.DataArray, n: float, kd: float) -> dict[str, TermEstimate]:
    """The same of later orders."""
    albedos = datasets.by_kind(change, n, kd).sum("kind").transpose("batch", "order").values[:, 1:]
    return _of_slopes([dict(zip(HIGHER, albedos[k], strict=True)) for k in range(BATCHES)])


def rows(budgets: Sequence[Budget]) -> list[dict[str, Any]]:
    """One row a term: albedos, and parts of the prediction (null where that is 0)."""
    table = []
    for budget in budgets:
        incidence = {"theta_i": budget.theta_i, "phi_i": budget.phi_i, "kd": budget.kd}
        for q, terms in budget.terms.items():
            size = budget.predicted.get(q, 0.0)
            for name in TERMS:
                if name not in terms:
                    continue
                term = asdict(terms[name])
                shares = {
                    f"relative_{key}": term[key] / size if size > 0 else None
                    for key in ("value", "low", "high")
                }
                table.append(incidence | term | {"predicted": size} | shares)
    return table
