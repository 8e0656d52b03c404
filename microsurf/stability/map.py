"""The whole map: digits of every formula and sampler, counts of what is no number, borders."""

import time
from dataclasses import dataclass

import numpy as np
from tqdm import tqdm

from ..trace.engine import AUTO
from . import domain
from .case import ENOUGH, CheckedFunction, DomainPoint, points
from .functions import FUNCTIONS
from .limits import Limit, check
from .samplers import SAMPLERS
from .sweep import Count, sweep


@dataclass(frozen=True)
class Summary:
    """Of one formula: where least is left beyond the conditioning, and whether it is enough.

    ``short`` is the number of places with less than ENOUGH digits beyond the conditioning;
    ``least`` the fewest digits right anywhere, whatever the conditioning.
    """

    function: str
    group: str
    places: int
    worst: DomainPoint
    least: float
    short: int
    note: str

    @property
    def verdict(self) -> str:
        """``ok``, ``stated`` if a note says where fewer digits are right and why, or ``short``."""
        if not self.short:
            return "ok"
        return "stated" if self.note else "short"


@dataclass(frozen=True)
class Stability:
    """What `survey` found."""

    points: list[DomainPoint]
    summaries: list[Summary]
    counts: list[Count]
    limits: list[Limit]
    seconds: float

    @property
    def sound(self) -> bool:
        """Whether no formula is short of digits without a reason, and all values are numbers."""
        return all(row.verdict != "short" for row in self.summaries) and all(
            row.nan == row.infinite == row.negative == 0 for row in self.counts
        )


def survey(*, quick: bool, progress: bool = False, engine: str = AUTO) -> Stability:
    """Make the map: coarse in less than a minute on one core, or fine in several.

    ``engine`` traces where traces end.
    """
    begin = time.perf_counter()
    grid = domain.QUICK if quick else domain.FULL
    points_checked: list[DomainPoint] = []
    summaries = []
    for function in tqdm(
        (*FUNCTIONS, *SAMPLERS), desc="functions", disable=None if progress else True
    ):
        mine = list(points(function, grid))
        points_checked += mine
        summaries.append(summarise(function, mine))
    counts = sweep(24 if quick else 400, 1000, np.random.default_rng(1))
    limits = tqdm(
        check(*((256, 10_000, 1024) if quick else (512, 200_000, 4096)), name=engine),
        desc="limits",
        disable=None if progress else True,
    )
    return Stability(points_checked, summaries, counts, list(limits), time.perf_counter() - begin)


def summarise(function: CheckedFunction, points_checked: list[DomainPoint]) -> Summary:
    """Return the worst place of a formula, and how many fall short."""
    return Summary(
        function.name,
        function.group,
        len(points_checked),
        min(points_checked, key=lambda point: point.kept),
        min(point.right for point in points_checked),
        sum(point.kept < ENOUGH for point in points_checked),
        function.note,
    )
