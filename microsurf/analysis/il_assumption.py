"""What one interfaced-Lambertian facet in the place of two explicit layers costs.

A facet takes for granted that light leaves where it entered, from a substrate parallel to the
interface. The atlas (reports/layers) traced both on the same interfaces, at γ, σ, n, Kd, gaps,
correlations and roughnesses of the substrate; its figures are in il_assumption.csv. Here
they answer for scenes between those that were traced: the worst of all neighbours stands,
nothing is interpolated, and what lies outside is refused. Between them it is no bound.
"""

import csv
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib import resources
from itertools import product
from typing import Any

from ..scene import Scene

AXES = (
    "gamma", "sigma", "n", "substrate_over_interface", "correlation", "gap_over_length", "kd",
)  # fmt: skip
"""Columns of the table by which a scene is looked up; substrate_over_interface is σ over σ,
the gap is in correlation lengths of the interface."""
MOST_THETA = 80.0
"""Degrees: the table holds the worst of incidences up to here."""
QUANTITIES = {"albedo": "total", "lobe": "lobe", "peak": "peak"}
"""Columns of the table by the names that `microsurf advise` has; a specular peak is the same."""
LEVELS = (1.0, 3.0, 10.0)
"""Percent: what a facet is said to be good to."""

Key = tuple[float, ...]


@dataclass(frozen=True)
class Deviation:
    """How far IL facets are from two layers, relative, and the ends of its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Answer:
    """What the atlas says of a scene.

    ``deviation`` is that of the worst neighbour, None if the atlas does not answer; ``text`` is
    one line, which then says why.
    """

    text: str
    deviation: Deviation | None = None
    neighbours: int = 0


@cache
def table() -> dict[Key, dict[str, Deviation]]:
    """The committed figures by AXES, of the total and of the body lobe."""
    text = resources.files(__package__).joinpath("il_assumption.csv").read_text(encoding="utf-8")
    return {
        tuple(float(row[axis]) for axis in AXES): {
            name: Deviation(*(float(row[f"{name}{end}"]) / 100 for end in ("", "_low", "_high")))
            for name in ("total", "lobe")
        }
        for row in csv.DictReader(text.splitlines())
    }


def answer(scene: Scene, quantity: str = "albedo") -> Answer:
    """Say how far IL facets are from the two layers of a scene, the worst of its Kd.

    Without layers: up to which gap they stand for a substrate of the same relief.

    Parameters
    ----------
    scene : Scene
        With or without layers.
    quantity : str
        "albedo", "lobe" (the body lobe, root mean square over its bins) or "peak".

    """
    if quantity == "peak":
        return Answer("the specular peak is the same over one facet and over two layers", SAME)
    why = _outside(scene)
    if why:
        return Answer(f"IL assumption: not in the atlas ({why}); nothing is extrapolated")
    if scene.layers is None:
        return _up_to_which_gap(scene, quantity)
    return _between(scene, scene.layers.gap / scene.surface.correlation, quantity)


SAME = Deviation(0.0, 0.0, 0.0)


def _outside(scene: Scene) -> str:
    """Why the atlas can't answer for a scene, whatever its gap; empty if it can."""
    needs, surface = scene.requires, scene.surface
    reasons = {
        "a conductor": scene.material.conductor,
        "no interface or no substrate": not (needs.interface and needs.substrate),
        "a flat interface": scene.roughness.sigma_x == 0,
        "surfaces from files": surface.file is not None,
        f"structure {surface.structure}": surface.structure != "independent",
        "an anisotropic interface": scene.roughness.sigma_x != scene.roughness.sigma_y,
        f"θ_i above {MOST_THETA:g}°": max(scene.light.theta) > MOST_THETA,
    }
    if scene.layers is not None:
        lower = scene.layers.substrate
        reasons |= {
            "a substrate from a file": lower.file is not None,
            "an anisotropic substrate": not lower.isotropic,
            "absorption": scene.layers.absorption > 0,
            f"a substrate of γ = {lower.gamma} under one of γ = {scene.roughness.gamma:g}": (
                lower.gamma is not None
                and lower.gamma != scene.roughness.gamma
                and bool(lower.sigma and lower.sigma[0])
            ),
        }
    return next((why for why, applies in reasons.items() if applies), "")


