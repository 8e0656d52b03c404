"""Results, measured or predicted alike: dataset, albedos, peaks, uncertainty.

Importing this package gives every dataset its accessor, ``result.microsurf``.
"""

from .accessor import Result

__all__ = ["Result"]
