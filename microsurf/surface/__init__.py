"""Explicit microgeometry: heightfields, made, read, levelled, described and fitted."""

from .declared import Declared
from .detrend import level
from .fit import StdFit, fit_std
from .formats import FORMATS, Format, endings_text, read_endings, write_endings
from .heightfield import Heightfield, Mesh, facet_normals, facet_slopes, mesh
from .io import read_surface, write_surface
from .layers import LayeredMesh, flat_layers, layered_mesh, substrate_digest
from .measured import from_array
from .readers.height_map import HeightMap
from .realisations import (
    all_surfaces_of,
    notes_on_file,
    notes_on_surface,
    read_asked,
    realisation_seed,
    square_spacing,
    surface_of,
    surfaces_of,
)
from .statistics import surface_statistics
from .synthesis import from_recipe, generate_surface

__all__ = [
    "FORMATS",
    "Declared",
    "Format",
    "HeightMap",
    "Heightfield",
    "LayeredMesh",
    "Mesh",
    "StdFit",
    "all_surfaces_of",
    "endings_text",
    "facet_normals",
    "facet_slopes",
    "fit_std",
    "flat_layers",
    "from_array",
    "from_recipe",
    "generate_surface",
    "layered_mesh",
    "level",
    "mesh",
    "notes_on_file",
    "notes_on_surface",
    "read_asked",
    "read_endings",
    "read_surface",
    "realisation_seed",
    "square_spacing",
    "substrate_digest",
    "surface_of",
    "surface_statistics",
    "surfaces_of",
    "write_endings",
    "write_surface",
]
