"""Two surfaces over each other: the interface a scene has, and the substrate under it.

A substrate with a roughness of its own is made as the interface is (`synthesis`), from white
noise that has the correlation ρ with the interface's: w₂ = ρ w₁ + √(1 − ρ²) w. The Gaussian
fields then have that correlation at each point, and are what a copula joins: each surface
gets its own slopes, so that the correlation of heights and of slopes comes out a little less.
At ρ = 1 and the same roughness both are the same surface, to the bit; with another γ or σ
they are the same relief with its slopes redistributed; ρ = −1 turns the relief upside down.
"""

import hashlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import seeds
from ..errors import InputError
from ..files import read_once
from ..scene import Scene, Substrate
from .detrend import level
from .heightfield import Heightfield, Mesh, mesh
from .realisations import read_asked, realisation_seed, surface_of
from .synthesis import heights_of

Array = NDArray[np.float64]

_MOST_BYTES = 2**34

ROUNDING = 1e-12
"""Least distance of the surfaces, of their range of heights: less is rounding."""


@dataclass(frozen=True, eq=False)
class LayeredMesh:
    """One period of both surfaces in cells; the interface's mean plane is z = 0.

    Parameters
    ----------
    interface, substrate : Mesh
        Of the same shape; the substrate's heights lie ``gap`` lower than their own mean plane.
    gap : float
        Distance of the mean planes, which is the mean thickness, too.

    """

    interface: Mesh
    substrate: Mesh
    gap: float

    @property
    def least_distance(self) -> float:
        """Least vertical distance of both surfaces in cells.

        The distance is linear between the vertices and the crossing of each cell's diagonals.
        """
        vertices = self.interface.heights - self.substrate.heights
        return float(
            min(vertices.min(), (_centres(self.interface) - _centres(self.substrate)).min())
        )

    def report(self) -> dict[str, float]:
        """Gap, least distance, and the correlations of heights and of slopes that came out."""
        above, below = self.interface.heights, self.substrate.heights
        slopes = [
            np.concatenate([(np.roll(h, -1, axis) - h).ravel() for axis in (0, 1)])
            for h in (above, below)
        ]
        return {
            "gap": self.gap,
            "least_distance": self.least_distance,
            "mean_thickness": float((above - below).mean()),
            "height_correlation": _correlation(above.ravel(), below.ravel()),
            "slope_correlation": _correlation(*slopes),
        }


def _centres(m: Mesh) -> Array:
    """Heights at the middle of each cell, on its diagonal."""
    right, down = np.roll(m.heights, -1, 1), np.roll(m.heights, -1, 0)
    return np.where(m.flipped, right + down, m.heights + np.roll(down, -1, 1)) / 2


def _correlation(a: Array, b: Array) -> float:
    """Pearson's; 0 if one does not vary."""
    if np.ptp(a) == 0 or np.ptp(b) == 0:
        return 0.0
    return float(np.clip(np.corrcoef(a, b)[0, 1], -1, 1))


def layered_mesh(
    scene: Scene, seed: int, realisation: int, interface: Heightfield | None = None
) -> LayeredMesh:
    """Make both surfaces of one realisation; the interface may be given.

    Raises
    ------
    InputError
        If a surface can't be made or read, the substrate has another shape than the interface,
        or they cross.

    """
    if scene.layers is None:
        raise InputError("the scene has no [layers]: it is one surface")
    if interface is None:
        interface = surface_of(scene, seed, realisation)
    above = mesh(interface)
    below = _substrate(scene, scene.layers.substrate, interface, above, seed, realisation)
    gap = scene.layers.gap
    pair = LayeredMesh(above, Mesh(below.heights - gap, below.flipped, below.aspect), gap)
    _check_apart(pair, realisation)
    return pair


def flat_layers(cells: int, gap: float) -> LayeredMesh:
    """Two planes, ``gap`` cells apart."""
    straight = np.zeros((cells, cells), np.bool_)
    interface = Mesh(np.zeros((cells, cells)), straight)
    return LayeredMesh(interface, Mesh(interface.heights - gap, straight), gap)


def substrate_digest(scene: Scene) -> str | None:
    """Digest of the file that a scene's substrate is read from; None if it is made.

    Raises InputError if it can't be read.
    """
    if scene.layers is None or scene.layers.substrate.file is None:
        return None
    content = read_once(
        Path(scene.layers.substrate.file), "give the heights of the substrate", _MOST_BYTES
    )
    return hashlib.sha256(content).hexdigest()


