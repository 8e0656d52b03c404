"""What every model returns: light in the detector's bins, and of which theory and scene."""

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from .. import __version__
from ..results import datasets, detector
from ..scene import Scene

Array = NDArray[np.float64]
Attributes = Mapping[str, str | float | int]


def prediction(
    scene: Scene,
    model: str,
    flux: Array,
    attrs: Attributes,
    *,
    orders: Sequence[int] = detector.ORDERS,
    path_weight: Array | None = None,
) -> xr.Dataset:
    """Label what a model found for a scene, see `microsurf.results.datasets.build`."""
    source = {
        "source": "prediction",
        "model": model,
        "scene": scene.to_toml(),
        "microsurf": __version__,
    }
    thetas, phis = scene.light.theta, scene.light.phi
    return datasets.build(flux, thetas, phis, orders, path_weight, {**source, **attrs})
