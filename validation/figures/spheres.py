"""Spheres of rough materials on a floor: the traced surface, the Smith walk, and their ratio.

`make gallery` writes spheres.png to reports/gallery. Each pixel sums the light of a round lamp,
sampled over its disc, and of a uniform sky. BRDFs are interpolated linearly between the
detector's bins, those of the walk between values at the middles of the same bins, so that the
interpolation is the same. One exposure and one tone curve hold for all. The floor is Lambertian
and takes the sphere's shadow; light that floor and sphere send to each other is left out.
"""

from dataclasses import dataclass, replace

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

from microsurf import measure, model
from microsurf.physics import metals
from microsurf.report.figures.style import own_style
from microsurf.results import datasets, detector
from microsurf.scene import Accuracy, Light, Material, Scene

from . import gallery, srgb

Array = NDArray[np.float64]

PIXELS = 300
EYE, TARGET, FIELD = np.array([0.0, -6.5, 2.2]), np.array([0.0, 0.0, 0.92]), 0.235
"""Where the eye is, where it looks, and the half width of the picture at unit distance."""
CENTRE = np.array([0.0, 0.0, 1.0])
LAMP, LAMP_RADIUS, LAMP_POINTS = np.array([4.6, -4.4, 4.4]), 0.7, 24
LAMP_IRRADIANCE, SKY, FLOOR = 3.0, 0.28, 0.35
"""Irradiance of a face that looks at the lamp, radiance of the sky, albedo of the floor."""
WHITE = 2.5
"""Radiance that is shown white."""
THETAS = tuple(float(t) for t in range(0, 88, 3))
WALKS = 1000
"""For each middle of a bin."""


@dataclass(frozen=True)
class View:
    """What pixels see: a mask of the sphere and its normals, and points of the floor."""

    rays: Array
    sphere: NDArray[np.bool_]
    normals: Array
    points: Array


def view() -> View:
    """Trace one ray for each pixel."""
    ahead = (TARGET - EYE) / np.linalg.norm(TARGET - EYE)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, ahead)
    line = FIELD * (2 * (np.arange(PIXELS) + 0.5) / PIXELS - 1)
    x, y = np.meshgrid(line, -line)
    rays = ahead + x[..., None] * right + y[..., None] * up
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    offset = EYE - CENTRE
    half = rays @ offset
    root = half**2 - offset @ offset + 1
    sphere = root > 0
    normals = offset + (-half - np.sqrt(np.maximum(root, 0)))[..., None] * rays
    points = EYE - rays * (EYE[2] / rays[..., 2:])
    return View(rays, sphere, normals, points)


