"""What light between two layers must do whatever their surfaces: the mean chord theorem.

In light from the Lambertian hemisphere and over a white substrate a path has inside on average the
length 4n² · (mean thickness), meets the substrate n² S₂/A times and the interface from below
n² S₁/A times (S: area of the facets, A: of the plane), and leaves Lambertian (Cauchy; Blanco and
Fournier 2003). Energy is blind to what happens inside, these are not.
"""

import numpy as np
from numpy.typing import NDArray

from .. import seeds
from ..results import detector
from ..scene import Scene
from ..surface import Heightfield, LayeredMesh, Mesh, layered_mesh
from ..trace import engine, work_items
from ..trace.engine import AnyTile
from ..trace.kernels.exact_layers import INNER_HITS, LENGTH, SUBSTRATE_EVENTS
from ..trace.wavefront import FacetOptics
from . import false_alarms
from .invariant import Invariant

Array = NDArray[np.float64]

DIRECTIONS, PATHS = 128, 512
"""Of equal parts of the Lambertian light, and paths of each."""
RATE = 1e-6
"""Chance that a right trace is said to be wrong, of one scene."""
NEAR_NORMAL = detector.RINGS // 3
"""Rings up to 29°."""
NAMES = ("length inside", "substrate events", "hits from below", "light within 29° of the normal")


def mean_chord(scene: Scene, interface: Heightfield | None = None, *, seed: int = 0) -> Invariant:
    """Trace the first realisation of two layers in Lambertian light over a white substrate.

    ``interface`` is that of the realisation, made from the scene if it is None. What absorbs in
    the scene does not here.
    """
    pair = layered_mesh(scene, seed, 0, interface)
    name = engine.engine_of(scene)
    work_items.compiled(name, layered=True)
    tile = engine.layers_of(name).tile_of(pair, 0.0)
    optics = work_items.facet_optics(scene)._replace(substrate=True, survival=1.0)
    rng = seeds.generator(seed, seeds.MEAN_CHORD)
    traced, must = lambertian_light(tile, optics, rng), expected(pair, scene.material.n)
    figures = {f"{key}, traced": float(v) for key, v in zip(NAMES, traced.mean(0), strict=True)}
    figures |= {f"{key}, must be": float(v) for key, v in zip(NAMES, must, strict=True)}
    return false_alarms.by_chance(
        "mean chord",
        "in Lambertian light over a white substrate the length inside, the substrate events, the "
        "hits on the interface from below and the light that leaves are those of any two surfaces",
        false_alarms.against(traced, must),
        f"{DIRECTIONS} directions of {PATHS} paths on the first realisation",
        figures,
        rate=RATE,
        among=f"one scene of {1 / RATE:.0e}",
    )


def lambertian_light(tile: AnyTile, optics: FacetOptics, rng: np.random.Generator) -> Array:
    """What NAMES says by direction, stratified in sin²θ, of one incident path on average."""
    rows = np.empty((DIRECTIONS, len(NAMES)))
    for k, part in enumerate((np.arange(DIRECTIONS) + rng.random(DIRECTIONS)) / DIRECTIONS):
        theta = float(np.degrees(np.arcsin(np.sqrt(part))))
        tally = engine.trace(tile, theta, rng.uniform(0, 360), optics, PATHS, rng)
        rows[k, :3] = tally.inside[[LENGTH, SUBSTRATE_EVENTS, INNER_HITS]].sum(1) / tally.light
        rows[k, 3] = tally.energy[:, :, :NEAR_NORMAL].sum() / tally.light
    return rows


def expected(pair: LayeredMesh, n: float) -> Array:
    """What NAMES says, in closed form."""
    below = np.sin(np.radians(detector.RING_EDGES[NEAR_NORMAL])) ** 2
    areas = area(pair.substrate), area(pair.interface)
    return np.array([4 * n**2 * pair.report()["mean_thickness"], *(n**2 * x for x in areas), below])


def area(surface: Mesh) -> float:
    """Area of the facets over that of the plane."""
    z = surface.heights
    along, across = np.roll(z, -1, 1), np.roll(z, -1, 0)
    corner = np.roll(across, -1, 1)
    p = np.array([along - z, corner - across])
    q = np.where(surface.flipped, (across - z, corner - along), (corner - along, across - z))
    return float(np.sqrt(1 + p**2 + (surface.aspect * q) ** 2).mean())
