"""What checks microsurf and not a scene: run once for each version and machine, and remembered."""

from dataclasses import dataclass

from ..invariants import Invariant, broken, global_invariants
from ..stability import Stability, survey
from ..trace.engine import AUTO
from .remembered import remembered


@dataclass(frozen=True)
class SelfTest:
    """What must hold whatever the scene; how many digits are right; when the older was seen."""

    invariants: list[Invariant]
    stability: Stability | None
    date: str


def self_test(
    seed: int = 0,
    workers: int | None = None,
    *,
    digits: bool = True,
    again: bool = False,
    progress: bool = False,
    engine: str = AUTO,
) -> SelfTest:
    """Check microsurf, or give what that came to when this version was first checked here.

    Parameters
    ----------
    seed : int
        Of surfaces and rays; each is remembered apart.
    workers : int, optional
        Threads; default one for each core. The figures do not depend on it.
    digits : bool
        Whether to map also how many digits are right.
    again : bool
        Check now, whatever is remembered.
    progress : bool
        Show progress bars on standard error if that is a terminal.
    engine : str
        What traces; each is remembered apart.

    """
    held = remembered(
        f"invariants, engine {engine}, seed {seed}",
        lambda: global_invariants(seed, workers, engine=engine, progress=progress),
        lambda findings: not broken(findings),
        again=again,
    )
    if not digits:
        return SelfTest(held.value, None, held.date)
    mapped = remembered(
        f"stability, quick, engine {engine}",
        lambda: survey(quick=True, engine=engine, progress=progress),
        lambda findings: findings.sound,
        again=again,
    )
    return SelfTest(held.value, mapped.value, min(held.date, mapped.date))
