"""What `validate` says of a scene with two layers besides all that it says of any scene."""

from collections.abc import Mapping
from functools import partial
from typing import Any

import xarray as xr

from ..model import registry
from ..scene import Scene
from ..surface import layered_mesh
from . import comparison, il_assumption, predictions
from .stages import Stages

WALKS = 400_000
"""Walks in two layers for each angle: they take longer, and no verdict is about them."""
_LEFT_OUT = (
    "a finer mesh and a larger tile: the budget has what they change of IL facets on the interface",
    "masking, slopes and the relief: they are the interface's",
)
_COLUMNS = ("quantity", "theta_i", "phi_i", "kd", "measured", "predicted", "effect", "low", "high")


def walked(scene: Scene, turn: float, run: dict[str, Any], stages: Stages) -> dict[str, xr.Dataset]:
    """Predictions of two layers by model; none of one surface, or of a substrate from a file."""
    if scene.layers is None or scene.layers.substrate.file is not None:
        return {}
    return {
        key: stages.done(key, partial(predictions.all_orders, scene, key, turn, WALKS, run))
        for key in registry.of_layers()
    }


def summary(
    scene: Scene, seed: int, measured: xr.Dataset, predicted: Mapping[str, xr.Dataset]
) -> dict[str, Any]:
    """What a report says of two layers; empty of a scene without.

    ``pair``, what the first realisation is, see `LayeredMesh.report`; ``il_assumption``, what the
    atlas says of it by quantity, see `il_assumption.as_json`; ``theory``, by model of two layers
    measured over predicted − 1 with its 95 % interval; ``left_out``, what does not apply, and why.
    """
    if scene.layers is None:
        return {}
    left_out = list(_LEFT_OUT)
    if scene.roughness.sigma_x == 0 and scene.surface.file is None:
        left_out.append("error budget: a flat interface has none")
    if scene.layers.substrate.file is not None:
        left_out.append("theory of two layers: the roughness of a substrate from a file is unknown")
    return {
        "pair": layered_mesh(scene, seed, 0).report(),
        "il_assumption": {
            name: il_assumption.as_json(il_assumption.answer(scene, name))
            for name in ("albedo", "lobe")
        },
        "theory": {
            key: _apart(scene, measured, predicted[key])
            for key in registry.of_layers()
            if key in predicted
        },
        "left_out": left_out,
    }


def _apart(scene: Scene, measured: xr.Dataset, predicted: xr.Dataset) -> list[dict[str, Any]]:
    """Order-1 specular and body, and the total, against one model of all orders."""
    compared = comparison.compare(measured, predicted, scene, predicted)
    return [{key: getattr(row, key) for key in _COLUMNS} for row in compared]
