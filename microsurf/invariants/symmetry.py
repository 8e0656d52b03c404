"""What may not depend on where a surface lies, how it is turned, or in which unit it is given."""

from collections.abc import Iterator
from concurrent.futures import Executor
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..scene import Accuracy, Light, Scene, Surface
from ..surface import Heightfield, generate_surface
from ..trace import measure
from ..trace.engine import AUTO, AnyTile
from . import false_alarms
from .invariant import Invariant
from .reciprocity import IL, KD, skewed
from .replicates import FEATURES, differing, features, runs, tile_of

Array = NDArray[np.float64]

LIGHT = (60.0, 30.0)
PATHS = 8000


def moved(heights: Array, engine: str = AUTO) -> Iterator[tuple[str, AnyTile, float, float]]:
    """The same surface put down otherwise: name, mesh, azimuth of the light, and its handedness.

    A quarter turn and a mirror exchange the two diagonals of a cell.
    """
    back = -np.arange(len(heights))
    phi = LIGHT[1]
    build = partial(tile_of, engine=engine)
    yield "as it is", build(heights), phi, 1.0
    yield "half turn", build(heights[back][:, back]), phi + 180, 1.0
    yield "quarter turn", build(heights.T[:, back], flipped=True), phi + 90, 1.0
    yield "mirror", build(heights[:, back], flipped=True), 180 - phi, -1.0
    yield "shifted", build(np.roll(heights, (11, 23), (0, 1))), phi, 1.0
    yield "two periods", build(np.tile(heights, (2, 1))), phi, 1.0


def features_of(
    pool: Executor, tile: AnyTile, phi: float, hand: float, seed_words: tuple[int, ...]
) -> Array:
    """FEATURES by run; ``hand`` −1 exchanges left and right of the plane of incidence."""
    of_one = partial(features, n=IL.n, kd=KD)
    replicates = runs(pool, tile, (LIGHT[0], phi), IL, PATHS, seed_words, of_one)
    replicates[:, FEATURES.index("sideways")] *= hand
    return replicates


def symmetries(pool: Executor, seed: int, engine: str = AUTO) -> Iterator[Invariant]:
    """Turn and shift a surface that has no symmetry of its own."""
    heights = skewed(seed)
    lots = {
        name: features_of(pool, tile, phi, hand, (seed, 5, k))
        for k, (name, tile, phi, hand) in enumerate(moved(heights, engine))
    }
    base = lots["as it is"]
    for name, statement, which in (
        (
            "rotation",
            "surface and light turned or mirrored together: nothing changes",
            ("half turn", "quarter turn", "mirror"),
        ),
        (
            "period shift",
            "a period has no beginning: the surface shifted or repeated reflects as before",
            ("shifted", "two periods"),
        ),
    ):
        yield false_alarms.by_chance(
            name,
            statement,
            [false_alarms.between(lots[key], base) for key in which],
            f"{', '.join(which)} by {', '.join(FEATURES)}; a skewed anisotropic surface, light "
            f"from θ = {LIGHT[0]:g}°, φ = {LIGHT[1]:g}°",
            {
                f"{key}, {feature}: difference": float(lots[key][:, k].mean() - base[:, k].mean())
                for key in which
                for k, feature in enumerate(FEATURES)
            },
        )


def unit_of_length(seed: int, workers: int | None, engine: str = AUTO) -> Iterator[Invariant]:
    """Heights and spacing in other units."""
    scene = Scene(
        light=Light((60.0,)),
        surface=Surface(realisations=1),
        accuracy=Accuracy(50_000, engine=engine),
    )
    surface = generate_surface(2.0, 0.5, cells=64, seed=seed)

    def measured(unit: float) -> tuple[Array, float, float]:
        result = measure(
            scene, [Heightfield(surface.heights * unit, unit)], seed=seed, workers=workers
        )
        value, error = (
            float(of().item()) for of in (result.microsurf.albedo, result.microsurf.ray_error)
        )
        return result.flux.values, value, error

    base, value, error = measured(1.0)
    differ = sum(differing(measured(unit)[0], base) for unit in (2.0**-30, 2.0**10))
    yield Invariant(
        "scale, powers of two",
        "the unit of length changes no bit of the result, if it is a power of two",
        float(differ),
        0.0,
        f"bins that differ, of {2 * base.size}, units 2⁻³⁰ and 2¹⁰; division by 2 is exact",
    )
    gaps = {f"unit {unit:g}": (measured(unit)[1] - value) / error for unit in (1e-9, 1e3)}
    yield false_alarms.by_chance(
        "scale, any unit",
        "the unit of length changes nothing that can be seen",
        list(gaps.values()),
        "|Δ albedo| in standard errors, units 1e−9 and 1e3; heights are rounded once more, by "
        "2⁻⁵³: as a rule float32 vertices are the same, else rays are other random ones",
        gaps,
    )
