"""Triangles of a heightfield, and meshes of Mitsuba whose facets have their own normals."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .period import MARGIN

Array = NDArray[np.float64]


def mesh_of(mi: Any, name: str, vertices: Array, faces: NDArray[np.int64], bsdf: Any) -> Any:
    """Make a mesh in the variant that is set; vertices (…, 3), faces (…, 3) seen from outside."""
    properties = mi.Properties()
    properties["mesh_bsdf"] = bsdf
    properties["face_normals"] = True
    mesh = mi.Mesh(name, len(vertices), len(faces), props=properties)
    buffers = mi.traverse(mesh)
    buffers["vertex_positions"] = vertices.ravel().astype(np.float32)
    buffers["faces"] = faces.ravel().astype(np.uint32)
    buffers.update()
    return mesh


def tile_triangles(heights: Array) -> tuple[Array, NDArray[np.int64]]:
    """Vertices and faces of a period [y, x] in cells, margin included, centred on the origin.

    Cells are split from (x, y) to (x+1, y+1).
    """
    rows, columns = heights.shape
    j = np.arange(-MARGIN, rows + MARGIN + 1)
    i = np.arange(-MARGIN, columns + MARGIN + 1)
    z = heights[np.ix_(j % rows, i % columns)]
    x, y = np.meshgrid(i - columns // 2, j - rows // 2)
    vertices = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    index = np.arange(z.size).reshape(z.shape)
    h00, h10, h11, h01 = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    faces = np.stack([h00, h10, h11, h00, h11, h01], axis=-1).reshape(-1, 3)
    return vertices, faces
