"""Surfaces whose facets have prescribed slopes, by alternating projection.

From a periodic Gaussian field, or a function of one (`structures`), repeat: (1) take
the slopes of the facets; (2) rank them by ρ = |(p/σ_x, q/σ_y)| and rescale each,
direction kept, to the STD quantile (k+½)/N of its rank k, which a histogram tells; (3)
project back onto integrable fields: the heights whose finite differences are nearest in
the least-squares sense. Each edge of the grid is a side of exactly two facets, so all
edges weigh the same, and the normal equations are Poisson's: diagonal in the discrete
Fourier transform.

From the field itself heights and slopes stay nearly independent, which is what Smith
masking assumes: structure ``"independent"``. From a function of it steepness keeps its
place in height, as far as the mesh holds both: `surface_statistics` measures that.

The method is this project's own; what is random is the initial field only.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from .. import __version__
from ..errors import InputError, require
from ..physics import student_t
from ..scene import MAX_CELLS, STRUCTURES
from . import rank_kernels
from .gaussian_field import gaussian_field, threads_for
from .heightfield import Heightfield, check_spacing
from .structures import impose

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

ITERATIONS = 10
"""At 1024² cells KS is then 2e−5 (γ = ∞) to 2e−4 (γ = 1.75)."""

MAX_SIGMA = 1000.0
"""Largest roughness, as in a scene."""


def generate_surface(
    gamma: float,
    sigma: float,
    sigma_y: float | None = None,
    *,
    cells: int | tuple[int, int] = 512,
    correlation: float = 8.0,
    structure: str = "independent",
    spacing: float = 1.0,
    seed: int = 0,
    iterations: int = ITERATIONS,
    finer: int = 1,
) -> Heightfield:
    """Make a periodic surface whose facet slopes follow STD.

    The mesh realises the distribution up to its quantile 1 − 1/(4 rows columns), at
    best: `surface_statistics` says what is left out. γ ≥ 1.75 is safe, 1.65 a stress
    case (KS up to 3e−3 at 256²), below it the tail can't be held (`tail_limit`):
    commands refuse unless a truncated tail is allowed, this function does not. Same seed,
    same bits, whatever the number of threads.

    Parameters
    ----------
    gamma : float
        Shape, > 3/2; ∞ for Beckmann.
    sigma, sigma_y : float
        Roughness along x and y, both > 0 or both 0 (flat); sigma_y defaults to sigma.
    cells : int or (int, int)
        Cells a side, or (rows, columns); 2 … 16384 each.
    correlation : float
        L in cells, > 0: the initial field has autocorrelation exp(−r²/L²). With
        anisotropy its lengths L_x : L_y ≈ 1/σ_x : 1/σ_y have the geometric mean L.
        Short lengths show the mesh's diagonals: at L = 3 and γ ≤ 2 the mean of sin 2φ
        is 0.005 (at 8 below 0.002), and L < 1.3 can't be isotropic at all.
    structure : str
        Where steep facets lie: ``"independent"`` of height, at the ``"tops"``, at
        ``"middle"`` height or at both ``"extremes"``. The same slopes whichever, and
        at γ = ∞ the same surface. A mesh has to have room for a heavy tail there, a
        slope of 100 rises 100 cells: "middle" keeps a half of its rank correlation
        with height at γ = 2, L = 8, and of γ = 1.75 nothing (two fifths at L = 32). Its
        cliffs, one facet wide, show the diagonals: the mean of sin 2φ is 0.03 and 0.07.
    spacing : float
        Distance of neighbouring heights in the unit wanted, > 0.
    seed : int
        Of the initial field, ≥ 0.
    iterations : int
        How often to project, ≥ 0; the best result by KS distance is returned (heavy
        tails do not improve steadily).

    finer : int
        The initial field is drawn on a mesh so many times as fine, and every so-manyth
        height taken: with the same seed a surface of 2N cells and 2L is the same relief on
        a finer mesh. Its statistics are those of ``finer = 1``.

    Raises
    ------
    InputError
        If an argument is out of its range.

    """
    sigma_y = sigma if sigma_y is None else sigma_y
    _check_std(gamma, sigma, sigma_y)
    shape = _check_cells(cells)
    require(0 < correlation < np.inf, "correlation", correlation, "a finite number of cells > 0")
    require(_whole(seed) and seed >= 0, "seed", seed, "a whole number ≥ 0")
    require(_whole(iterations) and iterations >= 0, "iterations", iterations, "a whole number ≥ 0")
    require(structure in STRUCTURES, "structure", structure, f"one of {', '.join(STRUCTURES)}")
    require(
        _whole(finer) and 1 <= finer <= MAX_CELLS // max(shape), "finer", finer,
        f"a whole number ≥ 1, and {MAX_CELLS} cells a side at most",
    )  # fmt: skip
    spacing = check_spacing(spacing)
    drawn = (finer * shape[0], finer * shape[1])
    white = np.random.default_rng(seed).standard_normal(drawn) if sigma > 0 else np.zeros(drawn)
    heights, best = heights_of(
        white, gamma, (sigma, sigma_y), correlation, structure,
        spacing=spacing, iterations=iterations, finer=finer,
    )  # fmt: skip
    recipe: dict[str, Any] = {
        "gamma": float(gamma) if np.isfinite(gamma) else "inf",  # JSON has no infinity
        "sigma_x": float(sigma),
        "sigma_y": float(sigma_y),
        "cells": list(shape),
        "correlation": float(correlation),
        "structure": structure,
        "spacing": spacing,
        "seed": seed,
        "iterations": best,
        "finer": finer,
        "microsurf": __version__,
    }
    return Heightfield(heights, spacing, "periodic", recipe)


def heights_of(
    white: Array,
    gamma: float,
    sigma: tuple[float, float],
    correlation: float,
    structure: str,
    *,
    spacing: float = 1.0,
    iterations: int = ITERATIONS,
    finer: int = 1,
) -> tuple[Array, int]:
    """Heights whose facets follow STD, from white noise, and the iterations they took.

    Arguments as of `generate_surface`; ``white`` has ``finer`` times as many rows and columns.
    """
    if sigma[0] == 0:
        return np.zeros((white.shape[0] // finer, white.shape[1] // finer)), 0
    # σ's size is a factor of the heights; only the ratio takes part.
    size = float(np.sqrt(sigma[0]) * np.sqrt(sigma[1]))
    ratio_x, ratio_y = sigma[0] / size, sigma[1] / size
    field = gaussian_field(white, finer * correlation, ratio_x, ratio_y)
    field = np.ascontiguousarray(field[::finer, ::finer])
    field = impose(field, gamma, structure)
    heights, best = _alternate(field, gamma, ratio_x, ratio_y, iterations)
    heights *= size * spacing
    return heights, best


def from_recipe(recipe: Mapping[str, Any]) -> Heightfield:
    """Make the surface of a recipe again, as a worker does that gets no heights sent.

    Raises
    ------
    InputError
        If the recipe lacks an entry or an entry is out of range.

    """
    try:
        rows, columns = recipe["cells"]
        return generate_surface(
            float(recipe["gamma"]),
            float(recipe["sigma_x"]),
            float(recipe["sigma_y"]),
            cells=(int(rows), int(columns)),
            correlation=float(recipe["correlation"]),
            structure=recipe["structure"],
            spacing=float(recipe["spacing"]),
            seed=int(recipe["seed"]),
            iterations=int(recipe["iterations"]),
            finer=int(recipe.get("finer", 1)),  # recipes of earlier versions have none
        )
    except (KeyError, TypeError) as error:
        raise InputError(f"recipe {dict(recipe)}: not one of generate_surface ({error})") from error


def _check_std(gamma: float, sigma_x: float, sigma_y: float) -> None:
    require(gamma > 1.5, "gamma", gamma, "> 1.5 (below, the surface's area is infinite)")
    flat = sigma_x == 0 and sigma_y == 0
    require(
        flat or (0 < sigma_x <= MAX_SIGMA and 0 < sigma_y <= MAX_SIGMA),
        "sigma",
        (sigma_x, sigma_y),
        f"0 … {MAX_SIGMA:g}, both zero (flat) or both positive",
    )


def _check_cells(cells: int | tuple[int, int]) -> tuple[int, int]:
    shape = (cells, cells) if isinstance(cells, int) else tuple(cells)
    require(
        len(shape) == 2 and all(_whole(n) and 2 <= n <= MAX_CELLS for n in shape),
        "cells",
        cells,
        f"a whole number 2 … {MAX_CELLS}, or two (rows, columns)",
    )
    return int(shape[0]), int(shape[1])


def _whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _alternate(
    heights: Array, gamma: float, ratio_x: float, ratio_y: float, iterations: int
) -> tuple[Array, int]:
    """Return the heights of smallest KS distance and the number of iterations they took."""
    to_x, to_y = 1 / ratio_x, 1 / ratio_y
    # The field has no scale of its own: give it the target's median.
    heights = heights * (student_t.slope_quantile(0.5, gamma) / _median(heights, to_x, to_y))
    best, best_ks, best_at = heights, np.inf, 0
    threads = threads_for(heights.size)
    for iteration in range(iterations + 1):
        bins, ranks = _histogram(heights, to_x, to_y)
        edges = np.sqrt(rank_kernels.lower_edges(bins))
        ks = np.abs(student_t.slope_cdf(edges, gamma) - ranks[:-1] / ranks[-1]).max()
        if ks < best_ks or iteration == 1:  # the field itself has no tail, whatever its KS
            best, best_ks, best_at = heights, ks, iteration
        if iteration == iterations:
            break
        targets = _targets(bins, ranks, gamma)
        heights = _project(heights, to_x, to_y, targets, threads)
    return best, best_at


def _median(heights: Array, to_x: float, to_y: float) -> float:
    """Median of the facets' ρ."""
    squares = np.empty((2, *heights.shape))
    rank_kernels.fill_squares(heights, to_x, to_y, squares)
    flat = squares.ravel()
    flat.partition(heights.size)
    return float(np.sqrt(flat[heights.size]))


