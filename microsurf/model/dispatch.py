"""Whole lobes by the name of any model: `predict`."""

import xarray as xr

from ..scene import Scene
from .random_walk.simulate import walk
from .registry import MODELS, entry_of
from .single_scattering import first_order


def predict(
    scene: Scene, model: str = "smith", *, seed: int = 0, progress: bool = False
) -> xr.Dataset:
    """Light of a scene in the detector's bins, by any model of `registry`.

    Parameters
    ----------
    scene : Scene
        What to predict; its surface is not used.
    model : str
        One of order 1, which is integrated (see `single_scattering.first_order.predict`), or of
        all orders, which takes ``scene.accuracy.paths`` walks for each angle (see `walk`).
    seed : int
        Of the walks; models of order 1 need none.
    progress : bool
        Show how far the walks are on standard error if that is a terminal.

    Returns
    -------
    xarray.Dataset
        As `microsurf.results.datasets` describes, one realisation.

    Raises
    ------
    InputError
        If there is no model of that name, or it is of one surface and the scene has two.

    """
    if entry_of(model, MODELS).walk is not None:
        return walk(scene, model, seed=seed, progress=progress)
    return first_order.predict(scene, model)
