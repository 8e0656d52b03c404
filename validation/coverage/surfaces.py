"""Do intervals of γ and σ hold the truth where a surface has voids, a trend, oblong pixels.

γ 2.5, σ 0.3; a frame of 1 % lies between none and one of 5 %, so it is not drawn.

    python -m validation.coverage.surfaces [--count 160] [--cells 512] [--out FILE.csv]

Surfaces are cut out of larger ones: a whole period has the slopes it was made with, but for
rounding, and any interval would hold them. What is finished is kept in reports/latest: the same
command goes on after a stop.
"""

import argparse
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, stats

from microsurf.cli.save import rounded, save
from microsurf.errors import InputError
from microsurf.surface import Heightfield, fit_std, from_array, generate_surface, level

from ..checkpoint import LATEST, once

Array = NDArray[np.float64]

GAMMA, SIGMA = 2.5, 0.3
ACROSS = 4  # cut-outs a side of one surface
OBLONG = 1.5
SHARES = (0.01, 0.05, 0.2)
_BLOB = 4.0  # cells, the deviation of the noise whose hills are voids
OUT = Path(__file__).parents[2] / "reports" / "coverage" / "surfaces.csv"
Kind = tuple[str, Callable[[Array, np.random.Generator], Heightfield]]


def cut_out(number: int, cells: int, along_y: float = 1.0) -> Array:
    """One of the cut-outs of a surface whose σ along y is so many times that along x."""
    whole, part = divmod(number, ACROSS**2)
    made = _whole(whole, cells, along_y)
    y, x = divmod(part, ACROSS)
    return made[y * cells : (y + 1) * cells, x * cells : (x + 1) * cells]


_made: dict[tuple[int, int, float], Array] = {}


def _whole(number: int, cells: int, along_y: float) -> Array:
    key = (number, cells, along_y)
    if key not in _made:
        for other in [k for k in _made if k[0] != number]:
            del _made[other]
        large = generate_surface(
            GAMMA, SIGMA, along_y * SIGMA, cells=ACROSS * cells, seed=1000 + number
        )
        _made[key] = large.heights
    return _made[key]


def frame(shape: tuple[int, int], share: float, _: np.random.Generator) -> NDArray[np.bool_]:
    """Voids all around, of one width."""
    rows, columns = shape
    root = np.sqrt((rows - columns) ** 2 + 4 * (1 - share) * rows * columns)
    width = round((rows + columns - root) / 4)
    void = np.ones(shape, dtype=np.bool_)
    void[width : rows - width, width : columns - width] = False
    return void


def scattered(shape: tuple[int, int], share: float, rng: np.random.Generator) -> NDArray[np.bool_]:
    """Voids that know nothing of each other."""
    return rng.random(shape) < share


def blobs(shape: tuple[int, int], share: float, rng: np.random.Generator) -> NDArray[np.bool_]:
    """Voids in patches: where smooth noise is highest."""
    noise = ndimage.gaussian_filter(rng.standard_normal(shape), _BLOB)
    return np.asarray(noise > np.quantile(noise, 1 - share))


def steep(heights: Array, share: float) -> NDArray[np.bool_]:
    """Voids where the surface is steepest, as light that does not come back leaves them."""
    slope = np.hypot(*np.gradient(heights))
    return np.asarray(slope > np.quantile(slope, 1 - share))


def _plain(heights: Array, _: np.random.Generator) -> Heightfield:
    return Heightfield(heights, 1.0, "mirror")


def _trend(heights: Array, _: np.random.Generator) -> Heightfield:
    """A tilt of 0.2 and a bow of as much at its ends, taken off again."""
    rows, columns = heights.shape
    y, x = np.ogrid[:rows, :columns]
    bow = 0.1 * ((x - columns / 2) ** 2 / columns + (y - rows / 2) ** 2 / rows)
    return level(Heightfield(heights + 0.2 * x - 0.1 * y + bow, 1.0, "mirror"), "quadratic")


def _oblong(heights: Array, _: np.random.Generator) -> Heightfield:
    return Heightfield(heights, (1.0, OBLONG), "mirror")


