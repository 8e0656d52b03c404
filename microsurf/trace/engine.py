"""Which of the two engines traces: both answer the same question, neither knows the other.

*exact* walks over the heights in float64 and loses nothing. *embree* intersects a triangle
mesh in float32. They share the facet events, never the traversal.
"""

import numpy as np

from ..scene import Scene
from ..surface import Mesh
from . import exact, wavefront
from .embree import EmbreeTile
from .exact import ExactTile, exact_tile
from .grid import from_heights
from .plane import Plane
from .wavefront import FacetOptics, Tally

AUTO = "embree"
"""The engine of scenes that name none."""

AnyTile = ExactTile | wavefront.Tile


def engine_of(scene: Scene) -> str:
    """Name of the engine that traces a scene."""
    return scene.accuracy.engine or AUTO


def tile_of(engine: str, period: Mesh) -> AnyTile:
    """Make one period of a surface ready for an engine."""
    if engine == "exact":
        return exact_tile(period.heights, period.flipped, period.aspect)
    return EmbreeTile(from_heights(period.heights, period.flipped, period.aspect))


def plane(engine: str) -> AnyTile:
    """A flat surface."""
    if engine == "exact":
        return exact_tile(np.zeros((2, 2)), np.zeros((2, 2), np.bool_))
    return Plane()


def trace(
    tile: AnyTile,
    theta: float,
    phi: float,
    facet: FacetOptics,
    paths: int,
    rng: np.random.Generator,
    *,
    part: int = 0,
    parts: int = 1,
    azimuth: float | None = None,
) -> Tally:
    """Follow paths with the engine the tile was made for, see `wavefront.trace`."""
    if isinstance(tile, ExactTile):
        return exact.trace(
            tile, theta, phi, facet, paths, rng, part=part, parts=parts, azimuth=azimuth
        )
    return wavefront.trace(
        tile, theta, phi, facet, paths, rng, part=part, parts=parts, azimuth=azimuth
    )
