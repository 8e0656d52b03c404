"""Embree behind one checked wrapper: the only file that knows embreex.

What is checked here is read out of bounds, or silently missed, by the library:
rays must be float32, one direction for each origin, finite, and not zero.
"""

import sys
from collections.abc import Sequence
from importlib.util import find_spec
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .grid import Grid, triangles

Rays = NDArray[np.float32]


class Hits(NamedTuple):
    """First triangle met by each ray, each array of shape (rays,).

    Its number, −1 for none, and the weights u, v of its second and third vertex.
    """

    triangle: NDArray[np.int32]
    u: NDArray[np.float32]
    v: NDArray[np.float32]


class EmbreeTile:
    """A tile's triangles, ready for rays from any number of threads."""

    engine = "embree"
    layered = False

    def __init__(self, grid: Grid) -> None:
        self.grid = grid
        self._scene, self._meshes = _commit([grid])

    def intersect(self, origins: Rays, directions: Rays) -> Hits:
        """Find the first hit of each ray, from t = 0 on; releases the GIL.

        Raises
        ------
        ValueError
            If the arrays are not two C-contiguous float32 arrays of the same shape
            (rays, 3), not finite, or hold a zero direction.

        """
        _check(origins, directions)
        hits = self._scene.run(origins, directions, output=True)
        return Hits(hits["primID"], hits["u"], hits["v"])


class EmbreeLayers:
    """The triangles of an interface and of the substrate under it, each a geometry of its own.

    ``absorption`` is per cell of length inside.
    """

    engine = "embree"
    layered = True

    def __init__(self, interface: Grid, substrate: Grid, absorption: float = 0.0) -> None:
        self.interface, self.substrate, self.absorption = interface, substrate, absorption
        self._scene, self._meshes = _commit([interface, substrate])

    def intersect(self, origins: Rays, directions: Rays) -> tuple[NDArray[np.int32], Hits]:
        """Find the first hit of each ray, see `EmbreeTile.intersect`, and on which surface.

        0 is the interface, 1 the substrate, −1 neither.
        """
        _check(origins, directions)
        hits = self._scene.run(origins, directions, output=True)
        return hits["geomID"], Hits(hits["primID"], hits["u"], hits["v"])


def _commit(grids: Sequence[Grid]) -> tuple[Any, list[Any]]:
    """A scene of some meshes, numbered in their order, ready for rays."""
    try:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene
    except ImportError as error:
        raise InputError(
            f"embreex is not installed: it has wheels for Linux x86-64, macOS and Windows, "
            f"none for this machine ({sys.platform}); "
            "trace with the exact engine, which is the default"
        ) from error
    scene = EmbreeScene(robust=True)
    meshes = [TriangleMesh(scene, *triangles(grid)) for grid in grids]
    # Commit is lazy and not thread-safe: it happens at the first ray, here.
    scene.run(
        np.array([[0, 0, grids[0].top + 1]], np.float32),
        np.array([[0, 0, -1]], np.float32),
        output=True,
    )
    return scene, meshes


def installed() -> bool:
    """Whether this machine has Embree."""
    return find_spec("embreex") is not None


def _check(origins: Rays, directions: Rays) -> None:
    for name, array in (("origins", origins), ("directions", directions)):
        if array.dtype != np.float32 or array.ndim != 2 or array.shape[1] != 3:
            raise ValueError(f"{name}: {array.dtype} {array.shape}, must be float32 (rays, 3)")
        if not array.flags.c_contiguous:
            raise ValueError(f"{name}: must be contiguous")
    if origins.shape != directions.shape:
        raise ValueError(f"{len(origins)} origins and {len(directions)} directions")
    # Sums and extremes carry NaN and ∞ along: one number each tells of all rays.
    if not np.isfinite(origins.sum()):
        raise ValueError("origins: must be finite")
    lengths = np.einsum("ij,ij->i", directions, directions)
    if len(lengths) and not (lengths.min() > 0 and lengths.max() < np.inf):
        raise ValueError("directions: must be finite and not zero")
