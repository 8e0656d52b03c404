"""Explicit Student-t microsurfaces, ray-traced and compared with microfacet theory."""

from importlib.metadata import version

__version__ = version("microsurf")

# After the version, which results carry in their attributes.
from .model import predict
from .scene import Scene
from .surface import Heightfield, generate_surface, read_surface, write_surface
from .trace import measure
from .verdict import compare

__all__ = [
    "Heightfield",
    "Scene",
    "__version__",
    "compare",
    "generate_surface",
    "measure",
    "predict",
    "read_surface",
    "write_surface",
]
