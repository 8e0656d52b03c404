"""The seam between engines and all else: each answers the same question, none knows another.

*exact* walks over the heights in float64 and loses nothing. *embree* intersects a triangle
mesh in float32. They share the facet events, never the traversal. `scene.engines` lists them.
"""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Protocol

import numpy as np

from ..errors import InputError
from ..scene import ENGINES, Scene
from ..surface import Mesh
from . import exact, layers, wavefront
from .embree import EmbreeTile
from .exact import exact_tile
from .grid import from_heights
from .layers import LayeredTile
from .plane import Plane
from .wavefront import FacetOptics, Tally

AUTO = "embree"
"""The engine of scenes that name none."""


class AnyTile(Protocol):
    """One period of a surface, ready for the engine it names."""

    @property
    def engine(self) -> str:
        """Key of `scene.engines`."""


@dataclass(frozen=True)
class Tracer:
    """What an engine can do; its entry in `scene.engines` says where this is.

    Attributes
    ----------
    tile_of : callable
        Of one period of a surface, see `surface.mesh`: a tile.
    plane : callable
        The tile of a flat surface.
    trace : callable
        Paths of light over a tile of its own, as `wavefront.trace`.

    """

    tile_of: Callable[[Mesh], AnyTile]
    plane: Callable[[], AnyTile]
    trace: Callable[..., Tally]


EXACT = Tracer(
    lambda period: exact_tile(period.heights, period.flipped, period.aspect),
    lambda: exact_tile(np.zeros((2, 2)), np.zeros((2, 2), np.bool_)),
    exact.trace,
)
EMBREE = Tracer(
    lambda period: EmbreeTile(from_heights(period.heights, period.flipped, period.aspect)),
    Plane,
    wavefront.trace,
)


def engine_of(scene: Scene) -> str:
    """Name of the engine that traces a scene."""
    return scene.accuracy.engine or (AUTO if scene.layers is None else "exact")


def tracer_of(engine: str) -> Tracer:
    """Load an engine by its name.

    Raises
    ------
    InputError
        If this process does not know it: an entry that a program adds to the list is known
        where that program has run.

    """
    if engine not in ENGINES:
        raise InputError(
            f"accuracy.engine = {engine!r}: this process knows {', '.join(ENGINES)}; "
            "add its entry to scene.ENGINES here, too"
        )
    module, _, name = ENGINES[engine].loader.partition(":")
    tracer: Tracer = getattr(import_module(module), name)
    return tracer


def tile_of(engine: str, period: Mesh) -> AnyTile:
    """Make one period of a surface ready for an engine."""
    return tracer_of(engine).tile_of(period)


def plane(engine: str) -> AnyTile:
    """A flat surface."""
    return tracer_of(engine).plane()


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
    if isinstance(tile, LayeredTile):
        return layers.trace(
            tile, theta, phi, facet, paths, rng, part=part, parts=parts, azimuth=azimuth
        )
    return tracer_of(tile.engine).trace(
        tile, theta, phi, facet, paths, rng, part=part, parts=parts, azimuth=azimuth
    )
