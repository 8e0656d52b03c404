"""BSDFs of Mitsuba against light traced on explicit surfaces, by order and kind.

Each plug-in is given what it has a parameter for: int_ior, reflectance, α = σ of GGX (γ = 2) or
Beckmann (γ → ∞). A renderer adds nothing to its BSDF, so that the sum stands for all orders;
its components stand beside order 1 and beside all orders of their kind. A random walk of all
orders goes through the same comparison, to tell what the surfaces themselves differ by.
"""

from dataclasses import dataclass
from itertools import product
from typing import Any

import xarray as xr

from microsurf import measure, model
from microsurf.analysis.comparison import decide
from microsurf.scene import Accuracy, Light, Material, Roughness, Scene, Surface
from microsurf.scene.roughness import BECKMANN
from microsurf.stats import intervals

ALPHAS = (0.1, 0.3, 0.5, 0.7)
THETAS = (0.0, 30.0, 60.0, 80.0)
MARGIN = 0.05
SURFACE = Surface(cells=256, realisations=64)
PATHS = 20_000

PLASTIC = Material(1.5, (0.8,))
LAMBERTIAN = Material(1.0, (0.8,))
GOLD = Material(0.21, (), 3.27)
"""At 600 nm."""

NUMBERS = ("alpha", "theta_i", "traced", "standard_error", "predicted", "effect", "low", "high")
"""Columns of a row that hold numbers, but the seed."""

Row = dict[str, Any]
Parts = tuple[tuple[str, str | None, int | None], ...]


@dataclass(frozen=True)
class Compared:
    """One model on the facets that it means.

    ``given`` is what stands behind ``--model``; ``parts`` of its light, which may be
    compared: name, kind and order of the traced light (None: of all).
    """

    given: str
    material: Material
    gamma: float
    parts: Parts


WALK = "smith-walk"
WALKS = 1_000_000

TOTAL: Parts = (("total", None, None),)
KINDS: Parts = (
    ("order-1 specular", "specular", 1), ("order-1 body", "body", 1),
    ("specular", "specular", None), ("body", "body", None),
)  # fmt: skip
MODELS = {
    "roughplastic, nonlinear": Compared(
        "mitsuba:roughplastic,nonlinear=true", PLASTIC, 2.0, (*KINDS, *TOTAL)
    ),
    "roughplastic": Compared("mitsuba:roughplastic", PLASTIC, 2.0, (*KINDS, *TOTAL)),
    "plastic, nonlinear": Compared(
        "mitsuba:plastic,nonlinear=true", PLASTIC, 2.0, (*KINDS, *TOTAL)
    ),
    "principled": Compared("mitsuba:principled", PLASTIC, 2.0, TOTAL),
    "smith-walk, plastic": Compared(WALK, PLASTIC, 2.0, (*KINDS, *TOTAL)),
    "roughconductor, GGX": Compared("mitsuba:roughconductor", GOLD, 2.0, (KINDS[0], *TOTAL)),
    "roughconductor, Beckmann": Compared(
        "mitsuba:roughconductor", GOLD, BECKMANN, (KINDS[0], *TOTAL)
    ),
    "diffuse": Compared("mitsuba:diffuse", LAMBERTIAN, 2.0, TOTAL),
    "smith-walk, gold": Compared(WALK, GOLD, 2.0, (KINDS[0], *TOTAL)),
}


def scene_of(compared: Compared, alpha: float, thetas: tuple[float, ...] = THETAS) -> Scene:
    """Scene whose facets a model means at a roughness."""
    return Scene(
        material=compared.material,
        roughness=Roughness(compared.gamma, (alpha,)),
        surface=SURFACE,
        light=Light(thetas),
        accuracy=Accuracy(PATHS),
    )


def predictions(alphas: tuple[float, ...] = ALPHAS) -> dict[tuple[str, float], xr.Dataset]:
    """What all models send into the detector's bins, by name and α."""
    found = {}
    for (name, compared), alpha in product(MODELS.items(), alphas):
        scene = scene_of(compared, alpha)
        if compared.given == WALK:
            found[name, alpha] = model.walk(scene, WALK, walks=WALKS)
        else:
            brdf = model.load_user_brdf(compared.given)
            found[name, alpha] = model.predict_user_brdf(brdf, scene)
    return found


def as_read(row: Row) -> Row:
    """Give a row of the table, whose numbers are text, as `rows` gives it."""
    return {**row, **{name: float(row[name]) for name in NUMBERS}, "seed": int(row["seed"])}


def rows(predicted: dict[tuple[str, float], xr.Dataset], seed: int) -> list[Row]:
    """Compare all with surfaces of one seed."""
    traced: dict[tuple[Material, float, float], xr.Dataset] = {}
    table = []
    for (name, alpha), theory in predicted.items():
        compared = MODELS[name]
        key = compared.material, compared.gamma, alpha
        if key not in traced:
            traced[key] = measure(scene_of(compared, alpha), seed=seed)
        for part, kind, order in compared.parts:
            table += _compared(traced[key], theory, part, kind, order)
            for row in table[-len(THETAS) :]:
                row.update(bsdf=name, alpha=alpha, seed=seed)
    return table


def _compared(
    measured: xr.Dataset, theory: xr.Dataset, part: str, kind: str | None, order: int | None
) -> list[Row]:
    """One part at each incidence: model over traced − 1, with Student's interval of surfaces."""
    of = measured.microsurf.albedo(order, kind).mean("realisation").isel(phi_i=0).values
    error = measured.microsurf.standard_error(order, kind).isel(phi_i=0).values
    # All light of a BSDF stands under order 1.
    predicted = theory.microsurf.albedo(order, kind).isel(realisation=0, phi_i=0).values
    noise = theory.microsurf.ray_error(order, kind).isel(realisation=0, phi_i=0).values
    noise = intervals.normal() * noise / predicted
    if "relative_error" in theory:
        noise = theory.relative_error.isel(phi_i=0).max("part").values
    factor = intervals.over_values(measured.sizes["realisation"], intervals.CONFIDENCE)
    table = []
    for t, theta in enumerate(THETAS):
        effect = predicted[t] / of[t] - 1
        half = (1 + effect) * (factor * error[t] / of[t] + noise[t])
        low, high = effect - half, effect + half
        table.append(
            {
                "bsdf": "", "alpha": 0.0, "theta_i": theta, "part": part, "seed": 0,
                "traced": float(of[t]), "standard_error": float(error[t]),
                "predicted": float(predicted[t]), "effect": float(effect), "low": float(low),
                "high": float(high), "verdict": decide(low, high, MARGIN),
            }
        )  # fmt: skip
    return table