def _histogram(heights: Array, to_x: float, to_y: float) -> tuple[Integers, Integers]:
    """Return the bins of ρ² that hold facets, and how many facets lie below each, and in all."""
    # No facet is steeper than the whole range of heights across a cell.
    steepest = np.ptp(heights) ** 2 * (to_x**2 + to_y**2)
    counts = np.zeros(rank_kernels.bins_up_to(steepest) + 1, dtype=np.int64)
    rank_kernels.count_facets(heights, to_x, to_y, counts)
    bins = np.flatnonzero(counts)
    return bins, np.concatenate([[0], np.cumsum(counts[bins])])


def _targets(bins: Integers, ranks: Integers, gamma: float) -> Array:
    """Return the squared quantiles of `scaled_divergence` for bins and ranks of `_histogram`.

    The facets of a bin take the quantiles of its first to its last rank, evenly.
    """
    count = ranks[-1]
    first = ranks + 0.5
    first[-1] -= 1  # the last facet's: beyond it is nothing
    squares = student_t.slope_quantile(first / count, gamma) ** 2
    inside = np.diff(ranks) - 1
    rises = np.diff(squares) * (inside / np.maximum(np.diff(first), 1))
    targets = np.zeros((bins[-1] + 1, 2))
    targets[bins, 0], targets[bins, 1] = squares[:-1], rises / rank_kernels.INSIDE
    return targets


def _project(heights: Array, to_x: float, to_y: float, targets: Array, threads: int = 1) -> Array:
    """Return the heights nearest to the facets' slopes once these are rescaled: Poisson's equation.

    Differences along an axis have the squared spectrum 4 sin²(k/2).
    """
    rows, columns = heights.shape
    divergence, scratch = np.empty_like(heights), np.empty((2, columns))
    rank_kernels.scaled_divergence(heights, to_x, to_y, targets, scratch, divergence)
    spectrum = fft.rfft2(divergence, workers=threads)
    rank_kernels.divide_by_laplacian(
        spectrum.view(np.float64),
        (2 * to_x * np.sin(np.pi * fft.rfftfreq(columns))) ** 2,
        (2 * to_y * np.sin(np.pi * fft.fftfreq(rows))) ** 2,
    )
    return np.asarray(fft.irfft2(spectrum, heights.shape, workers=threads, overwrite_x=True))
