"""What must hold exactly, whatever is measured: shown with figures, once a report and by scene.

`global_invariants` are about microsurf itself, `scene_invariants` about one measurement.
Those that are decided by chance together call a false alarm in one report of 1/`RATE`.
"""

from .all import global_invariants
from .energy import scene_invariants
from .false_alarms import RATE
from .invariant import Invariant, as_rows, broken
from .mean_chord import mean_chord
from .referee import second_engine

__all__ = [
    "RATE",
    "Invariant",
    "as_rows",
    "broken",
    "global_invariants",
    "mean_chord",
    "scene_invariants",
    "second_engine",
]
