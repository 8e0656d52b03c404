"""A flat surface needs no mesh: every ray that comes down meets the one facet there is."""

import numpy as np

from .embree import Hits, Rays
from .grid import Grid, from_heights


class Plane:
    """Stands in for `EmbreeTile` where σ = 0: one cell-wide pattern, never searched."""

    engine = "embree"
    layered = False

    def __init__(self) -> None:
        self.grid: Grid = from_heights(np.zeros((2, 2)), np.zeros((2, 2), bool))

    def intersect(self, origins: Rays, directions: Rays) -> Hits:  # noqa: ARG002 - as any tile
        """Hit the middle of the first facet; what leaves a facet never comes back here."""
        count = len(origins)
        third = np.full(count, 1 / 3, np.float32)
        return Hits(np.zeros(count, np.int32), third, third)
