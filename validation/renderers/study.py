"""BSDFs of Mitsuba against light traced on explicit surfaces, by order and kind.

Each plug-in is given what it has a parameter for: int_ior, reflectance, α = σ of GGX (γ = 2) or
Beckmann (γ → ∞). A renderer adds nothing to its BSDF, so that the sum stands for all orders;
its components stand beside order 1 and beside all orders of their kind.
"""

from dataclasses import dataclass, replace
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
SURFACE = Surface(cells=256, realisations=4)
PATHS = 40_000

PLASTIC = Material(1.5, (0.8,))
LAMBERTIAN = Material(1.0, (0.8,))
GOLD = Material(0.21, (), 3.27)
"""At 600 nm."""

Row = dict[str, Any]
Parts = tuple[tuple[str, str | None, int | None], ...]


@dataclass(frozen=True)
class Plugin:
    """One BSDF of Mitsuba on the facets that it means.

    ``given`` is what stands behind ``--model mitsuba:``; ``parts`` of its light, which
    may be compared: name, kind and order of the traced light (None: of all).
    """

    given: str
    material: Material
    gamma: float
    parts: Parts


TOTAL: Parts = (("total", None, None),)
KINDS: Parts = (
    ("order-1 specular", "specular", 1), ("order-1 body", "body", 1),
    ("specular", "specular", None), ("body", "body", None),
)  # fmt: skip
PLUGINS = {
    "roughplastic, nonlinear": Plugin(
        "roughplastic,nonlinear=true", PLASTIC, 2.0, (*KINDS, *TOTAL)
    ),
    "roughplastic": Plugin("roughplastic", PLASTIC, 2.0, (*KINDS, *TOTAL)),
    "plastic, nonlinear": Plugin("plastic,nonlinear=true", PLASTIC, 2.0, (*KINDS, *TOTAL)),
    "principled": Plugin("principled", PLASTIC, 2.0, TOTAL),
    "roughconductor, GGX": Plugin("roughconductor", GOLD, 2.0, (KINDS[0], *TOTAL)),
    "roughconductor, Beckmann": Plugin("roughconductor", GOLD, BECKMANN, (KINDS[0], *TOTAL)),
    "diffuse": Plugin("diffuse", LAMBERTIAN, 2.0, TOTAL),
}


def scene_of(plugin: Plugin, alpha: float, thetas: tuple[float, ...] = THETAS) -> Scene:
    """Scene whose facets a plug-in means at a roughness."""
    return Scene(
        material=plugin.material,
        roughness=Roughness(plugin.gamma, (alpha,)),
        surface=SURFACE,
        light=Light(thetas),
        accuracy=Accuracy(PATHS),
    )


def predictions(alphas: tuple[float, ...] = ALPHAS) -> dict[tuple[str, float], xr.Dataset]:
    """What Mitsuba's BSDFs send into the detector's bins, by plug-in and α."""
    found = {}
    for name, plugin in PLUGINS.items():
        brdf = model.load_user_brdf(f"mitsuba:{plugin.given}")
        for alpha in alphas:
            found[name, alpha] = model.predict_user_brdf(brdf, scene_of(plugin, alpha))
    return found


def rows(
    predicted: dict[tuple[str, float], xr.Dataset], seed: int, scale: float = 1.0
) -> list[Row]:
    """Compare all with surfaces of one seed; ``scale`` times the paths."""
    traced: dict[tuple[Material, float, float], xr.Dataset] = {}
    table = []
    for (name, alpha), theory in predicted.items():
        plugin = PLUGINS[name]
        scene = scene_of(plugin, alpha)
        scene = replace(scene, accuracy=Accuracy(int(scale * PATHS)))
        key = plugin.material, plugin.gamma, alpha
        if key not in traced:
            traced[key] = measure(scene, seed=seed)
        for part, kind, order in plugin.parts:
            table += _compared(traced[key], theory, part, kind, order)
            for row in table[-len(THETAS) :]:
                row.update(bsdf=name, alpha=alpha, seed=seed)
    return table


def _compared(
    measured: xr.Dataset, theory: xr.Dataset, part: str, kind: str | None, order: int | None
) -> list[Row]:
    """One part at each incidence: Mitsuba over traced − 1, with Student's interval of surfaces."""
    of = measured.microsurf.albedo(order, kind).mean("realisation").isel(phi_i=0).values
    error = measured.microsurf.standard_error(order, kind).isel(phi_i=0).values
    mitsuba = theory.microsurf.albedo(None, kind).isel(realisation=0, phi_i=0).values
    bound = theory.relative_error.isel(phi_i=0).max("part").values
    factor = intervals.over_values(measured.sizes["realisation"], intervals.CONFIDENCE)
    table = []
    for t, theta in enumerate(THETAS):
        effect = mitsuba[t] / of[t] - 1
        half = (1 + effect) * (factor * error[t] / of[t] + bound[t])
        low, high = effect - half, effect + half
        table.append(
            {
                "bsdf": "", "alpha": 0.0, "theta_i": theta, "part": part, "seed": 0,
                "traced": float(of[t]), "standard_error": float(error[t]),
                "mitsuba": float(mitsuba[t]), "effect": float(effect), "low": float(low),
                "high": float(high), "verdict": decide(low, high, MARGIN),
            }
        )  # fmt: skip
    return table
