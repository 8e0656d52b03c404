"""What a scene's `[effects]` leave out, and the error that this costs: measured, not guessed."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import xarray as xr

from ..scene import Effects, Scene
from ..stats import intervals
from ..surface import Heightfield
from ..trace import measure


def cost(
    scene: Scene,
    measured: xr.Dataset,
    surfaces: Sequence[Heightfield] | None,
    *,
    seed: int = 0,
    workers: int | None = None,
    progress: bool = False,
) -> list[dict[str, Any]]:
    """Measure the same surfaces with all effects, and say what the total albedo lacks without.

    Returns
    -------
    list of dict
        For each angle and Kd: ``effect``, ``theta_i``, ``phi_i``, ``kd``, the albedos ``without``
        and ``with_all``, and ``error`` = without/with_all − 1 with the ends ``low`` and ``high`` of
        its 95 % interval over the surfaces, of the rays where there is one. Empty if the scene
        leaves nothing out, or has no second facet to leave out.

    """
    if scene.requires.multiple_scattering or not scene.requires.roughness:
        return []
    whole = replace(scene, effects=Effects(), expect={})
    complete = measure(whole, surfaces, seed=seed, workers=workers, progress=progress)
    rows = []
    for kd in scene.material.kd:
        both = [d.microsurf.albedo(kd=kd).values for d in (measured, complete)]
        noise = [d.microsurf.ray_error(kd=kd).values for d in (measured, complete)]
        places = product(enumerate(scene.light.theta), enumerate(scene.light.phi))
        for (t, theta), (p, phi) in places:
            part, all_of_it = (values[:, t, p] for values in both)
            if all_of_it.mean() == 0:
                continue
            # On each surface the same light, so that what surfaces differ by drops out.
            lacks = part / all_of_it - 1
            if len(lacks) > 1:
                half = float(intervals.half_width_of_mean(lacks))
            else:
                rays = float(np.hypot(*(e[0, t, p] for e in noise)) / all_of_it[0])
                half = intervals.normal() * rays
            error = float(lacks.mean())
            rows.append(
                {
                    "effect": "multiple scattering",
                    "theta_i": theta,
                    "phi_i": phi,
                    "kd": kd,
                    "without": float(part.mean()),
                    "with_all": float(all_of_it.mean()),
                    "error": error,
                    "low": error - half,
                    "high": error + half,
                }
            )
    return rows
