"""How many surfaces and rays an accuracy takes at the least cost, from what a pilot measured.

With the variance V_b between surfaces and V_1 of one path, R surfaces of P paths leave
(V_b + V_1/P)/R, and P = √(V_1 A/(V_b B)) costs least, where a surface costs A and a path B.
"""

from dataclasses import dataclass

import numpy as np

from .. import memory
from ..errors import InputError
from ..results import uncertainty
from ..scene import MOST_PATHS, Accuracy, Scene
from ..stats import intervals
from ..trace import engine
from ..trace.scheduler import MOST_SURFACES

PILOT_SURFACES, PILOT_PATHS = 4, 32_768


@dataclass(frozen=True)
class Wanted:
    """One quantity: variances between surfaces and of one path, and the error asked of it."""

    lobe: bool
    between: float
    of_path: float
    target: float

    def left(self, surfaces: int, paths: int) -> float:
        """Standard error of the mean."""
        return float(np.sqrt((self.between + self.of_path / paths) / surfaces))

    def surfaces(self, paths: float) -> float:
        """How many it takes, not widened."""
        return (self.between + self.of_path / paths) / self.target**2


def wanted_of(
    known: list[uncertainty.QuantityUncertainty], accuracy: Accuracy, paths: int, *, single: bool
) -> list[Wanted]:
    """Totals as they are, lobes relative to themselves; a ``single`` surface has no others."""
    error = accuracy.standard_error or np.inf
    rows = []
    for row in known:
        lobe = row.quantity in uncertainty.LOBES
        if not lobe and row.quantity != "total":
            continue
        size = row.components.mean if lobe else 1.0
        between = 0.0 if single else (row.components.between / size) ** 2
        within = (row.components.within / size) ** 2
        wanted = (accuracy.lobe_error or error) if lobe else error
        rows.append(Wanted(lobe, between, within * paths, wanted))
    return rows


def cheapest(wanted: list[Wanted], scene: Scene, cells: int, *, single: bool) -> tuple[int, int]:
    """Surfaces and paths of each that leave no more than is asked, at the least cost."""
    if not wanted:
        return scene.surface.realisations, scene.accuracy.paths
    if single:
        least = 1 if scene.surface.file is not None else scene.surface.realisations
        worst = max(wanted, key=lambda w: w.of_path / w.target**2)
        each = _paths(worst.of_path / worst.target**2 / least)
        if each > MOST_PATHS:
            raise InputError(
                f"{'lobe' if worst.lobe else 'standard'}_error = {worst.target:g}: "
                f"would take about {each:.1g} paths, the most are {MOST_PATHS:.0g}; "
                "ask for a larger one"
            )
        return least, each
    hardest = max(wanted, key=lambda w: w.surfaces(PILOT_PATHS))
    surface_cost = engine.of_scene(scene).cell_cost * cells / scene.light.angles
    paths = PILOT_PATHS * 32.0
    if hardest.between > 0:
        paths = np.sqrt(hardest.of_path * surface_cost / hardest.between)
    paths = min(max(paths, PILOT_PATHS / 4), PILOT_PATHS * 128.0)
    most = min(MOST_SURFACES, memory.lobes_that_fit() // scene.light.angles)
    least = max(scene.surface.realisations, 2)

    def enough(count: int) -> bool:
        return all(w.surfaces(paths) * _widened(count) ** 2 <= count for w in wanted)

    count = next((count for count in range(least, most) if enough(count)), max(most, least))
    # The least number of surfaces may be more than enough: then fewer rays do.
    room = [(count * (w.target / _widened(count)) ** 2 - w.between, w.of_path) for w in wanted]
    if all(left > 0 for left, _ in room):
        paths = min(paths, max(v / left for left, v in room))
    return count, _paths(paths)


def _widened(count: int) -> float:
    """Few surfaces know their own spread badly, see `uncertainty.surplus`."""
    return intervals.student(count - 1) / intervals.normal()


def _paths(paths: float) -> int:
    """A round number of them."""
    return int(2 ** np.ceil(np.log2(max(paths, 1024.0))))
