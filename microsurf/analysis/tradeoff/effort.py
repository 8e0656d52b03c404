"""How much of the trade-off is measured, and against what reference."""

from dataclasses import dataclass


@dataclass(frozen=True)
class TradeoffEffort:
    """How much is run.

    walks : numbers of walks, and runs of as many. meshes : factor of the scene's mesh, rays
    of an angle, and surfaces made. cells, finer : factors of the scene's cells and of its
    correlation length in cells for the reference, whose mesh is finer and whose tile may be
    smaller. paths, surfaces, most : its rays, and its surfaces at first and at most.
    """

    walks: tuple[tuple[int, int], ...]
    meshes: tuple[tuple[float, int, int], ...]
    cells: float
    finer: float
    paths: int
    surfaces: int
    most: int


EFFORTS = {
    "quick": TradeoffEffort(
        ((10_000, 48), (100_000, 16), (1_000_000, 4)),
        ((0.25, 16_384, 6), (0.5, 16_384, 6), (1, 16_384, 4), (1, 65_536, 4)),
        1, 1.5, 32_768, 8, 24,
    ),
    "full": TradeoffEffort(
        ((10_000, 96), (100_000, 48), (1_000_000, 12), (10_000_000, 4)),
        ((0.25, 16_384, 12), (0.5, 16_384, 12), (1, 65_536, 12), (1, 262_144, 8)),
        2, 2, 262_144, 16, 64,
    ),
}  # fmt: skip
