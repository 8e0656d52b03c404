"""Scenes: what is measured and predicted, and what must come of it."""

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
    "LEVELS",
    "MAX_CELLS",
    "MAX_INDEX",
    "MOST_PATHS",
    "SPACINGS",
    "STRUCTURES",
    "Accuracy",
    "Effects",
    "Light",
    "Material",
    "Roughness",
    "Scene",
    "Surface",
]
