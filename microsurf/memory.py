"""What this process may use: memory, asked for before the work starts, and processors."""

import math
import os
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import psutil

from .errors import InputError

_PROC, _CGROUP = Path("/proc"), Path("/sys/fs/cgroup")

EXACT_BYTES_PER_CELL = 120
"""Peak of synthesis and of what the exact engine makes of a surface (measured at 512²: 85)."""

EMBREE_BYTES_PER_CELL = 500
"""Peak of synthesis, triangles and Embree's tree together (measured at 1024²: 330 to 420)."""

SURFACE_BYTES_PER_CELL = 250
"""Peak of a surface made, described and written (measured: 195; of synthesis alone 52)."""

BYTES_PER_LOBE = 5_000_000
"""Peak of a lobe's bins, its tally's and their sums' (of 200 at n = 1.5: 3.1e6, Kd = 1: 4.8e6)."""


_NO_LIMIT = 2**62
"""From here on a number in a control group of version 1 means that there is none."""


_sharing = [1]


def share(processes: int) -> None:
    """Let this process take no more than its part from now on, as one of so many."""
    _sharing[0] = processes


def available() -> float:
    """Bytes of memory that this process may still take, the least that any limit leaves.

    Those of the machine, of the control groups (cgroups) it is in, such as a container's or
    a batch job's, and of its address space (``ulimit -v``); its part of them, see `share`.
    """
    free = min([float(psutil.virtual_memory().available), *_left_by_limits()])
    return max(free, 0.0) / _sharing[0]


def cores() -> int:
    """Processors that this process may use: by affinity, and by the quota of its cgroups."""
    if sys.platform == "linux":
        count = len(os.sched_getaffinity(0))
    else:
        count = os.cpu_count() or 1
    quotas = [math.ceil(quota) for quota in _quotas() if quota > 0]
    return max(min([count, *quotas]), 1)


def _left_by_limits() -> Iterator[float]:
    if hasattr(psutil, "RLIMIT_AS"):
        process = psutil.Process()
        soft, _ = process.rlimit(psutil.RLIMIT_AS)
        if soft != psutil.RLIM_INFINITY:
            yield float(soft - process.memory_info().vms)
    for folder in _groups("memory"):
        # What lies in the cache of files is given back before anyone is killed.
        kept = _entries(folder / "memory.stat")
        version_2 = kept.get("active_file", 0) + kept.get("inactive_file", 0)
        version_1 = kept.get("total_active_file", 0) + kept.get("total_inactive_file", 0)
        for limit, used, files in (
            ("memory.max", "memory.current", version_2),
            ("memory.high", "memory.current", version_2),  # beyond it all but stands still
            ("memory.limit_in_bytes", "memory.usage_in_bytes", version_1),
        ):
            most, now = _number(folder / limit), _number(folder / used)
            if most < _NO_LIMIT and now < _NO_LIMIT:
                yield most - now + min(files, now)


def _quotas() -> Iterator[float]:
    """Processors that are given to each control group, as a number with fractions."""
    for folder in _groups("cpu"):
        with suppress(OSError, ValueError, IndexError, ZeroDivisionError):
            words = (folder / "cpu.max").read_text(encoding="ascii").split()
            yield float(words[0]) / float(words[1])  # "max" is no number
        quota, period = (_number(folder / f"cpu.cfs_{name}_us") for name in ("quota", "period"))
        if 0 < quota < _NO_LIMIT and 0 < period < _NO_LIMIT:
            yield quota / period


def _groups(controller: str) -> Iterator[Path]:
    """Folders of this process's control groups and of all above them, of both versions."""
    try:
        lines = (_PROC / "self" / "cgroup").read_text(encoding="utf-8").splitlines()
    except OSError:  # another system
        return
    for line in lines:
        _, _, rest = line.partition(":")
        controllers, _, path = rest.partition(":")
        if controllers and controller not in controllers.split(","):
            continue
        for root in (_CGROUP / controllers, _CGROUP / controller, _CGROUP / "unified", _CGROUP):
            here = root / path.lstrip("/")
            # In a container the path may be the host's, of which only the top is there.
            yield from (folder for folder in (here, *here.parents) if _below(folder, root))


def _below(folder: Path, root: Path) -> bool:
    return folder.is_relative_to(root) and folder.is_dir()


def _number(file: Path) -> float:
    """The number a file holds; ∞ if it is not there or holds none (``max``)."""
    try:
        return float(file.read_text(encoding="ascii"))
    except (OSError, ValueError):
        return math.inf


def _entries(file: Path) -> dict[str, float]:
    """Names and numbers, one of each a line."""
    try:
        words = [line.split() for line in file.read_text(encoding="ascii").splitlines()]
        return {name: float(value) for name, value in words}
    except (OSError, ValueError):
        return {}


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


def at_once(cells: int, workers: int | None = None) -> int:
    """How many surfaces of so many cells in all may be made at the same time, at least one."""
    fit = int(available() // (cells * EXACT_BYTES_PER_CELL))
    return max(min(workers or cores(), fit), 1)


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
