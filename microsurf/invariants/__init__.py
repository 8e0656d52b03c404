"""What must hold exactly, whatever is measured: shown with figures, once a report and by scene.

`global_invariants` are about microsurf itself, `scene_invariants` about one measurement.
Those that are decided by chance together call a false alarm in one report of 1/`RATE`.
"""

from .books import scene_invariants
from .chance import RATE
from .invariant import Invariant, as_rows, broken
from .whole import global_invariants

__all__ = [
    "RATE",
    "Invariant",
    "as_rows",
    "broken",
    "global_invariants",
    "scene_invariants",
]
