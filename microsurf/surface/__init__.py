"""Explicit microgeometry: heightfields, made, read, levelled, described and fitted."""

from .anisotropy import Anisotropy
from .detrend import level
from .fit import StdFit, fit_std
from .heightfield import Heightfield, Mesh, facet_normals, facet_slopes, mesh
from .io import ENDINGS, read_surface, write_surface
from .realisations import notes_on_file, realisation_seed, surface_of, surfaces_of
from .statistics import surface_statistics
from .synthesis import from_recipe, generate_surface

__all__ = [
    "ENDINGS",
    "Anisotropy",
    "Heightfield",
    "Mesh",
    "StdFit",
    "facet_normals",
    "facet_slopes",
    "fit_std",
    "from_recipe",
    "generate_surface",
    "level",
    "mesh",
    "notes_on_file",
    "read_surface",
    "realisation_seed",
    "surface_of",
    "surface_statistics",
    "surfaces_of",
    "write_surface",
]
