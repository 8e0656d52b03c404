"""What is exported: a BRDF as a function of directions, and what the formats need beside it."""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...files import check_readable
from ...model.lookup.body_ratio import tabulated_body
from ...model.single_scattering import flat
from ...model.single_scattering.brdf import specular
from ...model.single_scattering.facets import Facets
from ...physics import facet
from ...scene import Material, Roughness, Scene
from ...scene.layers import refuse

Array = NDArray[np.float64]

_MOST_TEXT = 10_000_000
_GREY = ("grey",)
_COLOUR = ("R", "G", "B")


@dataclass(frozen=True)
class TracedBins:
    """What a trace holds of a material.

    Attributes
    ----------
    theta_i, phi_i : array
        Incidences in degrees.
    energy, error : array, shape (theta_i, phi_i, channels, rings, sectors)
        Part of the incident power in each bin of the detector, and its standard error.

    """

    theta_i: Array
    phi_i: Array
    energy: Array
    error: Array


@dataclass(frozen=True)
class Source:
    """A BRDF to be written.

    Attributes
    ----------
    name : str
        What it was read from.
    evaluate : callable
        ``evaluate(i, o)``, unit directions of shape (pairs, 3) with z > 0: BRDF in sr⁻¹,
        cosine not included, shape (pairs, channels).
    scene : Scene
        Its roughness is that of the lobes, for grids that follow them; and its light.
    channels : tuple of str
        "grey", or R, G and B, or one for each wavelength.
    wavelengths : tuple of float
        In nm and ascending; empty if there are none.
    notes : tuple of str
        What whoever uses it should know.
    traced : TracedBins or None
        What it was traced as, if it was.

    """

    name: str
    evaluate: Callable[[Array, Array], Array]
    scene: Scene
    channels: tuple[str, ...]
    wavelengths: tuple[float, ...] = ()
    notes: tuple[str, ...] = ()
    traced: TracedBins | None = None

    def in_colour(self, i: Array, o: Array) -> Array:
        """Values of shape (pairs, 3) for formats that hold red, green and blue.

        Raises
        ------
        InputError
            If the channels are neither grey nor these three.

        """
        values = self.evaluate(i, o)
        if self.channels == _GREY:
            return np.repeat(values, 3, axis=1)
        if self.channels != _COLOUR:
            raise InputError(
                f"{self.name}: {len(self.channels)} wavelengths, and the format holds red, green "
                "and blue; give a scene of three Kd, or write .bsdf or .csv"
            )
        return values


def of_scene(scene: Scene, name: str, wavelengths: Sequence[float] = ()) -> Source:
    """Order 1 of a scene by Smith's height-correlated masking; the body term by its table.

    Raises
    ------
    InputError
        If its light leaves in one direction, or no format has so many channels.

    """
    channels = channels_of(name, len(scene.material.kd), wavelengths)
    of_one = order_one(scene)
    weights = facet.body_weight(scene.material.n, scene.material.kd)

    def evaluate(i: Array, o: Array) -> Array:
        mirrored, body = of_one(i, o)
        return np.asarray(mirrored[:, None] + body[:, None] * weights)

    return Source(name, evaluate, scene, channels, tuple(map(float, wavelengths)))


def order_one(scene: Scene) -> Callable[[Array, Array], tuple[Array, Array]]:
    """f_specular and f_body at unit body weight as a function of directions."""
    refuse(scene.layers, "export")
    needs, material, rough = scene.requires, scene.material, scene.roughness
    if scene.surface.file is not None:
        raise InputError(
            f"surface.file = {scene.surface.file!r}: a scene of a measured surface states no "
            "slopes; give `microsurf measure --out FILE.nc` of it, or the scene of its fit"
        )
    if not needs.roughness:
        if needs.interface:
            raise InputError(
                "roughness.sigma = 0: a flat interface mirrors into one direction, which no table "
                "holds; take your renderer's smooth material, or σ > 0"
            )
        return lambda i, o: (np.zeros(len(i)), flat.body(i[:, 2], o[:, 2], material.n))
    facets = Facets(material.n, rough.gamma, rough.sigma_x, rough.sigma_y, k=material.k)
    body = tabulated_body(facets) if needs.substrate else None

    def evaluate(i: Array, o: Array) -> tuple[Array, Array]:
        mirrored = specular(facets, i, o) if needs.interface else np.zeros(len(i))
        return mirrored, np.zeros(len(i)) if body is None else body.evaluate(i, o)

    return evaluate