def _void(
    heights: Array,
    rng: np.random.Generator,
    *,
    where: Callable[..., NDArray[np.bool_]],
    share: float,
    choice: str,
) -> Heightfield:
    gaps = np.where(where(heights.shape, share, rng), np.nan, heights)
    return from_array(gaps, 1.0, "mirror", choice)


def _steep(heights: Array, _: np.random.Generator) -> Heightfield:
    return from_array(np.where(steep(heights, 0.01), np.nan, heights), 1.0, "mirror", "fill")


def kinds() -> Iterator[Kind]:
    """What is done to a cut-out, by name."""
    yield "nothing", _plain
    yield "tilt and bow, levelled", _trend
    yield f"dy = {OBLONG} dx", _oblong
    for choice, shapes in (("fill", (frame, scattered, blobs)), ("crop", (frame, blobs))):
        for where in shapes:
            for share in SHARES[1:] if where is frame else SHARES:
                name = f"{where.__name__} of {share:.0%}, {choice}"
                yield name, partial(_void, where=where, share=share, choice=choice)
    yield "the steepest 1%, fill", _steep


def fits(number: int, cells: int) -> list[dict[str, Any]]:
    """All kinds of one cut-out, fitted."""
    result = []
    for place, (name, change) in enumerate(kinds()):
        along_y = OBLONG if change is _oblong else 1.0
        rng = np.random.default_rng([number, place])
        row: dict[str, Any] = {"kind": name}
        try:
            fit = fit_std(change(cut_out(number, cells, along_y), rng))
        except InputError:
            result.append(row | {"refused": True})
            continue
        ends = {"gamma": (fit.gamma, *fit.gamma_ci), "sigma": (fit.sigma, *fit.sigma_ci)}
        result.append(row | {"refused": False, "isotropic": fit.isotropic, **ends})
    return result


def rows(drawn: Iterable[list[dict[str, Any]]]) -> Iterator[dict[str, Any]]:
    """For each kind how often both intervals hold the truth, and how wide they are."""
    by_kind: dict[str, list[dict[str, Any]]] = {}
    for one in drawn:
        for row in one:
            by_kind.setdefault(row["kind"], []).append(row)
    for kind, of in by_kind.items():
        fitted = [row for row in of if not row["refused"]]
        table: dict[str, Any] = {
            "kind": kind,
            "surfaces": len(of),
            "refused": len(of) - len(fitted),
        }
        for key, truth in (("gamma", GAMMA), ("sigma", SIGMA)):
            value, low, high = np.array([row[key] for row in fitted]).reshape(-1, 3).T
            held = int(np.sum((low <= truth) & (truth <= high)))
            least, most = exact_interval(held, len(fitted))
            table |= {
                f"{key}_held": held,
                f"{key}_low": least,
                f"{key}_high": most,
                f"{key}_bias": float(np.median(value) / truth - 1) if fitted else None,
                f"{key}_reach": float(np.median(high - low) / 2 / truth) if fitted else None,
            }
        yield table | {"directed": sum(not row["isotropic"] for row in fitted)}


def exact_interval(held: int, count: int) -> tuple[float, float]:
    """95 % interval of a rate (Clopper and Pearson 1934)."""
    low = float(stats.beta.ppf(0.025, held, count - held + 1)) if held else 0.0
    high = float(stats.beta.ppf(0.975, held + 1, count - held)) if held < count else 1.0
    return low, high


def main() -> None:
    """Write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=160)
    parser.add_argument("--cells", type=int, default=512)
    parser.add_argument("--out", type=Path, default=OUT)
    asked = parser.parse_args()
    kept = LATEST / "coverage" / f"surfaces-{asked.cells}"
    drawn = [
        once(kept / f"{number}.json", partial(fits, number, asked.cells))
        for number in range(asked.count)
    ]
    asked.out.parent.mkdir(parents=True, exist_ok=True)
    save(asked.out.parent, {asked.out.name: rounded(rows(drawn), 3)})


if __name__ == "__main__":
    main()
