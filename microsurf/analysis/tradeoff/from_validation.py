"""Speed against accuracy of the models; the reference is what `validate` has measured.

No explicit rungs: they would share their realisations with the reference.
"""

from collections.abc import Mapping
from dataclasses import replace

import xarray as xr

from ...scene import Scene
from .effort import EFFORTS
from .methods import Run, draws_of, run_all, rungs_of
from .study import Reference, Tradeoff, judged, with_half_widths

EFFORT = replace(EFFORTS["quick"], walks=((10_000, 8), (100_000, 3)), meshes=())
"""Seconds for a scene."""
LEAST = 3
"""Realisations of the reference: from fewer nothing is known of its error."""


def frontier_of(
    scene: Scene,
    measured: xr.Dataset,
    predicted: Mapping[str, tuple[xr.Dataset, float]],
    *,
    seed: int = 0,
) -> Tradeoff | None:
    """Run all models and walks on a scene that was measured.

    Parameters
    ----------
    scene : Scene
        With the roughness that the theory takes.
    measured : xarray.Dataset
        The reference.
    predicted : mapping from names of models to (prediction, processor seconds)
        Those made before, which are not made again.
    seed : int
        Of the walks.

    Returns
    -------
    Tradeoff or None
        None if the scene reflects nothing or has fewer than LEAST realisations.

    """
    needs = scene.requires
    if measured.sizes["realisation"] < LEAST or not (needs.interface or needs.substrate):
        return None
    reference = Reference(
        draws_of(measured, scene), scene.surface, int(measured.paths.min()),
        float(measured.attrs["seconds"]), needs.roughness,
    )  # fmt: skip
    rungs = rungs_of(scene, EFFORT)
    made = {
        rung.name: Run(
            rung,
            draws_of(predicted[rung.model][0], scene),
            (predicted[rung.model][1] / scene.light.angles,),
        )
        for rung in rungs
        if rung.model in predicted
    }
    rest = [rung for rung in rungs if rung.name not in made]
    made |= {run.rung.name: run for run in run_all(scene, rest, seed, full=False)}
    return judged(scene, with_half_widths(scene, reference), [made[rung.name] for rung in rungs])
