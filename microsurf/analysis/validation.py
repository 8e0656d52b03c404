"""What the main job finds out about one scene, as the report shows it."""

import json
from dataclasses import dataclass, field
from typing import Any

import xarray as xr

from .. import invariants
from ..results import albedos
from ..scene import Scene
from ..surface import Heightfield, StdFit
from . import comparison
from .error_budget import assemble
from .fitted_theory import fit_as_json
from .tradeoff.study import Tradeoff
from .user_brdf import UserBrdfResult


@dataclass(frozen=True)
class Validation:
    """What one scene came to.

    Attributes
    ----------
    name : str
        Of the scene file.
    measured : xarray.Dataset
        The measurement, see `microsurf.results.datasets`.
    predicted : dict
        Predictions by the models that `model.registry` has compared, order 1 before all.
    comparisons : ComparisonTable
        Order 1 against the first model of order 1, the total against the first of all orders.
    invariants : list of Invariant
        What must hold whatever the surface, see `invariants.scene_invariants`.
    heightfield : Heightfield or None
        First realisation; None for a flat scene, and for a lay that is turned from x and y.
    statistics : dict
        Of its facet slopes, see `surface.surface_statistics`.
    fit : StdFit or None
        STD fitted to a surface that was not generated.
    notes : list of str
        What is assumed of a surface from a file, and what hints at a mistake in it.
    left_out : list of dict
        What the effects that the scene leaves out cost, see `omitted_effects.cost`.
    budget : list of Budget
        Where each difference comes from, see `budget.budget_of`; empty for a flat scene.
    masking : list of dict
        Masking and shadowing by facet slope, see `masking.masking_by_slope`; empty unless
        the scene was refined.
    layers : dict
        Of a scene with two layers, see `two_layers.summary`. Else empty.
    frontier : Tradeoff or None
        What the models cost and how far they are off, see `frontier.frontier_of`; None unless
        the scene was refined.
    seconds : float
        All of it.
    user_brdf : UserBrdfResult or None
        A user BRDF against the theory; the comparisons are then the user BRDF's, see
        `validate_user_brdf.judge`.
    faults : list of str
        What is wrong with the user BRDF itself.

    """

    name: str
    scene: Scene
    measured: xr.Dataset
    predicted: dict[str, xr.Dataset]
    comparisons: comparison.ComparisonTable
    invariants: list[invariants.Invariant]
    heightfield: Heightfield | None = None
    statistics: dict[str, Any] = field(default_factory=dict)
    fit: StdFit | None = None
    left_out: list[dict[str, Any]] = field(default_factory=list)
    budget: list[assemble.Budget] = field(default_factory=list)
    masking: list[dict[str, Any]] = field(default_factory=list)
    layers: dict[str, Any] = field(default_factory=dict)
    frontier: Tradeoff | None = None
    seconds: float = 0.0
    user_brdf: UserBrdfResult | None = None
    faults: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @property
    def broken(self) -> list[str]:
        """Invariants that do not hold, and a user BRDF's faults; else empty."""
        return invariants.broken(self.invariants) + self.faults

    @property
    def unit(self) -> str:
        """Of lengths on the surface: cells, or of a file what its reader knows."""
        if self.scene.surface.file is None:
            return "cells"
        known = json.loads(self.measured.attrs.get("surface", "{}")).get("unit")
        return str(known or "unit of the file")


def as_json(entry: Validation) -> dict[str, Any]:
    """The figures of one scene for report.json."""
    return {
        "name": entry.name,
        "title": entry.scene.title,
        "comparisons": [{**vars(row), "unexpected": row.unexpected} for row in entry.comparisons],
        "broken": entry.broken,
        "invariants": invariants.as_rows(entry.invariants),
        "measured": {
            **albedos.figures(entry.measured),
            **albedos.losses(entry.measured),
            "paths": int(entry.measured.paths.sum()),
            "rays": int(entry.measured.attrs["rays"]),
            "tracing_seconds": entry.measured.attrs["seconds"],
            "embree_ratio": entry.measured.attrs["embree_ratio"],
            "engine": entry.measured.attrs["engine"],
        },
        "predicted": {
            key: albedos.figures(prediction) for key, prediction in entry.predicted.items()
        },
        "surface": entry.statistics,
        "fit": None if entry.fit is None else fit_as_json(entry.fit),
        "notes": entry.notes,
        "left_out": entry.left_out,
        "budget": assemble.rows(entry.budget),
        "masking": entry.masking,
        "layers": entry.layers,
        "user_brdf": None if entry.user_brdf is None else entry.user_brdf.as_json(),
        "seconds": entry.seconds,
    }
