"""Which mesh, how many surfaces and rays an accuracy takes, and what they cost, before they run.

The mesh is the coarsest whose error was *measured* to be within the one asked for (95 % ends of
`microsurf convergence` on built-in scenes, see `MESH_ERROR`); where none was, the finest of
these, and the plan says so. Rays and surfaces come from a pilot on four surfaces of that mesh,
see `allocation`.
"""

import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .. import memory
from ..results import uncertainty
from ..scene import Scene
from ..surface import surfaces_of
from ..trace import engine, measure
from .allocation import PILOT_PATHS, PILOT_SURFACES, Wanted, cheapest, wanted_of

TILE = 64
"""Side of the tile in correlation lengths: at twice that no built-in scene differed (95 %)."""

MESH_ERROR = {
    1.75: {2.0: 7.9e-3, 4.0: 5.3e-3, 8.0: 4.6e-3},
    2.0: {2.0: 3.1e-3, 4.0: 2.4e-3, 8.0: 2.0e-3},
    8.0: {2.0: 4.6e-4, 4.0: 4.3e-4, 8.0: 3.3e-4},
}
"""By γ and cells a correlation length: the 95 % end of the difference of the total albedo to
a mesh of 16, at the worst of 0, 30, 60, 80° (reports/convergence)."""


@dataclass(frozen=True)
class Plan:
    """What will run.

    Attributes
    ----------
    scene : Scene
        With the mesh, the realisations and the paths that are planned.
    mesh_error : float or None
        95 % bound of the mesh's error in the total albedo; None where nothing was measured.
    error, lobe_error : float
        Expected standard errors: the worst of the total albedos, and of the lobes relative to
        themselves.
    seconds : float
        Expected, on this machine as busy as it was during the pilot.
    memory : float
        Bytes, at most.
    notes : tuple of str
        What the plan can't promise.

    """

    scene: Scene
    mesh_error: float | None
    error: float
    lobe_error: float
    seconds: float
    memory: float
    notes: tuple[str, ...]

    def begun(self, scene: Scene) -> Scene:
        """The scene that asked for an error, to begin with half of the planned surfaces.

        More are added until the error is reached; with as many each needs fewer rays. Half,
        because the four of the pilot know their spread to a factor of two or three only.
        """
        planned = self.scene.surface.realisations
        least = max(scene.surface.realisations, planned // 2)
        return replace(scene, surface=replace(scene.surface, realisations=least))

    def as_json(self) -> dict[str, Any]:
        """The figures, under plain names."""
        surface = self.scene.surface
        return {
            "cells": surface.cells,
            "correlation": surface.correlation,
            "realisations": surface.realisations,
            "paths": self.scene.accuracy.paths,
            "expected_error": self.error,
            "expected_lobe_error": self.lobe_error,
            "mesh_error": self.mesh_error,
            "seconds": self.seconds,
            "memory_bytes": self.memory,
            "notes": list(self.notes),
        }

    def lines(self) -> list[str]:
        """The same for people."""
        surface, angles = self.scene.surface, self.scene.light.angles
        what = "plane"
        if self.scene.requires.roughness:
            what = surface.file or f"{surface.cells}² cells, L = {surface.correlation:g}"
        mesh = "" if self.mesh_error is None else f"; mesh ± {self.mesh_error:.1g} at most (95 %)"
        runs = f"{surface.realisations} × {what}, {self.scene.accuracy.paths} paths"
        costs = f"about {_duration(self.seconds)} and {memory.gibibytes(self.memory)}"
        errors = f"of albedos {self.error:.2g}, of lobes {self.lobe_error:.2g} of themselves"
        return [
            f"plan: {runs} for each of {angles} angles; {costs}",
            f"expected: standard error {errors}{mesh}",
            *(f"note: {note}" for note in self.notes),
        ]


def _duration(seconds: float) -> str:
    units = (("s", 1, 120), ("min", 60, 120), ("h", 3600, 48), ("days", 86400, np.inf))
    return next(f"{seconds / one:.0f} {name}" for name, one, most in units if seconds < most * one)


def with_mesh(scene: Scene) -> Scene:
    """The scene on the coarsest mesh that was measured to be good enough for its accuracy.

    Scenes without a generated surface, or that ask for no error, are returned as they are.
    """
    target = scene.accuracy.standard_error
    if target is None or not scene.requires.roughness or scene.surface.file is not None:
        return scene
    leaves = _measured(scene)
    length = min((step for step, error in leaves.items() if error <= target), default=max(leaves))
    surface = replace(scene.surface, cells=round(TILE * length), correlation=length)
    return replace(scene, surface=surface)


def _measured(scene: Scene) -> dict[float, float]:
    """What meshes leave at the nearest γ that is no lighter in its tail."""
    gamma = scene.roughness.gamma
    return MESH_ERROR[max((g for g in MESH_ERROR if g <= gamma), default=min(MESH_ERROR))]


def plan(
    scene: Scene, *, seed: int = 0, workers: int | None = None, progress: bool = False
) -> Plan:
    """Run a pilot and say what the scene's accuracy takes, on the mesh that it has.

    A scene that asks for paths is planned with these.

    Raises
    ------
    InputError
        As `measure`; or if one surface would take more paths than there may be.

    """
    needs, accuracy = scene.requires, scene.accuracy
    single = scene.surface.file is not None or not needs.roughness
    count = 1 if scene.surface.file is not None else PILOT_SURFACES
    if scene.layers is not None:  # others than the scene's might cross
        count = min(count, scene.surface.realisations)
    paths = min(PILOT_PATHS, accuracy.paths)
    pilot = replace(
        scene,
        surface=replace(scene.surface, realisations=count),
        accuracy=scene.accuracy.with_paths(paths),
        expect={},
    )
    begin = time.perf_counter()
    surfaces = list(surfaces_of(pilot, seed)) if needs.roughness else None
    pilot_result = measure(pilot, surfaces, seed=seed, workers=workers, progress=progress)
    wall = time.perf_counter() - begin
    per_path = pilot_result.attrs["seconds"] / float(pilot_result.paths.sum())
    per_surface = max(wall - pilot_result.attrs["seconds"], 0.0) / count
    wanted = wanted_of(
        uncertainty.of_measurement(pilot_result, scene), accuracy, paths, single=single
    )
    cells = surfaces[0].heights.size if surfaces else 0
    realisations, planned = scene.surface.realisations, accuracy.paths
    if accuracy.standard_error is not None:
        realisations, planned = cheapest(wanted, scene, cells, single=single)
    elif scene.surface.file is not None:
        realisations = 1
    errors = [w.left(realisations, planned) for w in wanted]
    angles = scene.light.angles
    planned_scene = replace(
        scene,
        surface=replace(scene.surface, realisations=realisations),
        accuracy=scene.accuracy.with_paths(planned),
    )
    return Plan(
        scene=planned_scene,
        mesh_error=_mesh_error(scene),
        error=max((e for e, w in zip(errors, wanted, strict=True) if not w.lobe), default=0.0),
        lobe_error=max((e for e, w in zip(errors, wanted, strict=True) if w.lobe), default=0.0),
        seconds=realisations * (per_surface + angles * planned * per_path),
        memory=(1 if scene.layers is None else 2) * cells * engine.of_scene(scene).bytes_per_cell
        + realisations * angles * memory.BYTES_PER_LOBE,
        notes=(*_notes(scene), *_missed(wanted, planned_scene)),
    )


def _mesh_error(scene: Scene) -> float | None:
    if scene.layers is not None:
        return None
    if not scene.requires.roughness or scene.surface.file is not None:
        return None
    surface = scene.surface
    if surface.cells < TILE * surface.correlation:
        return None  # a smaller tile than was measured
    steps = [step for step in MESH_ERROR[2.0] if step <= surface.correlation]
    return _measured(scene)[max(steps)] if steps else None


def _notes(scene: Scene) -> list[str]:
    """What the measured convergence does not cover."""
    if scene.layers is not None:
        return ["[layers]: the discretisation error was measured of one surface only"]
    if not scene.requires.roughness or scene.surface.file is not None:
        return []
    notes, gamma, target = [], scene.roughness.gamma, scene.accuracy.standard_error
    if gamma < min(MESH_ERROR):
        notes.append(
            f"γ = {gamma:g}: the discretisation error was measured for γ ≥ {min(MESH_ERROR)} only; "
            "`microsurf convergence` measures it for this scene"
        )
    bound = _mesh_error(scene)
    if target is not None and (bound is None or bound > target):
        known = "not known" if bound is None else f"known to ± {bound:.1g} only"
        notes.append(
            f"the discretisation error of this mesh is {known}, more than the error asked for"
            f" ({target:g}); "
            "`microsurf convergence` measures it for this scene"
        )
    return notes


def _missed(wanted: list[Wanted], planned: Scene) -> list[str]:
    """Say if even the most surfaces leave more than is asked."""
    count, paths = planned.surface.realisations, planned.accuracy.paths
    worst = max((w.left(count, paths) / w.target for w in wanted), default=0.0)
    if worst <= 1:
        return []
    left = f"{worst:.2g} times the error asked for is left by {count} surfaces"
    return [f"{left}, the most there are; ask for less, or give a larger lobe_error"]
