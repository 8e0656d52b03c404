"""Results of two explicit layers: what their bins weigh, and any absorption afterwards.

The bins of body events hold light that was never inside (0), and light that was inside with
one substrate event less than their number. So a bin weighs Kd^(events), no matter the index.
"""

from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..errors import InputError
from . import datasets, detector

A_DECADE, SHORTEST, DECADES = 16, 1e-4, 12
"""Bins of the length inside: so many a decade, from so many cells on, for so many decades."""
LENGTHS = A_DECADE * DECADES


def with_substrate_events(dataset: xr.Dataset) -> xr.Dataset:
    """Say how many substrate events each bin of body events stands for, see `bin_weights`."""
    events = substrate_events(dataset.body_events.values)
    about = {"long_name": "substrate events; each weighs Kd"}
    return dataset.assign_coords({datasets.SUBSTRATE_EVENTS: ("body_events", events, about)})


def substrate_events(body_events: NDArray[Any]) -> NDArray[Any]:
    """How many substrate events numbers of body events stand for."""
    return np.asarray(np.maximum(body_events - 1, 0))


def event_weights(bins: int, kd: float) -> NDArray[np.float64]:
    """Weights of the first bins of body events: Kd for each substrate event; 0⁰ = 1."""
    return np.asarray(kd ** substrate_events(detector.BODY_EVENTS[:bins]))


def length_bins(lengths: NDArray[np.float64]) -> NDArray[np.int64]:
    """Bins of lengths in cells; what is shorter or longer than all is in the first or last."""
    bins = A_DECADE * np.log10(np.maximum(lengths, SHORTEST) / SHORTEST)
    return np.minimum(bins.astype(np.int64), LENGTHS - 1)


def with_lengths(
    dataset: xr.Dataset, light: NDArray[np.float64], total: NDArray[np.float64]
) -> xr.Dataset:
    """Add light that was inside by its length there, before absorption on the way.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of two layers.
    light, total : array, shape (realisations, θ_i, φ_i, LENGTHS, body_events)
        Parts of the incident light at Kd = 1, and these times the length, by `length_bins`.

    """
    dims = ("realisation", "theta_i", "phi_i", "length", "body_events")
    edges = SHORTEST * 10.0 ** (np.arange(LENGTHS + 1) / A_DECADE)
    edges[0] = 0.0
    return dataset.assign(length_light=(dims, light), length_sum=(dims, total)).assign_coords(
        length_low=("length", edges[:-1], {"units": "cells"}),
        length_high=("length", edges[1:], {"units": "cells"}),
    )


class Absorbed(NamedTuple):
    """Albedo with absorption inside: estimate, and bounds between which the histogram leaves it."""

    albedo: xr.DataArray
    low: xr.DataArray
    high: xr.DataArray


def absorbed(dataset: xr.Dataset, n: float, kd: float, absorption: float) -> Absorbed:
    """Total albedo if each cell of length inside absorbed ``absorption``, by realisation and angle.

    From the lengths inside, 16 bins a decade, of each the light and its mean length L: the light
    left is at least exp(−αL) of it (Jensen), and at most what the chord of exp(−αl) over the
    bin has at L. The estimate is a third of the way up, exact to second order for light
    spread evenly. The statistical error is that of the result, a measurement or a walk.

    Raises
    ------
    InputError
        If the result is not one of two layers, or the absorption not ≥ 0.

    """
    if "length_light" not in dataset:
        raise InputError("not a result of a scene with [layers]: no lengths inside")
    if not (np.isfinite(absorption) and absorption >= 0):
        raise InputError(f"absorption = {absorption}: must be a number ≥ 0, per cell")
    weights = datasets.bin_weights(dataset, n, kd)
    light, total = dataset.length_light, dataset.length_sum
    mean = (total / light.where(light > 0)).fillna(0.0)
    low_edge, high_edge = dataset.length_low, dataset.length_high
    mean = mean.clip(min=low_edge)  # rounding; the last bin may hold longer ones
    at_mean = np.exp(-absorption * mean)
    share = ((mean - low_edge) / (high_edge - low_edge)).clip(max=1.0)
    chord = (1 - share) * np.exp(-absorption * low_edge) + share * np.exp(-absorption * high_edge)
    chord = np.maximum(chord, at_mean)
    outside = dataset.microsurf.albedo(kind="specular", n=n, kd=kd)

    def whole(left: xr.DataArray) -> xr.DataArray:
        inside = (left * light * weights).sum(("length", "body_events"))
        return xr.DataArray(outside + inside)

    low, high = whole(at_mean), whole(chord)
    return Absorbed(low + (high - low) / 3, low, high)
