"""Energy conservation of one scene: all its light, counted in more than one way."""

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from ..results import albedos, datasets, detector
from ..scene import Material
from ..surface import Heightfield
from .area import closed
from .invariant import Invariant

CLOSED = 1e-12
_QUADRATURE = 2e-4


def scene_invariants(
    measured: xr.Dataset,
    predicted: Mapping[str, xr.Dataset],
    surfaces: Sequence[Heightfield],
    material: Material,
) -> list[Invariant]:
    """What must hold of one scene: energy, sums over orders, projected area.

    Parameters
    ----------
    measured : xarray.Dataset
        As `trace.measurement` gives it.
    predicted : Mapping of str to xarray.Dataset
        Predictions by model.
    surfaces : sequence of Heightfield
        What was measured; empty if it was flat.
    material : Material
        Whose Kd the sums are taken at.

    """
    invariants = [
        energy(measured),
        *walks(predicted),
        orders(measured, material),
        possible(measured),
    ]
    invariants.append(no_light_of_its_own(measured, predicted, material))
    return [*invariants, closed(surfaces)] if surfaces else invariants


def energy(measured: xr.Dataset) -> Invariant:
    """Every path has ended: at the detector, absorbed, left out, or lost by a known cause."""
    accounted = measured.arrived + measured.ended.sum("cause")
    return Invariant(
        "energy",
        "light that arrived + absorbed + left out + lost is what was sent, at each angle of each "
        "surface",
        float(np.abs(accounted / measured.paths - 1).max()),
        CLOSED,
        "largest |sum / sent − 1|; rounding of the sums",
        {"lost, of all paths": float(albedos.lost_paths(measured).max())},
    )


def walks(predicted: Mapping[str, xr.Dataset]) -> list[Invariant]:
    """Of the predictions that walk: every walk has ended."""
    return [
        Invariant(
            f"energy, {name}",
            "every walk has arrived or ended otherwise",
            float(np.abs(walked.arrived + walked.ended.sum("cause") - walked.paths).max()),
            0.0,
            "largest difference in walks; they are counted",
        )
        for name, walked in predicted.items()
        if "paths" in walked
    ]


def orders(measured: xr.Dataset, material: Material) -> Invariant:
    """Sums over orders, kinds, body events, bins and batches add up to the same light."""
    by_bins = datasets.hemispherical(measured.flux)
    by_batches = measured.batch_flux.sum("batch") / measured.light_rays
    arrived = (by_bins / measured.path_weight).sum(("order", "body_events"))
    gaps = {
        "bins against batches": np.abs(by_bins - by_batches).max(),
        "all against arrived": np.abs(arrived - measured.arrived / measured.paths).max(),
    }
    for kd in material.kd:
        weights = datasets.bin_weights(measured, material.n, kd)
        whole = (by_bins.sum("order") * weights).sum("body_events")
        parts = measured.microsurf.albedo_by_order(kd=kd).sum(("order", "kind"))
        gaps[f"orders and kinds against total, Kd = {kd:g}"] = np.abs(whole - parts).max()
    figures = {name: float(gap) for name, gap in gaps.items()}
    return Invariant(
        "sums over orders",
        "orders, kinds and numbers of body events add up to the total, in bins and in batches",
        max(figures.values()),
        CLOSED,
        "largest difference of albedos; rounding of the sums",
        figures,
    )


def possible(measured: xr.Dataset) -> Invariant:
    """Light where it can be: no more body events than facets met, and none negative.

    Between two layers light may meet the substrate any number of times in each order.
    """
    layered = datasets.SUBSTRATE_EVENTS in measured.coords
    impossible = measured.flux.where(
        (measured.body_events > measured.order)
        & (measured.order < detector.ORDERS[-1])
        & (not layered),
        0.0,
    )
    negative = measured.flux.clip(max=0)
    return Invariant(
        "no impossible light",
        "no bin is negative" + ("" if layered else ", and order k has at most k body events"),
        float(np.abs(impossible).sum() + np.abs(negative).sum()),
        0.0,
        "light in such bins; none is ever put there",
    )


def no_light_of_its_own(
    measured: xr.Dataset, predicted: Mapping[str, xr.Dataset], material: Material
) -> Invariant:
    """No albedo is above 1."""
    kd = max(material.kd)
    figures = {
        name: float(lobes.microsurf.albedo(kd=kd).max())
        for name, lobes in {"measured": measured, **predicted}.items()
    }
    return Invariant(
        "no light of its own",
        "no albedo is above 1, of the measurement and of each model",
        max(max(figures.values()) - 1, 0.0),
        _QUADRATURE,
        f"largest albedo − 1 at Kd = {kd:g}, 0 if below; the quadrature of the predictions",
        figures,
    )
