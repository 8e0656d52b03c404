"""Numbered work items: each can be done anywhere, by anyone, and gives the same bits.

A work item is small, seeded by its place, and says how to make its surface, so it can be
sent to a thread, a process or a machine that knows nothing yet.
"""

import functools
import hashlib
import threading
from dataclasses import dataclass

import numpy as np

from .. import memory, seeds
from ..physics.facet import body_weight
from ..scene import Scene
from ..surface import Heightfield, flat_layers, layered_mesh, mesh, surface_of
from . import engine
from .engine import AnyTile
from .wavefront import FacetOptics, Tally

PATHS_PER_ITEM = 131_072
"""Paths of one work item: a tenth of a second, and a fortieth of a large result to lose."""


@dataclass(frozen=True)
class Realisation:
    """Where a realisation's surface comes from: given, or made from the scene's recipe."""

    scene: Scene
    seed: int
    number: int
    given: Heightfield | None = None

    @property
    def name(self) -> str:
        """The same for the same surface, here and in every other process."""
        digest = hashlib.sha256()
        if self.given is None:
            identity = (self.scene.roughness, self.scene.surface, self.seed, self.number)
            digest.update(repr(identity).encode())
        else:
            digest.update(repr((self.given.heights.shape, self.given.spacing)).encode())
            digest.update(repr((self.given.boundary, self.given.recipe)).encode())
            digest.update(np.ascontiguousarray(self.given.heights).tobytes())
        if self.scene.layers is not None:
            digest.update(repr((self.scene.layers, self.seed, self.number)).encode())
        return digest.hexdigest()

    def tile(self) -> AnyTile:
        """Make the surface and what rays meet of it; a flat scene has no mesh."""
        name = engine.engine_of(self.scene)
        if self.scene.layers is not None:
            pair = layered_mesh(self.scene, self.seed, self.number, self.given)
            self._require(2 * pair.interface.heights.size)
            return engine.layers_of(name).tile_of(pair, self.scene.layers.absorption)
        if self.given is None and not self.scene.requires.roughness:
            return engine.plane(name)
        if self.given is None and self.scene.surface.file is None:
            self._require(self.scene.surface.cells**2)  # before it is made
        surface = self.given or surface_of(self.scene, self.seed, self.number)
        heightfield = mesh(surface)
        self._require(heightfield.heights.size)
        return engine.tile_of(name, heightfield)

    def _require(self, cells: int) -> None:
        memory.require(cells, engine.of_scene(self.scene).bytes_per_cell, "surface")


@dataclass(frozen=True)
class WorkItem:
    """So many paths of one angle on one realisation; ``number`` counts work items of both.

    They fall on one of several ``parts`` of the tile: rays that follow each other then
    meet facets near each other, which are in the cache.
    """

    realisation: Realisation
    name: str
    angle: int
    theta: float
    phi: float
    number: int
    paths: int
    part: int
    parts: int

    def generator(self) -> np.random.Generator:
        """Its own random numbers."""
        key = self.realisation.number, self.angle, self.number
        return seeds.generator(self.realisation.seed, seeds.RAYS, *key)


def facet_optics(scene: Scene) -> FacetOptics:
    """What the facet events of a scene need."""
    needs, material = scene.requires, scene.material
    return FacetOptics(
        material.n,
        needs.interface,
        needs.substrate,
        needs.multiple_scattering,
        survival=max(material.kd)
        if scene.layers is not None
        else float(body_weight(material.n, max(material.kd))),
        k=material.k,
    )


@functools.cache
def compiled(name: str, *, layered: bool = False) -> None:
    """Compile an engine, once a process, before any clock runs."""
    facet = FacetOptics(1.5, interface=True, substrate=True, multiple_scattering=True)
    tile = engine.plane(name)
    if layered:
        tile = engine.layers_of(name).tile_of(flat_layers(2, 1.0), 0.0)
    engine.trace(tile, 0.0, 0.0, facet, 1, np.random.default_rng(0))


_building = threading.Lock()
_built: dict[str, AnyTile] = {}


def _tile(item: WorkItem) -> AnyTile:
    """The work item's tile: the last one is kept, work items come in the order of realisations."""
    name = f"{engine.engine_of(item.realisation.scene)} {item.name}"
    with _building:
        if name not in _built:
            _built.clear()
            _built[name] = item.realisation.tile()
        return _built[name]


def forget() -> None:
    """Give the last tile's memory back."""
    with _building:
        _built.clear()


def run(item: WorkItem) -> Tally:
    """Do the work."""
    scene = item.realisation.scene
    compiled(engine.engine_of(scene), layered=scene.layers is not None)
    return engine.trace(
        _tile(item),
        item.theta,
        item.phi,
        facet_optics(scene),
        item.paths,
        item.generator(),
        part=item.part,
        parts=item.parts,
    )
