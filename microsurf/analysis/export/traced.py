"""A traced result as a BRDF: light of all orders, as models times smoothed ratios.

Order 1 is Smith's specular and body term, each times traced over predicted light of the
detector's bins; all else, later orders and order 1 where the model predicts next to nothing, is
added: 1/π times its ratio. A ratio is one of two sums over all bins, weighted by a Gaussian in the
angle to the bin. Its width is the one of WIDTHS with the least estimated risk (Mallows' Cp, with
the covariance of a bin and its smoothed value between the realisations; of one realisation, from
the variance by its rays). Each part keeps the albedo that was traced at each incidence.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...errors import InputError
from ...model import direction, predict
from ...model.lookup.pair_table import PairTable
from ...physics import facet
from ...results import datasets, detector
from ...scene import Scene
from ...scene.layers import refuse
from ..fitted_theory import fitted_scene, prepare, turn_of
from .source import Source, TracedBins, channels_of, order_one

Array = NDArray[np.float64]

WIDTHS = (0.0, 2.0, 4.0, 8.0, 16.0, 32.0)
"""Of the Gaussian in degrees; 0 takes each bin as it is."""
_ABOUT = 8.0
"""One of them: of the light about a bin, by which its square weighs."""
_WIDEST_GAP, _LAST = 20.0, 75.0
_WIDEST_TURN = 46.0
_NOTHING = 1e-4
"""BRDF of a model over that of a white Lambertian of its albedo: below it light is added."""
_ALONG, _AROUND = 3, 12
"""Points of a bin in θ and φ: a lobe at 80° is a third of a bin wide in φ where σ = 0.15."""
_WANTED = "0,15,30,45,60,70,80"


@dataclass(frozen=True)
class _Part:
    """Light of one kind by realisation and incidence, its ray variance, and what is predicted.

    Shapes (realisation, theta_i, phi_i, rings, sectors); ``predicted`` without realisations.
    """

    energy: Array
    variance: Array
    predicted: Array


def of_result(path: Path, wavelengths: tuple[float, ...] = ()) -> Source:
    """Light of all orders of a traced result.

    Raises
    ------
    InputError
        If it has too few incidences for a BRDF, or light leaves in one direction.

    """
    result = datasets.load(path).sortby(["theta_i", "phi_i"])
    scene = result.microsurf.scene
    refuse(scene.layers, "export")
    if "light_rays" not in result:
        raise InputError(f"{path}: is predicted, not traced; give its scene")
    theory = _theory(scene, path)
    of_one = order_one(theory)  # refuses what no table holds
    _check_incidences(result, theory, path)
    channels = channels_of(path.name, len(scene.material.kd), wavelengths)
    isotropic = theory.roughness.isotropic
    parts = _parts(result, theory)
    tables, widths = [], []
    kernels = {width: _kernel(width) for width in WIDTHS}
    for part in parts:
        values, width = _ratio(part, kernels)
        tables.append(values)
        widths.append(width)
    table = _table(result, np.stack(tables, axis=-1), isotropic=isotropic)
    weights = facet.body_weight(scene.material.n, scene.material.kd)

    def models(i: Array, o: Array) -> Array:
        return np.stack([*of_one(i, o), *[np.full(len(i), 1 / np.pi)] * len(channels)], axis=1)

    table = _energy_kept(table, models, parts)

    def evaluate(i: Array, o: Array) -> Array:
        values = models(i, o) * table.at(i, o)
        return np.asarray(values[:, :1] + values[:, 1:2] * weights + values[:, 2:])

    named = ("specular", "body", *(f"added {name}" for name in channels))
    shown = ", ".join(f"{n} {w:g}°" for n, w in zip(named, widths, strict=True))
    notes = [f"all orders as traced; ratios are smoothed over: {shown}"]
    last = float(result.theta_i.max())
    notes.append(f"beyond θ_i = {last:g}° the ratios of {last:g}° are taken")
    return Source(
        path.name, evaluate, theory, channels, tuple(map(float, wavelengths)), tuple(notes),
        _bins(result, parts, np.asarray(weights)),
    )  # fmt: skip


def _theory(scene: Scene, path: Path) -> Scene:
    fit, _ = prepare(scene)
    if fit is None:
        return scene
    if turn_of(fit):
        raise InputError(
            f"{path}: the slopes of {scene.surface.file} have axes at {turn_of(fit):.1f}°, and "
            "tables want them along x and y; turn the heights"
        )
    return replace(fitted_scene(scene, fit), surface=Scene().surface)


def _check_incidences(result: xr.Dataset, theory: Scene, path: Path) -> None:
    theta, phi = np.sort(result.theta_i.values), np.sort(result.phi_i.values)
    enough = theta[0] == 0 and theta[-1] >= _LAST and np.diff(theta, prepend=0).max() <= _WIDEST_GAP
    words = f"--theta {_WANTED}"
    if not theory.roughness.isotropic:
        words += " --phi 0,30,60,90"
        enough &= bool(phi[0] == 0 and phi[-1] == 90 and np.diff(phi).max() <= _WIDEST_TURN)
    if not enough:
        shown = ", ".join(f"{t:g}" for t in theta), ", ".join(f"{p:g}" for p in phi)
        raise InputError(
            f"{path}: has θ_i = {shown[0]}° and φ_i = {shown[1]}°, too few for a BRDF of all "
            f"incidences; measure it again with `microsurf measure … {words} --out FILE.nc`"
        )


def _parts(result: xr.Dataset, theory: Scene) -> list[_Part]:
    """Specular and body light of order 1 at unit body weight, and the rest of each Kd."""
    light = replace(
        theory.light, theta=tuple(result.theta_i.values), phi=tuple(result.phi_i.values)
    )
    predicted = predict(replace(theory, light=light)).flux.values[0, :, :, 0]
    isotropic = theory.roughness.isotropic
    flux, material = result.flux, theory.material
    area = detector.projected_solid_angles()
    first = flux.sel(order=1).isel(body_events=slice(2)).values
    first = np.pad(first, [(0, 0)] * 3 + [(0, 2 - first.shape[3])] + [(0, 0)] * 2)
    later = flux.where(flux.order > 1, 0.0)
    paths = result.paths.values[..., None, None]
    parts, added = [], []
    for kind in range(2):
        model = predicted[:, :, kind]
        albedo = model.sum(axis=(-2, -1), keepdims=True)
        little = model / area < _NOTHING * albedo / np.pi
        energy = first[:, :, :, kind]
        variance = result.bin_variance.values[:, :, :, kind]
        added.append((np.where(little, energy, 0), np.where(little, variance, 0)))
        energy, variance, model = (np.where(little, 0, x) for x in (energy, variance, model))
        parts.append(_Part(energy, variance, model))
    for kd in material.kd:
        weight = float(facet.body_weight(material.n, kd))
        energy = datasets.by_kind(later, material.n, kd).sum(("kind", "order")).values
        squares = later * later.path_weight * datasets.bin_weights(later, material.n, kd) ** 2
        variance = squares.sum(("order", "body_events")).values / paths
        for kind, (light_added, of_rays) in enumerate(added):
            energy = energy + light_added * (weight if kind else 1)
            variance = variance + of_rays * (weight**2 if kind else 1)
        lambertian = np.broadcast_to(area / np.pi, predicted[:, :, 0].shape)
        parts.append(_Part(energy, variance, lambertian))
    return [_symmetric(part, isotropic=isotropic) for part in parts]


def _symmetric(part: _Part, *, isotropic: bool) -> _Part:
    """Mean over φ_i of isotropic surfaces, and of what a mirror makes the same."""
    if not isotropic:
        return part
    shape = part.energy.shape[2]
    energy, model = (x.mean(axis=-3, keepdims=True) for x in (part.energy, part.predicted))
    variance = part.variance.mean(axis=-3, keepdims=True) / shape
    return _Part((energy + _mirrored(energy)) / 2, variance, (model + _mirrored(model)) / 2)


def _mirrored(lobes: Array) -> Array:
    return np.roll(lobes[..., ::-1], 1, axis=-1)


def _kernel(width: float) -> Array:
    """Weights of all bins for each bin, shape (bins, bins)."""
    theta = np.radians(detector.ring_centres())
    phi = np.arange(detector.SECTORS) * 2 * np.pi / detector.SECTORS
    o = direction(theta[:, None], phi).reshape(-1, 3)
    if not width:
        return np.eye(len(o))
    away = np.degrees(np.arccos(np.clip(o @ o.T, -1, 1)))
    return np.asarray(np.exp(-((away / width) ** 2) / 2))


def _ratio(part: _Part, kernels: dict[float, Array]) -> tuple[Array, float]:
    """Smoothed traced over predicted light, shape (theta_i, phi_i, rings, sectors), and width."""
    count, *incidences = part.energy.shape[:3]
    energy = part.energy.reshape(count, *incidences, -1)
    model = part.predicted.reshape(*incidences, -1)
    mean = energy.mean(axis=0)
    whole = mean.sum(axis=-1, keepdims=True) / np.maximum(
        model.sum(axis=-1, keepdims=True), np.finfo(float).tiny
    )
    wide = kernels[_ABOUT]
    # Squares weigh by one over the light about the bin, as for counts.
    about = (mean @ wide) / wide.sum(axis=0)
    about = np.maximum(about, 1e-3 * mean.mean(axis=-1, keepdims=True))
    about = np.where(about > 0, about, 1.0)
    best, chosen, least = np.broadcast_to(whole, model.shape), np.inf, np.inf
    for width, kernel in kernels.items():
        below = model @ kernel
        known = below > 0
        divisor = np.where(known, below, 1.0)
        ratios = np.where(known, (energy @ kernel) / divisor, whole)
        ratio, smooth = ratios.mean(axis=0), ratios * model
        if count > 1:
            joint = (energy - mean) * (smooth - smooth.mean(axis=0))
            together = joint.sum(axis=0) / (count * (count - 1))
        else:
            # The kernel is 1 at the bin itself.
            together = part.variance.reshape(energy.shape)[0] * (model / divisor)
        risk = float((((mean - ratio * model) ** 2 + 2 * together) / about).sum())
        if risk < least:
            best, chosen, least = ratio, width, risk
    return np.asarray(best.reshape(part.predicted.shape)), chosen


def _table(result: xr.Dataset, values: Array, *, isotropic: bool) -> PairTable:
    """Ratios of shape (theta_i, phi_i, rings, sectors, parts) between incidences and bins."""
    values = values.copy()
    values[:, :, 0] = values[:, :, 0].mean(axis=2, keepdims=True)  # θ_o = 0 has no azimuth
    half = detector.SECTORS // 2 + 1
    around = values[..., :half, :] if isotropic else np.concatenate(
        [values, values[..., :1, :]], axis=-2
    )  # fmt: skip
    turn = np.arange(around.shape[-2]) * 2 * np.pi / detector.SECTORS
    theta, phi = (np.radians(result[name].values) for name in ("theta_i", "phi_i"))
    rings = np.radians(detector.ring_centres())
    return PairTable(theta, np.zeros(1) if isotropic else phi, rings, turn, around)


def _energy_kept(
    table: PairTable, models: Callable[[Array, Array], Array], parts: list[_Part]
) -> PairTable:
    """Scale each part of each incidence to its traced albedo, by quadrature over all bins."""
    values = table.values.copy()
    theta_o, turn = points_of_bins()
    area = np.broadcast_to(detector.projected_solid_angles()[..., None], theta_o.shape).ravel()
    for t, theta in enumerate(table.theta_i):
        for p, phi in enumerate(table.phi_i):
            o = direction(theta_o.ravel(), phi + turn.ravel())
            i = np.broadcast_to(direction(theta, phi), o.shape)
            unscaled = models(i, o)
            scaled = area @ (unscaled * table.at(i, o))
            albedo = area @ unscaled
            for k, part in enumerate(parts):
                model = part.predicted[t, p].sum()
                wanted = part.energy[:, t, p].mean(axis=0).sum()
                if scaled[k] > 0 and model > 0:
                    values[t, p, ..., k] *= wanted / model * albedo[k] / scaled[k]
    return replace(table, values=values)


def _bins(result: xr.Dataset, parts: list[_Part], weights: Array) -> TracedBins:
    """Traced light of all orders and its standard errors in the detector's bins."""
    specular, body, *added = parts
    by_surface = np.stack(
        [
            specular.energy + weight * body.energy + rest.energy
            for weight, rest in zip(weights, added, strict=True)
        ],
        axis=3,
    )
    count = len(by_surface)
    if count > 1:
        errors = by_surface.std(axis=0, ddof=1) / np.sqrt(count)
    else:
        variance = [
            specular.variance + weight**2 * body.variance + rest.variance
            for weight, rest in zip(weights, added, strict=True)
        ]
        errors = np.sqrt(np.stack(variance, axis=3)[0])
    azimuths = result.phi_i.values if errors.shape[1] > 1 else np.zeros(1)
    return TracedBins(result.theta_i.values, azimuths, by_surface.mean(axis=0), errors)


def points_of_bins() -> tuple[Array, Array]:
    """θ_o and φ_o − φ_i inside each bin, shape (rings, sectors, points), even in sin²θ and φ."""
    along, around = ((np.arange(n) + 0.5) / n for n in (_ALONG, _AROUND))
    rise = np.sin(np.radians(detector.RING_EDGES)) ** 2
    inside = rise[:-1, None] + np.diff(rise)[:, None] * along
    width = 2 * np.pi / detector.SECTORS
    phi = (np.arange(detector.SECTORS)[:, None] - 0.5 + around) * width
    theta = np.arcsin(np.sqrt(inside))
    shape = (detector.RINGS, detector.SECTORS, _ALONG, _AROUND)
    grid = np.broadcast_to(theta[:, None, :, None], shape), np.broadcast_to(phi[:, None], shape)
    return grid[0].reshape(*shape[:2], -1), grid[1].reshape(*shape[:2], -1)
