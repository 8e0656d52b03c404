"""Where meshes and traces end: each border checked, with what was found and what is allowed."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..scene.tail_limit import LEAST_GAMMA, share_left_out
from ..surface import Heightfield, Mesh, generate_surface, surface_statistics
from ..surface.heightfield import mesh
from ..trace import embree, engine
from ..trace.kernels.state import ENDS, LOST
from ..trace.wavefront import FacetOptics
from .first_hit import ROUNDINGS, unexplained

KS = 5e-3
CLOSED = 1e-9
LOSSES = 1e-4
Array = NDArray[np.float64]
_IL = FacetOptics(1.5, interface=True, substrate=True, multiple_scattering=True)
_TAILS = (1.51, 1.55, 1.6, 1.65, 1.75, 2.0)


@dataclass(frozen=True)
class Limit:
    """What was checked: the value found, the limit it may not pass, and why it is as it is."""

    border: str
    checked: str
    value: float
    limit: float
    reason: str

    @property
    def verdict(self) -> str:
        """``ok`` within the limit, else ``border``."""
        return "ok" if self.value <= self.limit else "border"


def check(cells: int, paths: int, largest: int, *, name: str = engine.AUTO) -> Iterator[Limit]:
    """Check all borders, on meshes of so many cells a side and with so many paths each.

    ``largest`` is the side of the largest mesh that is traced, by the engine ``name``.
    """
    yield from _tails(cells)
    yield from _roughness()
    yield from _units()
    yield from _traces(name, paths, largest)
    yield from _engines()


def _tails(cells: int) -> Iterator[Limit]:
    for gamma in _TAILS:
        surface = generate_surface(gamma, 0.5, cells=cells, seed=1)
        statistics = surface_statistics(surface, gamma, 0.5)
        beyond = statistics["tail"]["area_beyond"]
        least = share_left_out(gamma, 0.5, cells)
        yield Limit(
            f"γ → 3/2: {gamma:g}",
            f"KS of slopes on {cells}² cells",
            statistics["ks"],
            KS,
            f"{beyond:.1%} of the microsurface area is steeper than the steepest facet "
            f"(of {2 * cells**2} facets at best {least:.1%}); refused below γ = {LEAST_GAMMA:g}",
        )


def _roughness() -> Iterator[Limit]:
    """σ is a factor of the heights and of nothing else."""
    unit = generate_surface(2.0, 1.0, cells=64, seed=1).heights
    for sigma in (0.001, 5.0):
        heights = generate_surface(2.0, sigma, cells=64, seed=1).heights
        off = float(np.max(np.abs(heights / sigma - unit)) / np.max(np.abs(unit)))
        yield Limit(
            f"σ = {sigma:g}",
            "heights/σ against those of σ = 1",
            off,
            # Ranks are interpolated in bins of 2^13 an octave: the last digit of 1 + ρ² is
            # 2^−39 of a bin, by which the steepest facet, alone in its bin, may move.
            2.0**-39,
            "σ is a factor of the heights: slopes/σ are the same but for the rounding of a rank",
        )


def _units() -> Iterator[Limit]:
    plain = generate_surface(2.0, 0.5, cells=64, seed=1)
    for unit, name in ((2.0**-30, "2^−30"), (2.0**10, "2^10"), (1e-9, "1e−9"), (1e3, "1e3")):
        # Another unit of length: what is measured in it, heights and spacing alike.
        other = mesh(Heightfield(plain.heights * unit, unit)).heights.astype(np.float32)
        off = float(np.mean(other != mesh(plain).heights.astype(np.float32)))
        power = name.startswith("2^")
        yield Limit(
            f"unit {name} m",
            "share of float32 heights that differ",
            off,
            0.0 if power else 1e-5,
            "rays see heights in cells: the same bits"
            if power
            else "rays see heights in cells; another factor rounds once in float64",
        )


def _traces(engine_name: str, paths: int, largest: int) -> Iterator[Limit]:
    gentle = mesh(generate_surface(2.0, 0.5, cells=64, seed=1)).heights
    rng = np.random.default_rng(2)
    cliffs = 0.3 * rng.standard_normal((32, 32))
    cliffs[rng.integers(0, 32, 8), rng.integers(0, 32, 8)] += 1000
    long = generate_surface(2.0, 0.5, cells=(4096, 8), seed=1)
    places: dict[str, tuple[Array, float]] = {
        "ordinary: 64² cells, γ = 2, σ = 0.5, 60°": (gentle, 60.0),
        "σ = 0.001, 60°": (_slopes(0.001), 60.0),
        "σ = 5, 60°": (_slopes(5.0), 60.0),
        "2 × 2 cells, 60°": (0.5 * rng.standard_normal((2, 2)), 60.0),
        "4096 × 8 cells, 60°": (mesh(long).heights, 60.0),
        "θ = 89.9°": (gentle, 89.9),
        "θ = 89.99999°": (gentle, 89.99999),
        "cliffs of 1000 cells, 60°": (cliffs, 60.0),
    }
    for name, (heights, theta) in places.items():
        # At the horizon a ray goes round the period a hundred times before it meets anything.
        count = paths if theta < 89.99 else paths // 10
        yield from _trace(name, engine_name, heights, theta, count)
    # Made last and alone: 4096² cells take gigabytes.
    heights = mesh(generate_surface(2.0, 0.5, cells=largest, seed=1)).heights
    yield from _trace(f"{largest}² cells, 60°", engine_name, heights, 60.0, paths)


def _slopes(sigma: float) -> Array:
    return mesh(generate_surface(2.0, sigma, cells=64, seed=1)).heights


def _trace(
    name: str, engine_name: str, heights: Array, theta: float, paths: int
) -> Iterator[Limit]:
    """Kd = 1: what arrives and what is lost are all the light."""
    tile = engine.tile_of(engine_name, Mesh(heights, np.zeros(heights.shape, np.bool_), 1.0))
    tally = engine.trace(tile, theta, 17.0, _IL, paths, np.random.default_rng(3))
    balance = abs(float(tally.energy.sum() + tally.ended.sum()) / tally.light - 1)
    yield Limit(
        name,
        "light not accounted for at Kd = 1",
        balance,
        CLOSED,
        "every path's light arrives or is counted as lost",
    )
    lost = {cause: int(tally.lost[ENDS.index(cause)]) for cause in LOST}
    share = sum(lost.values()) / tally.paths
    listed = ", ".join(f"{count} {cause}" for cause, count in lost.items() if count)
    yield Limit(
        name,
        "paths lost",
        share,
        LOSSES,
        f"of {tally.paths} paths {listed or 'none'}"
        + (f"; {tally.leaks} rays fell through an edge and were sent again" * (tally.leaks > 0)),
    )


def _engines() -> Iterator[Limit]:
    names = ("embree", "exact") if embree.installed() else ("exact",)
    for name in names:
        yield from _first_hits(name, 24 if name == "embree" else 40)


def _first_hits(name: str, cells: int) -> Iterator[Limit]:
    rng = np.random.default_rng(4)
    cliffs = 0.3 * rng.standard_normal((cells, cells))
    cliffs[rng.integers(0, cells, 6), rng.integers(0, cells, 6)] += 1000
    for surface, heights in {
        "γ = 2, σ = 0.5": mesh(generate_surface(2.0, 0.5, cells=cells, seed=1)).heights,
        "γ = 1.75, σ = 5": mesh(generate_surface(1.75, 5.0, cells=cells, seed=1)).heights,
        "γ = 2, σ = 0.001": mesh(generate_surface(2.0, 0.001, cells=cells, seed=1)).heights,
        "cliffs of 1000 cells": cliffs,
    }.items():
        count = 2000
        differ, left = unexplained(name, heights, count, rng)
        yield Limit(
            f"{name} and all triangles: {surface}",
            "rays whose first facets differ by more than rounding",
            left / count,
            0.0,
            f"first facets differ for {differ} of {count} rays, {differ - left} of them "
            f"within {ROUNDINGS} roundings of the coordinates",
        )