def lamp_points() -> Array:
    """Points of the lamp's disc, evenly by a spiral, shape (LAMP_POINTS, 3)."""
    axis = (CENTRE - LAMP) / np.linalg.norm(CENTRE - LAMP)
    across = np.cross(axis, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    k = np.arange(LAMP_POINTS) + 0.5
    radius, turn = LAMP_RADIUS * np.sqrt(k / LAMP_POINTS), k * np.pi * (3 - np.sqrt(5))
    return np.asarray(
        LAMP
        + (radius * np.cos(turn))[:, None] * across
        + (radius * np.sin(turn))[:, None] * np.cross(axis, across)
    )


class Table:
    """A BRDF over θ_i, θ_o and azimuth, and its albedo over θ_i.

    Parameters
    ----------
    density : ndarray, shape (θ_i, θ_o, φ_o), 1/sr
        At THETAS, the middles of rings, and azimuths from 0 to 180° in steps of 10°.

    """

    def __init__(self, density: Array) -> None:
        rings = detector.ring_centres()
        azimuths = np.linspace(0, 180, detector.SECTORS // 2 + 1)
        self._value = RegularGridInterpolator(
            (THETAS, rings, azimuths), density, bounds_error=False, fill_value=None
        )
        # The first and the last azimuth are one sector each, the others two.
        sectors = np.full(azimuths.size, 2.0)
        sectors[[0, -1]] = 1.0
        self._albedo = np.einsum(
            "tra,r,a->t", density, detector.projected_solid_angles()[:, 0], sectors
        )

    def value(self, i: Array, o: Array, normal: Array) -> Array:
        """BRDF for directions about normals, shapes (pixels, 3); 0 where one is below."""
        cos_i, cos_o = np.sum(i * normal, axis=1), np.sum(o * normal, axis=1)
        flat_i, flat_o = i - cos_i[:, None] * normal, o - cos_o[:, None] * normal
        length = np.linalg.norm(flat_i, axis=1) * np.linalg.norm(flat_o, axis=1)
        turn = np.sum(flat_i * flat_o, axis=1) / np.maximum(length, 1e-12)
        at = [_degrees(w) for w in (cos_i, cos_o, turn)]
        at[0], at[1] = np.minimum(at[0], THETAS[-1]), np.minimum(at[1], 89.5)
        up = (cos_i > 0) & (cos_o > 0)
        return np.where(up, np.maximum(self._value(np.stack(at, axis=1)), 0), 0.0)

    def albedo(self, cosine: Array) -> Array:
        """Directional albedo."""
        return np.asarray(np.interp(_degrees(cosine), THETAS, self._albedo))


def _degrees(cosine: Array) -> Array:
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def traced_table(scene: Scene) -> Table:
    """Trace the surfaces at all incidences, all orders."""
    scene = replace(scene, light=Light(THETAS), accuracy=Accuracy(300_000))
    material = scene.material
    flux = measure(scene, progress=True).flux.mean("realisation").isel(phi_i=0)
    density = datasets.brdf(datasets.by_kind(flux, material.n, material.kd[0]))
    values = density.sum(("order", "kind")).transpose("theta_i", "theta_o", "phi_o").values
    # Azimuths to the left and to the right are one; at 0° and in the cap there is none.
    half = detector.SECTORS // 2
    folded = (values[..., : half + 1] + np.roll(values[..., ::-1], 1, axis=-1)[..., : half + 1]) / 2
    folded[0] = values[0].mean(axis=-1)[:, None]
    folded[:, 0] = values[:, 0].mean(axis=-1)[:, None]
    return Table(folded)


def walk_table(scene: Scene) -> Table:
    """The Smith walk at the middles of the bins."""
    theta_i, theta_o, turn = np.meshgrid(
        np.radians(THETAS), np.radians(detector.ring_centres()),
        np.radians(np.linspace(0, 180, detector.SECTORS // 2 + 1)), indexing="ij",
    )  # fmt: skip
    i = model.direction(theta_i.ravel(), np.zeros(theta_i.size))
    o = model.direction(theta_o.ravel(), turn.ravel())
    brdf = model.Brdf(scene, "smith-walk", WALKS)
    values = sum(brdf.evaluate(i, o, np.random.default_rng(1)))
    return Table(np.reshape(values, theta_i.shape))


def render(table: Table, seen: View) -> Array:
    """Radiance of each pixel, shape (PIXELS, PIXELS)."""
    lamps = lamp_points()
    normal, towards_eye = seen.normals[seen.sphere], -seen.rays[seen.sphere]
    points = normal + CENTRE
    distance2 = np.sum((LAMP - CENTRE) ** 2)
    on_sphere = SKY * table.albedo(np.sum(towards_eye * normal, axis=1))
    on_floor = FLOOR * SKY * (1 - _hidden_sky(seen.points))
    for lamp in lamps:
        i = lamp - points
        fall = distance2 / np.sum(i**2, axis=1)
        i /= np.linalg.norm(i, axis=1, keepdims=True)
        power = LAMP_IRRADIANCE / len(lamps) * fall * np.maximum(np.sum(i * normal, axis=1), 0)
        on_sphere += power * table.value(i, towards_eye, normal)
        i = lamp - seen.points
        fall = distance2 / np.sum(i**2, axis=-1)
        i /= np.linalg.norm(i, axis=-1, keepdims=True)
        free = ~_meets_sphere(seen.points, i)
        on_floor += FLOOR / np.pi * LAMP_IRRADIANCE / len(lamps) * fall * i[..., 2] * free
    on_floor[seen.sphere] = on_sphere
    return on_floor


def displayed(radiance: Array) -> Array:
    """Grey of each pixel in 0 … 1: Reinhard's curve (SIGGRAPH 2002) to WHITE, then sRGB."""
    curve = radiance * (1 + radiance / WHITE**2) / (1 + radiance)
    return srgb.encode(curve)


def _hidden_sky(points: Array) -> Array:
    """Part of a uniform sky that the sphere hides from points of the floor."""
    away = CENTRE - points
    squared = np.sum(away**2, axis=-1)
    return np.asarray(away[..., 2] / np.sqrt(squared) / squared)


def _meets_sphere(points: Array, direction: Array) -> NDArray[np.bool_]:
    offset = points - CENTRE
    half = np.sum(offset * direction, axis=-1)
    return np.asarray((half < 0) & (half**2 - np.sum(offset**2, axis=-1) + 1 > 0))


@own_style()
def main() -> None:
    """Render all and write the picture."""
    gold = metals.GOLD[1]
    cases = {
        "rough Lambertian\nn = 1, Kd = 0.8, γ = 8, σ = 0.7": gallery.scene(8.0, 0.7, 1.0),
        "IL, GGX\nn = 1.5, Kd = 0.8, γ = 2, σ = 0.3": gallery.scene(2.0, 0.3, 1.5),
        f"gold at {gold.wavelength:g} nm\nγ = 2, σ = 0.4": replace(
            gallery.scene(2.0, 0.4, 1.0), material=Material(gold.n, k=gold.k)
        ),
    }
    seen = view()
    figure = Figure(figsize=(8.6, 8.4), layout="constrained")
    panels = figure.subplots(3, 3)
    for row, (name, scene) in zip(panels, cases.items(), strict=True):
        traced, walked = (render(make(scene), seen) for make in (traced_table, walk_table))
        for axes, values, title in (
            (row[0], traced, "traced surfaces, all orders"),
            (row[1], walked, "Smith walk, all orders"),
        ):
            axes.imshow(displayed(values), cmap="gray", vmin=0, vmax=1)
            axes.set_title(title, fontsize=9)
        off = np.where(seen.sphere, 100 * (traced / walked - 1), np.nan)
        shown = row[2].imshow(off, cmap="PuOr_r", vmin=-10, vmax=10)
        row[2].set_title("traced / walk − 1", fontsize=9)
        figure.colorbar(shown, ax=row[2], label="%", extend="both", shrink=0.8)
        row[0].set_ylabel(name, fontsize=9)
        for axes in row:
            axes.set(xticks=[], yticks=[])
    gallery.save(figure, "spheres")


if __name__ == "__main__":
    main()
