"""Scenes: what is measured and predicted, and what must come of it."""

from .citation import Citation
from .engines import ENGINES, Engine
from .scene import (
    BECKMANN,
    BOUNDARIES,
    CORRELATIONS,
    LEVELS,
    MAX_CELLS,
    MAX_INDEX,
    MOST_PATHS,
    SPACINGS,
    STRUCTURES,
    VOIDS,
    Accuracy,
    Effects,
    Light,
    Material,
    Roughness,
    Scene,
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
    "Light",
    "Material",
    "Roughness",
    "Scene",
    "Surface",
]
