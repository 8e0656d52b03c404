"""What the models say of a scene that is validated, each with what it took."""

import time
from typing import Any

import xarray as xr

from .. import model
from ..model import registry
from ..scene import Scene
from .fitted_theory import turned


def models_of(scene: Scene) -> tuple[str, ...]:
    """Models of order 1 that a scene is compared with."""
    return registry.compared(registry.order_one()) if scene.requires.roughness else ("flat",)


def order_one(
    theory: Scene, models: tuple[str, ...], turn: float
) -> tuple[dict[str, xr.Dataset], dict[str, float]]:
    """Order 1 by each model, and the seconds of the processor that it took; see `turned`."""
    predicted, seconds = {}, {}
    for key in models:
        clock = time.process_time()
        predicted[key] = _as_illuminated(model.predict(turned(theory, turn), key), theory)
        seconds[key] = time.process_time() - clock
    return predicted, seconds


def all_orders(theory: Scene, key: str, turn: float, walks: int, run: dict[str, Any]) -> xr.Dataset:
    """All orders by so many walks for each angle, see `turned`."""
    return _as_illuminated(model.walk(turned(theory, turn), key, walks=walks, **run), theory)


def _as_illuminated(predicted: xr.Dataset, theory: Scene) -> xr.Dataset:
    """Light's azimuth again from x: bins count from it, so nothing else has to be turned."""
    return predicted.assign_coords(phi_i=list(theory.light.phi))
