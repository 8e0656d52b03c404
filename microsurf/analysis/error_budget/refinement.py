"""What a scene's own mesh and tile leave in its albedos, by pairs of surfaces.

mesh: the same relief on the scene's mesh and on one twice as fine, traced by the same rays:
most of what surfaces and rays vary by is in both and drops out. tile: surfaces of half the
side beside the scene's own. What halving the tile changes bounds what doubling it would:
finite-size effects fall with the size. That is assumed, not measured.
"""

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ... import memory, seeds
from ...scene import MAX_CELLS, Scene
from ...stats import intervals
from ...surface import Heightfield, all_surfaces_of, generate_surface, realisation_seed
from ...trace import measure
from .regions import components
from .terms import TermEstimate

Array = NDArray[np.float64]

PAIRS, HALVES = 4, 8
PATHS = 65_536
"""For each angle of each surface, at the most."""

Estimates = Mapping[float, Mapping[str, tuple[Array, Array]]]


@dataclass(frozen=True)
class Refinement:
    """Values and 95 % half widths by Kd and part, each of shape (theta_i, phi_i)."""

    mesh: Estimates
    tile: Estimates

    def parts(self, which: str, kd: float, index: tuple[int, int]) -> dict[str, TermEstimate]:
        """Estimates of one study at one incidence."""
        changes = getattr(self, which)[kd]
        return {q: TermEstimate(float(v[index]), float(h[index])) for q, (v, h) in changes.items()}


def refine(
    scene: Scene, measured: xr.Dataset, *, seed: int = 0, workers: int | None = None,
    progress: bool = False,
) -> Refinement | None:  # fmt: skip
    """Measure both; None for a surface that is not generated, or can't be made twice as fine."""
    surface = scene.surface
    if surface.file is not None or not scene.requires.roughness or 2 * surface.cells > MAX_CELLS:
        return None
    paths = min(scene.accuracy.paths, PATHS)
    refined_scene = replace(scene, accuracy=scene.accuracy.with_paths(paths), expect={})
    surface_seed = realisation_seed(seed, seeds.REFINEMENT)

    smaller = replace(surface, cells=max(surface.cells // 2, 2), realisations=HALVES)
    half = replace(refined_scene, surface=smaller)

    def traced(surfaces: list[Heightfield]) -> xr.Dataset:
        return measure(
            refined_scene, surfaces, seed=surface_seed, workers=workers, progress=progress
        )

    with ThreadPoolExecutor(memory.at_once(4 * surface.cells**2, workers)) as pool:
        coarse, fine = (
            traced(list(pool.map(partial(_made, scene, surface_seed, factor=f), range(PAIRS))))
            for f in (1, 2)
        )
    small = traced(all_surfaces_of(half, surface_seed, workers))
    mesh, tile = {}, {}
    n = scene.material.n
    for kd in scene.material.kd:
        a, b, c, d = (components(x, n, kd) for x in (coarse, fine, small, measured))
        mesh[kd] = {q: _paired(a[q], b[q]) for q in a}
        tile[kd] = {q: _bound(c[q], d[q]) for q in c}
    return Refinement(mesh, tile)


def _made(scene: Scene, seed: int, pair: int, factor: int) -> Heightfield:
    """One of a pair: the scene's mesh (1) or one twice as fine (2) of the same relief."""
    surface, rough = scene.surface, scene.roughness
    return generate_surface(
        rough.gamma,
        rough.sigma_x,
        rough.sigma_y,
        cells=factor * surface.cells,
        correlation=factor * surface.correlation,
        structure=surface.structure,
        seed=realisation_seed(seed, pair),
        finer=2 // factor,
    )


def _paired(coarse: Array, fine: Array) -> tuple[Array, Array]:
    """Mean difference of pairs and its half width."""
    apart = coarse - fine
    return apart.mean(axis=0), intervals.half_width_of_mean(apart)


def _bound(small: Array, large: Array) -> tuple[Array, Array]:
    """Nothing, give or take what halving changed at the most (Welch's interval)."""
    variances = small.var(axis=0, ddof=1) / len(small)
    dof = len(small) - 1
    if len(large) > 1:
        variances = variances + large.var(axis=0, ddof=1) / len(large)
        dof = min(dof, len(large) - 1)
    half = intervals.student(dof) * np.sqrt(variances)
    change = np.abs(small.mean(axis=0) - large.mean(axis=0))
    return np.zeros_like(change), change + half
