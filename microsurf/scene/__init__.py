"""Scenes: what is measured and predicted, and what must come of it."""

from .accuracy import MOST_PATHS, Accuracy
from .citation import Citation
from .effects import Effects
from .engines import ENGINES, Engine
from .layers import Layers, Substrate
from .light import Light
from .material import MAX_INDEX, Material
from .roughness import BECKMANN, Roughness
from .scene import Scene
from .surface import (
    BOUNDARIES,
    CORRELATIONS,
    LEVELS,
    MAX_CELLS,
    SPACINGS,
    STRUCTURES,
    VOIDS,
    Surface,
)

__all__ = [
    "BECKMANN",
    "BOUNDARIES",
    "CORRELATIONS",
    "ENGINES",
    "LEVELS",
    "MAX_CELLS",
    "MAX_INDEX",
    "MOST_PATHS",
    "SPACINGS",
    "STRUCTURES",
    "VOIDS",
    "Accuracy",
    "Citation",
    "Effects",
    "Engine",
    "Layers",
    "Light",
    "Material",
    "Roughness",
    "Scene",
    "Substrate",
    "Surface",
]
