"""Do intervals of the azimuth of a lay hold the truth, and is a lay always noticed.

    python -m validation.coverage.axes [--count 320] [--cells 512] [--out FILE.csv]

γ 2.5, axes of 1 : 2 turned by 0, 17 and 45°, cut out of larger surfaces as in `surfaces`.
What is finished is kept in reports/latest: the same command goes on after a stop.
"""

import argparse
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from microsurf.cli.save import rounded, save
from microsurf.surface import Heightfield, fit_std
from microsurf.surface.structures import impose

from ..checkpoint import LATEST, once
from .surfaces import GAMMA, exact_interval

Array = NDArray[np.float64]

LENGTHS = (6.0, 12.0)
"""Cells of correlation along the axes: σ is in their inverse ratio."""
AZIMUTHS = (0.0, 17.0, 45.0)
ACROSS = 2  # cut-outs a side of one surface
OUT = Path(__file__).parents[2] / "reports" / "coverage" / "axes.csv"


def turned(
    cells: int,
    lengths: tuple[float, float],
    azimuth: float,
    rng: np.random.Generator,
    gamma: float = np.inf,
) -> Heightfield:
    """Return a surface whose slopes have σ ∝ 1/lengths along axes turned by so many degrees.

    Gaussian of autocorrelation exp(−dᵀ A d): its slopes have the covariance 2A. A function
    of it has STD's slopes of the same axes, see `structures`.
    """
    turn = np.radians(azimuth)
    axes = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    inverse = axes @ np.diag(np.square(lengths)) @ axes.T
    k_y, k_x = np.meshgrid(*[2 * np.pi * np.fft.fftfreq(cells)] * 2, indexing="ij")
    power = inverse[0, 0] * k_x**2 + 2 * inverse[0, 1] * k_x * k_y + inverse[1, 1] * k_y**2
    noise = np.fft.fft2(rng.normal(size=(cells, cells)))
    field = np.fft.ifft2(noise * np.exp(-power / 8)).real
    return Heightfield(impose(field / field.std(), gamma, "tops"))


def facet_azimuth(lengths: tuple[float, float], azimuth: float) -> float:
    """Azimuth in degrees of the mean squares of facets that are one cell wide, both splits.

    Differences over a cell are smaller than slopes, most along the rougher axis: an axis
    leans towards the grid's. Exact for a Gaussian surface of autocorrelation exp(−dᵀ A d).
    """
    turn = np.radians(azimuth)
    axes = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    inverse = axes @ np.diag(1 / np.square(lengths)) @ axes.T

    def correlation(x: int, y: int) -> float:
        step = np.array([x, y])
        return float(np.exp(-step @ inverse @ step))

    difference = 2 * (correlation(0, 1) - correlation(1, 0))
    product = (correlation(1, -1) - correlation(1, 1)) / 2
    return float(np.degrees(np.arctan2(2 * product, difference) / 2))


def fits(number: int, cells: int) -> list[dict[str, Any]]:
    """Fit the cut-outs of one surface at each azimuth."""
    result = []
    for azimuth in AZIMUTHS:
        rng = np.random.default_rng([number, int(azimuth)])
        heights = turned(ACROSS * cells, LENGTHS, azimuth, rng, GAMMA).heights
        for y, x in np.ndindex(ACROSS, ACROSS):
            part = heights[y * cells : (y + 1) * cells, x * cells : (x + 1) * cells]
            fit = fit_std(Heightfield(part, 1.0, "mirror"))
            ends = None if fit.azimuth is None else (fit.azimuth, *(fit.azimuth_ci or ()))
            ratio = max(fit.sigma_x, fit.sigma_y) / min(fit.sigma_x, fit.sigma_y)
            result.append({"azimuth": azimuth, "fitted": ends, "ratio": ratio})
    return result


def rows(drawn: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    """For each azimuth how often its interval holds it, and how wide that is, in degrees."""
    for azimuth in AZIMUTHS:
        of = [row for row in drawn if row["azimuth"] == azimuth]
        ends = np.array([row["fitted"] for row in of if row["fitted"]]).reshape(-1, 3)
        # Either axis may be the one nearer to x.
        off = (ends[:, 0] - azimuth + 45) % 90 - 45
        half = (ends[:, 2] - ends[:, 1]) / 2
        lean = facet_azimuth(LENGTHS, azimuth) - azimuth
        held = int(np.sum(np.abs(off) <= half))
        low, high = exact_interval(held, len(of))
        yield {
            "azimuth": azimuth,
            "surfaces": len(of),
            "lay_noticed": len(ends),
            "held": held,
            "held_low": low,
            "held_high": high,
            "lean_of_facets": lean,
            "facets_held": int(np.sum(np.abs(off - lean) <= half)),
            "bias": float(np.median(off)),
            "scatter": float(off.std(ddof=1)),
            "reach": float(np.median(half)),
            "ratio": float(np.median([row["ratio"] for row in of])),
        }


def main() -> None:
    """Write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=320)
    parser.add_argument("--cells", type=int, default=512)
    parser.add_argument("--out", type=Path, default=OUT)
    options = parser.parse_args()
    kept = LATEST / "coverage" / f"axes-{options.cells}"
    drawn = [
        row
        for number in range(-(-options.count // ACROSS**2))
        for row in once(kept / f"{number}.json", partial(fits, number, options.cells))
    ]
    options.out.parent.mkdir(parents=True, exist_ok=True)
    save(options.out.parent, {options.out.name: rounded(rows(drawn), 3)})


if __name__ == "__main__":
    main()
