"""Explicit Student-t microsurfaces, ray-traced and compared with microfacet theory."""

from importlib.metadata import version

__version__ = version("microsurf")
