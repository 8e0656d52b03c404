"""The seam between engines and all else: each answers the same question, none knows another.

*exact* walks over the heights in float64 and loses nothing. *embree* intersects a triangle
mesh in float32. They share the facet events, never the traversal. `scene.engines` lists them.
"""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from .. import memory
from ..errors import InputError
from ..scene import ENGINES, Scene
from ..surface import LayeredMesh, Mesh
from . import embree_hits, embree_layers, exact, layers, wavefront
from .embree import EmbreeTile
from .exact import exact_tile
from .grid import from_heights
from .plane import Plane
from .wavefront import FacetOptics, FirstHits, Tally

AUTO = "exact"
"""The engine of scenes that name none."""
Array = NDArray[np.float64]


class AnyTile(Protocol):
    """One period of a surface, ready for the engine it names."""

    @property
    def engine(self) -> str:
        """Key of `scene.engines`."""

    @property
    def layered(self) -> bool:
        """Whether it is an interface over a substrate."""


@dataclass(frozen=True)
class LayersTracer:
    """What an engine does with an interface over a substrate.

    Attributes
    ----------
    tile_of : callable
        Of both surfaces and the absorption per cell: a tile, see `AnyTile.layered`.
    trace : callable
        Paths of light over it, as `wavefront.trace`; body events as in `layers.trace`.

    """

    tile_of: Callable[[LayeredMesh, float], AnyTile]
    trace: Callable[..., Tally]


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
    period_of, first_hits, ways_out : callable
        What masking and the invariants ask of a tile of its own, see the functions here.
    bytes_per_cell : int
        Memory that making and tracing a surface takes at most, for each cell.
    cell_cost : float
        Time to make a cell, ready for the engine, in that of a path on one thread: fixed, so
        that the same command plans the same on every machine.
    layers : LayersTracer or None
        The same of two surfaces; None of an engine that knows one only.

    """

    tile_of: Callable[[Mesh], AnyTile]
    plane: Callable[[], AnyTile]
    trace: Callable[..., Tally]
    period_of: Callable[[Any], Mesh]
    first_hits: Callable[..., FirstHits]
    ways_out: Callable[..., NDArray[np.bool_]]
    bytes_per_cell: int
    cell_cost: float
    layers: LayersTracer | None = None


EXACT = Tracer(
    lambda period: exact_tile(period.heights, period.flipped, period.aspect),
    lambda: exact_tile(np.zeros((2, 2)), np.zeros((2, 2), np.bool_)),
    exact.trace,
    exact.period_of,
    exact.first_hits,
    exact.ways_out,
    bytes_per_cell=memory.EXACT_BYTES_PER_CELL,
    cell_cost=0.5,
    layers=LayersTracer(layers.layered_tile, layers.trace),
)
EMBREE = Tracer(
    lambda period: EmbreeTile(from_heights(period.heights, period.flipped, period.aspect)),
    Plane,
    wavefront.trace,
    embree_hits.period_of,
    embree_hits.first_hits,
    embree_hits.ways_out,
    bytes_per_cell=memory.EMBREE_BYTES_PER_CELL,
    cell_cost=3.0,
    layers=LayersTracer(embree_layers.layered_tile, embree_layers.trace),
)


def engine_of(scene: Scene) -> str:
    """Name of the engine that traces a scene."""
    return scene.accuracy.engine or AUTO


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


def of_scene(scene: Scene) -> Tracer:
    """The engine that traces a scene."""
    return tracer_of(engine_of(scene))


def tile_of(engine: str, period: Mesh) -> AnyTile:
    """Make one period of a surface ready for an engine."""
    return tracer_of(engine).tile_of(period)


def layers_of(engine: str) -> LayersTracer:
    """What an engine does with two layers.

    Raises
    ------
    InputError
        If it knows one surface only.

    """
    tracer = tracer_of(engine).layers
    if tracer is None:
        raise InputError(
            f"accuracy.engine = {engine!r} with [layers]: it traces one surface only; "
            "leave it out or give 'exact'"
        )
    return tracer


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
    tracer = layers_of(tile.engine) if tile.layered else tracer_of(tile.engine)
    return tracer.trace(
        tile, theta, phi, facet, paths, rng, part=part, parts=parts, azimuth=azimuth
    )


def period_of(tile: AnyTile) -> Mesh:
    """One period as rays meet it, the first row and column of vertices once more at the end."""
    return tracer_of(tile.engine).period_of(tile)


def first_hits(
    tile: AnyTile, theta: float, phi: float, rays: int, rng: np.random.Generator
) -> FirstHits:
    """Send light from (θ, φ), in degrees, over all of the tile, and on from mirrors it meets."""
    return tracer_of(tile.engine).first_hits(tile, theta, phi, rays, rng)


def ways_out(
    tile: AnyTile, facets: NDArray[np.int64], points: Array, normals: Array, w: Array
) -> NDArray[np.bool_]:
    """Which rays from facets towards the light meet nothing, shape (rays,).

    Parameters
    ----------
    tile : AnyTile
        With square cells.
    facets : ndarray of int64, shape (rays,)
        Where they start: numbers as in `FirstHits`; the facets must look towards ``w``.
    points, normals : ndarray, shape (rays, 3)
        Points of the period, in cells from its first vertex, and the facets' unit normals.
    w : ndarray, shape (3,)
        Unit vector, upwards.

    """
    return tracer_of(tile.engine).ways_out(tile, facets, points, normals, w)