def channels_of(name: str, count: int, wavelengths: Sequence[float]) -> tuple[str, ...]:
    """Names of so many channels.

    Raises
    ------
    InputError
        If their number is not that of the wavelengths, or not 1 or 3 without any.

    """
    if wavelengths:
        rising = all(a < b for a, b in pairwise(wavelengths))
        if len(wavelengths) != count or not rising or not wavelengths[0] > 0:
            raise InputError(
                f"--wavelengths {', '.join(f'{w:g}' for w in wavelengths)}: must be "
                f"{count} ascending numbers in nm, one for each Kd of {name}"
            )
        return tuple(f"{w:g} nm" for w in wavelengths)
    if count not in (1, 3):
        raise InputError(
            f"{name}: {count} Kd; must be 1 (grey), 3 (red, green, blue), or give --wavelengths"
        )
    return _GREY if count == 1 else _COLOUR


def of_fit(path: Path) -> Source:
    """Order 1 of a fitted BRDF: what ``microsurf fit FILE --json`` printed.

    Raises
    ------
    InputError
        If it is none, or a fit that no material follows from.

    """
    values = _fit(path)
    sigma = values["sigma"]
    rough = Roughness(values["gamma"], tuple(sigma) if isinstance(sigma, list) else (sigma,))
    wavelengths = tuple(values["wavelengths"])
    notes = []
    if values["verdict"] != "fits":
        notes.append(f"the fit says: {values['verdict']}, {values['reason']}")
    if values.get("orders") != "1":
        notes.append("parameters are of a fit of all orders; order 1 alone is written")
    if "azimuth" in values:
        notes.append(f"x is the axis of σ_x, at azimuth {values['azimuth']:.4g}° of the data")
    if values["material"] == "conductor":
        parts = [
            of_scene(Scene(material=Material(n, (), k), roughness=rough), path.name)
            for n, k in zip(values["n"], values["k"], strict=True)
        ]
        channels = channels_of(path.name, len(parts), wavelengths)

        def evaluate(i: Array, o: Array) -> Array:
            return np.concatenate([part.evaluate(i, o) for part in parts], axis=1)

        return Source(path.name, evaluate, parts[0].scene, channels, wavelengths, tuple(notes))
    material = Material(values["n"], tuple(values["kd"]))
    source = of_scene(Scene(material=material, roughness=rough), path.name, wavelengths)
    return replace(source, notes=tuple(notes))


def _fit(path: Path) -> dict[str, Any]:
    check_readable(path, "give what `microsurf fit FILE --json` printed")
    wrong = f"{path}: not what `microsurf fit FILE --json` prints of a measured BRDF"
    if path.stat().st_size > _MOST_TEXT:
        raise InputError(wrong)
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise InputError(f"{wrong} ({error})") from error
    needed = {"kind", "material", "gamma", "sigma", "n", "wavelengths", "verdict", "reason"}
    if not isinstance(values, dict) or not needed <= values.keys() or values["kind"] != "brdf":
        raise InputError(wrong)
    if values["gamma"] is None:
        raise InputError(f"{path}: {values['reason']}; no material follows from it")
    if values["material"] == "lambertian+conductor":
        raise InputError(
            f"{path}: material {values['material']}: is not exported; fit interfaced-lambertian "
            "or conductor"
        )
    return values
