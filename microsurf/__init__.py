"""Explicit Student-t microsurfaces, ray-traced and compared with microfacet theory."""

from importlib import import_module
from typing import Any

__version__: str

_WHERE = {
    "Heightfield": "surface",
    "Scene": "scene",
    "compare": "analysis.comparison",
    "from_mitsuba": "model",
    "generate_surface": "surface",
    "measure": "trace",
    "predict": "model",
    "read_surface": "surface",
    "write_surface": "surface",
}

__all__ = [*_WHERE, "__version__"]  # noqa: PLE0604 - they are strings


def __getattr__(name: str) -> Any:
    """Import what is asked for only then: `microsurf --help` need not wait for Embree."""
    if name == "__version__":
        return import_module("importlib.metadata").version("microsurf")
    if name not in _WHERE:
        raise AttributeError(f"module 'microsurf' has no attribute {name!r}")
    return getattr(import_module(f".{_WHERE[name]}", __name__), name)
