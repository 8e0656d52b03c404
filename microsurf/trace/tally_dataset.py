"""Tallies with their labels: what `measure` returns, and what decides when it is enough."""

from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from .. import __version__
from ..results import datasets, detector
from ..scene import Scene
from .kernels.state import BATCHES, ENDS, LOST
from .layers_dataset import with_layers
from .wavefront import FacetOptics, Tally

Array = NDArray[np.float64]


def to_dataset(
    scene: Scene,
    facet: FacetOptics,
    tallies: Sequence[Sequence[Tally]],
    angles: tuple[Sequence[float], Sequence[float]],
    seed: int,
    *,
    fold: bool,
) -> xr.Dataset:
    """Put tallies by realisation and angle, θ outermost, into one Dataset.

    With ``fold`` azimuths φ and −φ get the mean of both: right for the mean over
    surfaces that look the same from every side and in a mirror.
    """
    thetas, phis = angles
    shape = (len(tallies), len(thetas), len(phis))
    events = max(tally.energy.shape[1] for row in tallies for tally in row)
    orders, bins = len(detector.ORDERS), (detector.RINGS, detector.SECTORS)
    flux = np.zeros((*shape, orders, events, *bins))
    variance = np.zeros((*shape, len(detector.KINDS), *bins))
    batches, batch_light = np.zeros((*shape, BATCHES, orders, events)), np.zeros((*shape, BATCHES))
    counts = np.zeros((*shape, 5))
    arrived, ended, lost = np.zeros(shape), *(np.zeros((*shape, len(ENDS))) for _ in range(2))
    weight = facet.path_weight(events)
    for r, row in enumerate(tallies):
        for a, tally in enumerate(row):
            index = (r, *divmod(a, len(phis)))
            filled = tally.energy.shape[1]
            flux[index][:, :filled] = tally.energy / tally.light
            variance[index] = tally.squares / tally.light**2
            batches[index][..., :filled] = tally.batches
            batch_light[index] = tally.batch_light
            # One path's share of its light ray is the unit.
            arrived[index] = tally.energy.sum() * facet.branches
            ended[index] = tally.ended * facet.branches
            lost[index] = tally.lost
            counts[index] = tally.counts
    if fold:
        flux, variance = (flux + _mirrored(flux)) / 2, _folded(variance)
    measured = datasets.build(
        flux * weight[:, None, None],
        thetas,
        phis,
        path_weight=weight,
        attrs={
            "source": "measurement",
            "model": "explicit surface",
            "scene": scene.to_toml(),
            "seed": seed,
            "microsurf": __version__,
        },
    )
    dims = ("realisation", "theta_i", "phi_i")
    names = ("light_rays", "paths", "rays", "grazes", "leaks")
    for k, name in enumerate(names):
        measured[name] = (dims, counts[..., k])
    measured["arrived"] = (dims, arrived)
    measured["ended"] = ((*dims, "cause"), ended)
    measured["ended_paths"] = ((*dims, "cause"), lost)
    measured["bin_variance"] = (
        (*dims, "kind", "theta_o", "phi_o"),
        variance,
        {"long_name": "variance of the flux of order 1 by its rays, kind body: one body event"},
    )
    measured["batch_flux"] = (
        (*dims, "batch", "order", "body_events"),
        batches * weight,
        {"long_name": "light that arrived from each batch", "units": "light rays"},
    )
    measured["batch_light"] = ((*dims, "batch"), batch_light, {"units": "light rays"})
    if len(tallies[0][0].inside):
        measured = with_layers(measured, tallies, facet)
    return measured.assign_coords(
        cause=list(ENDS), lost=("cause", [c in LOST for c in ENDS]), kind=list(detector.KINDS)
    )


def _mirrored(lobes: Array) -> Array:
    """Lobes with φ and −φ exchanged; sectors are centred on multiples of their width."""
    return np.roll(lobes[..., ::-1], 1, axis=-1)


def _folded(variance: Array) -> Array:
    """Variance of the mean of φ and −φ; 0 and 180° are their own mirror images."""
    folded = (variance + _mirrored(variance)) / 4
    symmetric = [0, detector.SECTORS // 2]
    folded[..., symmetric] = variance[..., symmetric]
    return folded
