"""A user BRDF in the model's place: what `microsurf validate --model` does after a scene."""

from dataclasses import replace

import xarray as xr

from .. import model
from ..results import datasets
from ..results.albedos import QUANTITIES
from ..scene import Scene
from . import comparison, user_brdf
from .comparison import Comparison
from .user_brdf import Lobe, Lobes, UserBrdfResult
from .validation import Validation

_STRAY = 1e-6
"""Albedo below which a part that the scene does not have is rounding."""
_QUANTITIES = {
    "1": ("specular", "body"),
    "1 and all": ("specular", "body", "total"),
    "all": ("total",),
}
"""What a user BRDF is held against, by the orders that it holds."""

Key = tuple[str, float, float, float]


def judge(entry: Validation, brdf: model.UserBrdf, broken: list[str]) -> Validation:
    """Compare a user BRDF with the measurement in the theory's place, and with the theory.

    Parameters
    ----------
    entry : Validation
        Of the scene, with the theory's own comparisons.
    brdf : UserBrdf
        For each Kd of the scene it is asked on its own.
    broken : list of str
        What `model.examine` found.

    Returns
    -------
    Validation
        ``comparisons`` are the user BRDF's; ``user_brdf`` holds it against the theory;
        ``faults`` tells also of energy that is not there, parts the scene does not
        have, and lobes farther from the measured ones than the theory's.

    """
    theory = {_key(row): row for row in entry.comparisons}
    broken = list(broken)
    rows: list[Comparison] = []
    lobes: list[Lobe] = []
    by_kd: dict[float, xr.Dataset] = {}
    for kd in entry.scene.material.kd:
        scene = replace(entry.scene, material=replace(entry.scene.material, kd=(kd,)))
        predicted = by_kd[kd] = model.predict_user_brdf(brdf, scene)
        names = _QUANTITIES[predicted.attrs["orders"]]
        compared = [
            user_brdf.widened(row, _error(predicted, row))
            for row in comparison.compare(entry.measured, predicted, scene, predicted)
            if row.quantity in names
        ]
        broken += _energy(predicted, scene)
        wanted = [key for key in theory if key[0] in names and key[3] == kd]
        broken += _missing(wanted, [_key(row) for row in compared])
        rows += [
            user_brdf.expected_of(row, theory[_key(row)]) for row in compared if _key(row) in theory
        ]
        for name in dict.fromkeys(key[0] for key in wanted):
            three = Lobes(entry.measured, theory_of(entry, name), predicted)
            margin = next(row.margin for row in theory.values() if row.quantity == name)
            lobes += user_brdf.lobes(three, scene, name, margin)
    return replace(
        entry,
        comparisons=comparison.ComparisonTable(rows),
        notes=entry.notes + brdf.remarks(entry.scene),
        faults=broken + [_astray(lobe) for lobe in lobes if lobe.to_measured > lobe.allowed],
        user_brdf=UserBrdfResult(
            brdf.name,
            next(iter(by_kd.values())).attrs["orders"],
            [user_brdf.beside_theory(row, theory[_key(row)]) for row in rows],
            lobes,
            by_kd,
        ),
    )


def theory_of(entry: Validation, name: str) -> xr.Dataset:
    """Prediction that a quantity of the scene is held against."""
    predicted = list(entry.predicted.values())
    of_all_orders = (result for result in predicted if result.sizes["order"] > 1)
    return next(of_all_orders, predicted[0]) if name == "total" else predicted[0]


def _key(row: Comparison) -> Key:
    return row.quantity, row.theta_i, row.phi_i, row.kd


def _error(predicted: xr.Dataset, row: Comparison) -> float:
    of_parts = predicted.relative_error.sel(theta_i=row.theta_i, phi_i=row.phi_i)
    # A sum is relatively no worse than the worst of its parts.
    return float(of_parts.max() if row.quantity == "total" else of_parts.sel(part=row.quantity))


def _place(key: Key) -> str:
    return f"{QUANTITIES[key[0]]} at θ_i = {key[1]:g}, φ_i = {key[2]:g}, Kd = {key[3]:g}"


def _energy(predicted: xr.Dataset, scene: Scene) -> list[str]:
    """No more light than came, and none out of a substrate or interface that is not there."""
    (kd,) = scene.material.kd
    by_kind = datasets.by_kind(datasets.hemispherical(predicted.flux), scene.material.n, kd)
    albedo = by_kind.isel(realisation=0, order=0, drop=True)
    stray = {"body": float(predicted.attrs["stray_body"]), "specular": 0.0}
    if predicted.attrs["orders"] != "all" and not scene.requires.interface:
        stray["specular"] = float(albedo.sel(kind="specular").max())
    faults = [
        f"user BRDF: a {kind} part of albedo {value:.3g} at n = {scene.material.n:g}, "
        f"Kd = {kd:g}, where there is none"
        for kind, value in stray.items()
        if value > _STRAY
    ]
    total = albedo.sum("kind")
    # Each part may be off by its own error at the most.
    surplus = total * (1 - predicted.relative_error.max("part")) - 1
    if surplus.max() > _STRAY:
        worst = total.isel(surplus.argmax(["theta_i", "phi_i"]))
        faults.append(
            f"user BRDF: energy: albedo {float(worst):.5g} at θ_i = {float(worst.theta_i):g}, "
            f"φ_i = {float(worst.phi_i):g}, Kd = {kd:g}, must be ≤ 1"
        )
    return faults


def _missing(wanted: list[Key], present: list[Key]) -> list[str]:
    return [f"user BRDF: no {_place(key)}" for key in wanted if key not in present]


def _astray(lobe: Lobe) -> str:
    key = lobe.quantity, lobe.theta_i, lobe.phi_i, lobe.kd
    return (
        f"user BRDF: lobe of {_place(key)} lies {lobe.to_measured:.1%} from the measured one, "
        f"the theory {lobe.theory_to_measured:.1%}, {lobe.allowed:.1%} allowed; farthest from the "
        f"theory at θ_o = {lobe.theta_o:g}, φ_o − φ_i = {lobe.phi_o:g}: {lobe.user_brdf:.4g} "
        f"sr⁻¹ instead of {lobe.theory:.4g}"
    )