def _check_apart(pair: LayeredMesh, realisation: int) -> None:
    least = pair.least_distance
    spread = max(np.ptp(pair.interface.heights), np.ptp(pair.substrate.heights))
    if least <= ROUNDING * spread:
        needed = pair.gap - least
        raise InputError(
            f"layers.gap = {pair.gap:g}: the surfaces of realisation {realisation} cross, by "
            f"{-least:.3g} cells; must be > {needed:.4g} here. Raise it, lower a sigma, or "
            'give the substrate shape = "same"'
        )


def _substrate(
    scene: Scene,
    lower: Substrate,
    interface: Heightfield,
    above: Mesh,
    seed: int,
    realisation: int,
) -> Mesh:
    """The substrate about its own mean plane, in cells."""
    shape = above.heights.shape
    if lower.shape == "flat" or (lower.sigma is not None and lower.sigma[0] == 0):
        return Mesh(np.zeros(shape), above.flipped, above.aspect)
    if lower.shape == "same":
        of_interface = scene.roughness.sigma_x
        factor = 1.0 if lower.sigma is None else _ratio(lower.sigma[0], of_interface)
        return Mesh(factor * above.heights, above.flipped, above.aspect)
    if lower.file is not None:
        return _read(scene, lower.file, shape, interface.pixel)
    if above.aspect != 1:
        dx, dy = interface.pixel
        raise InputError(
            f"layers.substrate.gamma with an interface of {dx:g} × {dy:g} pixels: generated cells "
            'are square; give the substrate a shape ("same" or "flat") or a file'
        )
    heights = _made(scene, lower, interface, shape, realisation_seed(seed, realisation))
    return Mesh(heights - heights.mean(), np.zeros(shape, np.bool_))


def _ratio(sigma: float, of_interface: float) -> float:
    if of_interface == 0:
        raise InputError(
            f'layers.substrate.sigma = {sigma:g} with shape = "same": the interface is flat, '
            "and so is the same scaled; give gamma and sigma instead"
        )
    return sigma / of_interface


def _read(scene: Scene, file: str, shape: tuple[int, ...], pixel: tuple[float, float]) -> Mesh:
    lower = replace(scene.surface, file=file)
    surface = level(read_asked(lower), lower.level)
    if not np.allclose(surface.pixel, pixel, rtol=1e-6, atol=0):
        raise InputError(
            f"layers.substrate.file = {file}: its pixel is {surface.pixel[0]:g} × "
            f"{surface.pixel[1]:g}, the interface's {pixel[0]:g} × {pixel[1]:g}; must be the same. "
            "Give surface.spacing, in the file's unit"
        )
    lower_mesh = mesh(surface)
    if lower_mesh.heights.shape != shape:
        rows, columns = lower_mesh.heights.shape
        raise InputError(
            f"layers.substrate.file = {file}: a period of {rows} × {columns} cells; must be that "
            f"of the interface, {shape[0]} × {shape[1]}. Crop or resample one of both"
        )
    return lower_mesh


def _made(
    scene: Scene,
    lower: Substrate,
    interface: Heightfield,
    shape: tuple[int, ...],
    substrate_seed: int,
) -> Array:
    """Heights of a substrate with a roughness of its own."""
    recipe: dict[str, Any] = dict(interface.recipe)
    correlation = lower.correlation_with_interface
    substrate_seed = int(recipe.get("seed", substrate_seed))
    white = seeds.generator(substrate_seed, seeds.SUBSTRATES).standard_normal(shape)
    if correlation != 0:
        if "seed" not in recipe or recipe.get("finer", 1) != 1:
            raise InputError(
                f"layers.substrate.correlation_with_interface = {correlation:g}: the interface "
                'was not generated by this scene; give 0, or shape = "same"'
            )
        of_interface = np.random.default_rng(substrate_seed).standard_normal(shape)
        white = correlation * of_interface + np.sqrt((1 - correlation) * (1 + correlation)) * white
    sigma = lower.sigma or (0.0,)
    gamma = float(lower.gamma or np.inf)
    surface = scene.surface
    return heights_of(white, gamma, (sigma[0], sigma[-1]), surface.correlation, surface.structure)[
        0
    ]
