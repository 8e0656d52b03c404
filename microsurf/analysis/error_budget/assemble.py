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
from .refinement import Refinement
from .regions import FIRST, HIGHER, LOBES, REGIONS, components, of_order_one, region_masks
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
    cases = {}
    for t, theta in enumerate(scene.light.theta):
        for p, phi in enumerate(scene.light.phi):
            changes = [
                first_order_change(scene, slopes, theta, phi, _SEEDS * seed + k)
                for k in range(_SEEDS)
            ]
            for kd in scene.material.kd:
                weight = float(body_weight(n, kd))
                albedos_by_order = _parts(predicted, n, kd, (t, p))
                ideal = albedos_by_order if theory is None else _parts(theory, n, kd, (t, p))
                effect = _of_slopes([of_order_one(c[0], weight) for c in changes])
                if later is not None:
                    walked = _later(later.isel(theta_i=t, phi_i=p), n, kd)
                    effect |= {q: walked[q] for q in HIGHER if q in ideal}
                mirrored = float(np.mean([c[2][0] for c in changes]))
                rays = _ray_errors(measured, n, kd, (t, p)) if alone else {}
                layered = {} if layers is None else _layers(layers, rays, n, kd, (t, p))
                cases[theta, phi, kd] = Case(
                    measured={q: v[:, t, p] for q, v in components(measured, n, kd).items()},
                    ray_errors=rays,
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
                    **layered,
                )
    return cases


def _layers(
    layers: xr.Dataset,
    rays: Mapping[str, float],
    n: float,
    kd: float,
    index: tuple[int, int],
) -> dict[str, Any]:
    """What a `Case` holds of two layers; ``rays`` are the errors of IL facets on one surface."""
    parts = {q: v[:, *index] for q, v in components(layers, n, kd).items()}
    both = _ray_errors(layers, n, kd, index) if rays else {}
    return {
        "layers": parts,
        "layers_ray_errors": {q: float(np.hypot(both[q], rays[q])) for q in rays},
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


def _parts(
    models: tuple[xr.Dataset, xr.Dataset | None], n: float, kd: float, index: tuple[int, int]
) -> dict[str, TermEstimate]:
    """Order 1 of the first model, later orders of the second."""
    first, walk = models
    parts = {
        q: TermEstimate(float(v[0][index])) for q, v in components(first, n, kd).items()
        if q in (*FIRST, *LOBES)
    }  # fmt: skip
    if walk is not None:
        walked = _walked(walk, n, kd, index)
        parts |= {q: walked[q] for q in HIGHER if q in walked}
    return parts


def _walked(
    walk: xr.Dataset, n: float, kd: float, index: tuple[int, int]
) -> dict[str, TermEstimate]:
    """Parts of a walk; a path brings 0 … 1, so that the variance of a part is below the part."""
    paths = float(walk.paths.values[0][index]) if "paths" in walk else np.inf
    return {
        q: TermEstimate(
            float(v[0][index]), intervals.normal() * float(np.sqrt(max(v[0][index], 0.0) / paths))
        )
        for q, v in components(walk, n, kd).items()
    }


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
    walked = _walked(walk.assign(flux=flux * factor), n, kd, index)
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


def _ray_errors(
    measured: xr.Dataset, n: float, kd: float, index: tuple[int, int]
) -> dict[str, float]:
    """Of one surface: albedos from batches, lobes from their bins, later orders a bound."""
    first = {"order-1 specular": "specular", "order-1 body": "body", "total": "total"}
    by_quantity = {
        q: float(measured.microsurf.ray_error(**summary.SELECTED[name], kd=kd).values[0][index])
        for q, name in first.items()
    }
    light = float(measured.light_rays.values[0][index])
    for q, v in components(measured, n, kd).items():
        if q in HIGHER:
            by_quantity[q] = float(np.sqrt(v[0][index] / light))
    for part, kind in zip(FIRST, detector.KINDS, strict=True):
        for region, mask in zip(REGIONS, region_masks(), strict=True):
            errors = measured.microsurf.region_ray_error(kind, mask, kd=kd)
            by_quantity[f"{part} {region}"] = float(errors.values[0][index])
    return by_quantity


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
