"""All invariants that are about microsurf and not about one scene: `global_invariants`."""

from concurrent.futures import ThreadPoolExecutor

from tqdm import tqdm

from .. import memory
from ..trace import work_items
from ..trace.engine import AUTO
from .area import projected_area
from .determinism import threads
from .furnace import furnaces
from .invariant import Invariant
from .limits import limits
from .reciprocity import reciprocity
from .symmetry import symmetries, unit_of_length


def global_invariants(
    seed: int = 0,
    workers: int | None = None,
    *,
    engine: str = AUTO,
    progress: bool = False,
) -> list[Invariant]:
    """Show what must hold: furnaces, reciprocity, projected area, limits, symmetries, workers.

    Takes about 50 s of processor time, 20 of them for reciprocity.

    Parameters
    ----------
    seed : int
        Of surfaces and rays; the same list whatever the number of workers.
    workers : int, optional
        Threads; default one for each core. The last step starts two processes besides.
    engine : str
        What traces, "exact" or "embree".
    progress : bool
        Show a progress bar on standard error if that is a terminal.

    """
    work_items.compiled(engine)
    with ThreadPoolExecutor(workers or memory.cores()) as pool:
        steps = (
            lambda: furnaces(pool, seed, workers, engine),
            lambda: reciprocity(pool, seed, engine),
            lambda: projected_area(pool, seed, engine),
            lambda: limits(pool, seed, workers, engine),
            lambda: symmetries(pool, seed, engine),
            lambda: unit_of_length(seed, workers, engine),
            lambda: threads(seed, engine),
        )
        bar = tqdm(steps, disable=None if progress else True, desc="invariants", unit=" steps")
        return [invariant for step in bar for invariant in step()]
