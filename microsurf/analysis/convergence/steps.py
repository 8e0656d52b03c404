"""Which settings are measured around a scene's own, and with how much work."""

from dataclasses import dataclass, replace

from ...scene import CORRELATIONS, Scene, Surface

_LEAST_CELLS = 16
_LEAST_PATHS = 1024


@dataclass(frozen=True)
class ConvergenceEffort:
    """How far the steps go: factors of the scene's cells, and work for each.

    ``surfaces`` at the scene's settings, ``fewer`` on larger meshes; ``paths`` for each
    angle and surface, unless the scene asks for fewer; no more than ``cells`` a side
    unless the scene has more itself; ``repeats`` on one surface, of up to ``most_paths``.
    """

    factors: tuple[float, ...]
    surfaces: int
    fewer: int
    paths: int
    cells: int
    repeats: int
    most_paths: int


EFFORTS = {
    "quick": ConvergenceEffort((0.25, 0.5, 1, 2), 16, 8, 32_768, 1024, 12, 131_072),
    "full": ConvergenceEffort((0.25, 0.5, 1, 2, 4), 32, 8, 262_144, 2048, 24, 1_048_576),
}


def own(scene: Scene, effort: ConvergenceEffort) -> Surface:
    """The scene's own settings, on as many surfaces as the effort has."""
    return replace(scene.surface, realisations=effort.surfaces)


def mesh_steps(scene: Scene, effort: ConvergenceEffort) -> list[Surface]:
    """From coarse to fine; the tile keeps its size in correlation lengths."""
    mine = own(scene, effort)
    steps = []
    for factor in effort.factors:
        cells = round(mine.cells * factor)
        correlation = mine.correlation * cells / mine.cells
        few = effort.fewer if factor > 1 else mine.realisations
        if _possible(cells, mine, effort) and correlation >= CORRELATIONS[0]:
            steps.append(replace(mine, cells=cells, correlation=correlation, realisations=few))
    return steps


def tile_steps(scene: Scene, effort: ConvergenceEffort) -> list[Surface]:
    """From small to large; small tiles differ more, so there are more of them."""
    mine = own(scene, effort)
    steps = []
    for factor in effort.factors:
        cells = round(mine.cells * factor)
        count = effort.fewer if factor > 1 else mine.realisations * min(round(1 / factor), 2)
        if _possible(cells, mine, effort):
            steps.append(replace(mine, cells=cells, realisations=count))
    return steps


def _possible(cells: int, mine: Surface, effort: ConvergenceEffort) -> bool:
    return _LEAST_CELLS <= cells <= max(effort.cells, mine.cells) or cells == mine.cells


def ray_counts(scene: Scene, effort: ConvergenceEffort) -> list[int]:
    """Four numbers of paths, each four times the one before, up to the scene's own."""
    most = max(min(scene.accuracy.paths, effort.most_paths), _LEAST_PATHS)
    return [count for k in (3, 2, 1, 0) if (count := most // 4**k) >= _LEAST_PATHS]
