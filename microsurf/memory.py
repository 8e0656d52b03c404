"""Memory is asked for before the work starts, not found missing in the middle of it."""

import os
from pathlib import Path

from .errors import InputError

TRACE_BYTES_PER_CELL = 500
"""Peak of synthesis, triangles and Embree's tree together (measured at 1024²: 330 to 420)."""

SURFACE_BYTES_PER_CELL = 300
"""Peak of synthesis alone."""

BYTES_PER_LOBE = 5_000_000
"""Peak of a lobe's bins, its tally's and their sums' (of 200 at n = 1.5: 3.1e6, Kd = 1: 4.8e6)."""


def available() -> float:
    """Bytes of memory free now; ∞ where the system does not say."""
    try:
        with Path("/proc/meminfo").open(encoding="ascii") as lines:
            for line in lines:
                if line.startswith("MemAvailable:"):
                    return float(line.split()[1]) * 1024
        return float(os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (OSError, ValueError, AttributeError):
        return float("inf")


def gibibytes(size: float) -> str:
    """Write a number of bytes for people."""
    return f"{size / 2**30:.1f} GiB"


def require(cells: int, bytes_per_cell: int, name: str) -> None:
    """Refuse a surface of ``cells`` cells in all that would not fit into memory."""
    needed, free = cells * bytes_per_cell, available()
    if needed > free:
        raise InputError(
            f"{name}: {cells} cells need about {gibibytes(needed)}, "
            f"{gibibytes(free)} are free; take fewer cells"
        )


def lobes_that_fit() -> int:
    """How many lobes, one for each realisation and angle, fit into memory."""
    return int(min(available() / BYTES_PER_LOBE, 10**9))


def require_lobes(realisations: int, angles: int) -> None:
    """Refuse more lobes, one for each realisation and angle, than would fit into memory."""
    needed, free = realisations * angles * BYTES_PER_LOBE, available()
    if needed > free:
        raise InputError(
            f"{angles} angles of incidence on {realisations} realisations: their lobes need about "
            f"{gibibytes(needed)}, {gibibytes(free)} are free; take fewer at a time"
        )
