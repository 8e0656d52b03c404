"""Speed against accuracy of the models; the reference is what `validate` has measured.

No explicit methods: they would share their realisations with the reference.
"""

from collections.abc import Mapping
from dataclasses import replace

import xarray as xr

from ...scene import Scene
from .effort import EFFORTS
from .methods import Run, draws_of, methods_of, run_all
from .study import ReferenceDraws, Tradeoff, judged, with_half_widths

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
    reference = ReferenceDraws(
        draws_of(measured, scene), scene.surface, int(measured.paths.min()),
        float(measured.attrs["seconds"]), needs.roughness,
    )  # fmt: skip
    methods = methods_of(scene, EFFORT)
    runs = {
        method.name: Run(
            method,
            draws_of(predicted[method.model][0], scene),
            (predicted[method.model][1] / scene.light.angles,),
        )
        for method in methods
        if method.model in predicted
    }
    rest = [method for method in methods if method.name not in runs]
    runs |= {run.method.name: run for run in run_all(scene, rest, seed, full=False)}
    return judged(
        scene, with_half_widths(scene, reference), [runs[method.name] for method in methods]
    )