def _substrate(scene: Scene) -> tuple[float, float]:
    """σ of the substrate over that of the interface, and their correlation; without layers 1."""
    lower = scene.layers.substrate if scene.layers is not None else None
    if lower is None or (lower.shape == "same" and lower.sigma is None):
        return 1.0, 1.0
    if lower.shape == "flat" or not lower.sigma or lower.sigma[0] == 0:
        return 0.0, 0.0
    ratio = lower.sigma[0] / scene.roughness.sigma_x
    return ratio, 1.0 if lower.shape == "same" else lower.correlation_with_interface


def _between(scene: Scene, gap: float, quantity: str) -> Answer:
    """The worst of the neighbours of a scene whose gap is so many correlation lengths."""
    column = QUANTITIES[quantity]
    worst, count = SAME, 0
    for kd in scene.material.kd:
        values = (
            scene.roughness.gamma, scene.roughness.sigma_x, scene.material.n,
            *_substrate(scene), gap, kd,
        )  # fmt: skip
        outside = _beyond(values)
        if outside:
            return Answer(f"IL assumption: not in the atlas ({outside}); nothing is extrapolated")
        keys = {_key(corner) for corner in product(*_brackets(values))}
        if any(key not in table() for key in keys):
            return Answer(
                "IL assumption: not in the atlas (a neighbour was not traced, or its surfaces "
                "cross); nothing is extrapolated"
            )
        count = max(count, len(keys))
        worst = max(worst, *(table()[key][column] for key in keys), key=lambda d: d.high)
    return Answer(_line(quantity, worst, count), worst, count)


def _line(quantity: str, worst: Deviation, neighbours: int) -> str:
    level = next((level for level in LEVELS if 100 * worst.high <= level), None)
    good = f"is good to {level:g} %" if level else f"is not good to {LEVELS[-1]:g} %"
    what = "the total" if quantity == "albedo" else "the body lobe"
    return (
        f"IL assumption: a single IL facet {good} here in {what}: off by {100 * worst.value:.2g} % "
        f"({100 * worst.low:.2g} … {100 * worst.high:.2g}), the worst of {neighbours} "
        f"neighbour{'s' * (neighbours > 1)} in the atlas and of θ_i up to {MOST_THETA:g}°"
    )


def _up_to_which_gap(scene: Scene, quantity: str) -> Answer:
    """Of a scene of IL facets: gaps at which a substrate of the same relief is as good as they."""
    limits = []
    for level in LEVELS:
        held = None
        for gap in _axis(AXES.index("gap_over_length")):
            at = _between(scene, gap, quantity)
            if at.deviation is None:
                return at
            if 100 * at.deviation.high > level:
                break
            held = gap
        limits.append(f"{level:g} % {'at no gap in it' if held is None else f'up to {held:g} L'}")
    what = "total" if quantity == "albedo" else "body lobe"
    return Answer(
        f"IL assumption: a substrate of the interface's relief at a gap below it has the {what} of "
        f"these facets within {', '.join(limits)} (atlas: gaps of 0.02 to 10 correlation lengths L)"
    )


def _axis(column: int) -> list[float]:
    """Values that were traced."""
    return sorted({key[column] for key in table()})


def _beyond(values: Key) -> str:
    """Which value lies outside of what was traced; empty if none."""
    for column, value in enumerate(values):
        traced = _axis(column)
        if not traced[0] <= value <= traced[-1]:
            return f"{AXES[column]} = {value:.3g}, traced {traced[0]:g} … {traced[-1]:g}"
    return ""


def _brackets(values: Key) -> Iterator[tuple[float, ...]]:
    """Of each value those next to it that were traced, itself if it was."""
    for column, value in enumerate(values):
        traced = _axis(column)
        if value in traced:
            yield (value,)
        else:
            yield (max(x for x in traced if x < value), min(x for x in traced if x > value))


def _key(corner: Key) -> Key:
    """As the table has it: a plane has the correlation 0."""
    ratio, correlation = (AXES.index(x) for x in ("substrate_over_interface", "correlation"))
    if corner[ratio] > 0:
        return corner
    return (*corner[:correlation], 0.0, *corner[correlation + 1 :])


def as_json(said: Answer) -> dict[str, Any]:
    """What `advise --json` and report.json hold of it."""
    of = said.deviation
    return {
        "text": said.text,
        "error": None if of is None else of.value,
        "error_ci": None if of is None else [of.low, of.high],
        "neighbours": said.neighbours,
    }
