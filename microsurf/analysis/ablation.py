"""What each effect contributes to a scene, measured by switching it off.

By smith-walk with and without, the same numbers of walks, so that an effect's size does not
take in what separates theory from geometry; structures by explicit surfaces, which alone
have one. Several angles and Kd: the largest change counts.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .. import model
from ..physics import student_t
from ..results import peak
from ..scene import BECKMANN, STRUCTURES, Effects, Roughness, Scene
from ..stats import intervals
from .tradeoff import pareto
from .tradeoff.methods import Draws, Place, draws_of, joined, trace_surfaces

Array = NDArray[np.float64]

WALKS, RUNS = 100_000, 4
_SURFACES, _PATHS = 4, 16_384


@dataclass(frozen=True)
class Effect:
    """Change of a quantity if an effect is left out, relative, with its 95 % interval.

    Signed for albedo and peak; of a lobe the distance. ``how`` says what took its place.
    """

    name: str
    how: str
    change: float
    low: float
    high: float


def contributions(scene: Scene, quantity: str, *, seed: int = 0) -> list[Effect]:
    """All effects that the scene has; quantity is "albedo", "peak" or "lobe"."""
    if not scene.requires.roughness:
        return []
    base = _walked(scene, seed)
    effects = []
    for name, how, without in _switched(scene):
        nothing = not (without.requires.interface or without.requires.substrate)
        other = _nothing(base) if nothing else _walked(without, seed)
        effects.append(Effect(name, how, *_change(other, base, quantity)))
    effects.append(
        Effect(
            "masking", "V-cavities (vcavity-walk) instead of independent heights",
            *_change(_walked(scene, seed, "vcavity-walk"), base, quantity),
        )
    )  # fmt: skip
    return effects + list(_structures(scene, quantity, seed))


def _switched(scene: Scene) -> Iterator[tuple[str, str, Scene]]:
    """Each effect's name, what takes its place, and the scene without it."""
    needs, material, rough = scene.requires, scene.material, scene.roughness
    if needs.interface and not material.conductor:
        yield "interface", "n = 1", replace(scene, material=replace(material, n=1.0))
    if needs.substrate and needs.interface:
        yield "substrate", "Kd = 0", replace(scene, material=replace(material, kd=(0.0,)))
    if needs.multiple_scattering:
        yield (
            "multiple scattering",
            "first order alone",
            replace(scene, effects=Effects(multiple_scattering=False)),
        )
    if not rough.isotropic:
        mean = float(np.sqrt(rough.sigma_x * rough.sigma_y))
        how = f"σ = {mean:.3g}, isotropic"
        yield "anisotropy", how, replace(scene, roughness=replace(rough, sigma=(mean,)))
    if rough.gamma < BECKMANN:
        median = student_t.slope_quantile(0.5, rough.gamma) / student_t.slope_quantile(0.5, np.inf)
        sigma = tuple(float(median) * s for s in rough.sigma)
        how = "Beckmann of the same median slope, σ = " + ", ".join(f"{s:.3g}" for s in sigma)
        yield "tail of the slopes", how, replace(scene, roughness=Roughness(BECKMANN, sigma))


def _structures(scene: Scene, quantity: str, seed: int) -> Iterator[Effect]:
    """Surfaces of every other structure that can be made, against the scene's own."""
    others = [name for name in STRUCTURES if name != scene.surface.structure]
    base = _traced(scene, scene.surface.structure, seed) if others else {}
    for k, name in enumerate(others):
        change = _change(_traced(scene, name, seed + 1 + k), base, quantity)
        how = f"{name} instead of {scene.surface.structure}"
        yield Effect("structure", how, *change)


def _walked(scene: Scene, seed: int, kind: str = "smith-walk") -> dict[Place, Draws]:
    runs = [
        draws_of(model.walk(scene, kind, walks=WALKS, seed=seed + 1000 * k, workers=1), scene)
        for k in range(RUNS)
    ]
    return joined(runs)


def _traced(scene: Scene, structure: str, seed: int) -> dict[Place, Draws]:
    surface = replace(scene.surface, structure=structure)
    return trace_surfaces(scene, surface, _PATHS, _SURFACES, seed)


def _nothing(base: dict[Place, Draws]) -> dict[Place, Draws]:
    return {
        index: Draws(draws.albedo * 0, draws.specular * 0, draws.lobe * 0)
        for index, draws in base.items()
    }


def _change(
    without: dict[Place, Draws], base: dict[Place, Draws], quantity: str
) -> tuple[float, float, float]:
    """Largest change over places; without a substrate all Kd have one place."""
    of = _lobe if quantity == "lobe" else _scalar(quantity)
    changes = [
        of(without.get(index) or without[*index[:2], 0.0], draws) for index, draws in base.items()
    ]
    return max(changes, key=lambda change: abs(change[0]))


def _lobe(without: Draws, base: Draws) -> tuple[float, float, float]:
    error = pareto.error(pareto.squared([(without.lobe, base.lobe)], np.inf))
    return error.value, error.low, error.high


def _scalar(quantity: str) -> Callable[[Draws, Draws], tuple[float, float, float]]:
    def values(draws: Draws, width: float) -> Array:
        if quantity == "albedo":
            return draws.albedo[:, 0]
        cuts = peak.cut(draws.specular, width)
        height = pareto.pseudo_values(cuts, lambda cut: peak.figures(cut)[:1])
        return np.asarray(height[:, 0])

    def change(without: Draws, base: Draws) -> tuple[float, float, float]:
        width = peak.weight_width(base.specular.mean(axis=0)) if quantity == "peak" else 1.0
        of, on = values(without, width), values(base, width)
        value = float(of.mean() / on.mean() - 1)
        # Of the ratio, to first order.
        rest = (of - of.mean() - (1 + value) * (on - on.mean())) / on.mean()
        count = len(rest)
        factor = intervals.student(count - 1)
        half = factor * float(np.sqrt((rest**2).sum() / (count * (count - 1))))
        return value, value - half, value + half

    return change
