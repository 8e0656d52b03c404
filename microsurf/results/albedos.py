"""The figures of a result: albedos by order and kind, their standard errors, the losses."""

from typing import Any

import numpy as np
import xarray as xr

from . import datasets, detector

QUANTITIES = {
    "specular": "order-1 specular albedo",
    "body": "order-1 body albedo",
    "total": "total albedo",
}


def by_order(dataset: xr.Dataset, n: float, kd: float) -> xr.DataArray:
    """Albedo by realisation, theta_i, phi_i, order (1, 2, 3, 4+) and kind."""
    energy = datasets.by_kind(datasets.hemispherical(dataset.flux), n, kd)
    return energy.reindex(order=list(detector.ORDERS), fill_value=0.0)


def quantity(dataset: xr.Dataset, name: str, n: float, kd: float) -> xr.DataArray:
    """One of QUANTITIES by realisation, theta_i and phi_i."""
    albedos = by_order(dataset, n, kd)
    if name == "total":
        return albedos.sum(("order", "kind"))
    return albedos.sel(order=1, kind=name, drop=True)


def ray_error(dataset: xr.Dataset, name: str, n: float, kd: float) -> xr.DataArray:
    """Standard error of `quantity` in each realisation from its number of rays alone.

    From the spread of batches that know nothing of each other, where the result has
    them. Else paths are independent draws of a weight w^b, and their counts hold the
    variance.
    """
    if "batch_flux" in dataset:
        return _batch_error(dataset, name, n, kd)
    squared = _second_moment(dataset, name, n, kd)
    mean = quantity(dataset, name, n, kd)
    variance = (squared - mean**2).clip(min=0)
    if "paths" not in dataset:
        return variance * 0
    return xr.DataArray(np.sqrt(variance / dataset.paths))


def _batch_error(dataset: xr.Dataset, name: str, n: float, kd: float) -> xr.DataArray:
    """Ratio of sums over batches of light that arrived and light that was sent."""
    light = dataset.batch_light
    arrived = datasets.by_kind(dataset.batch_flux, n, kd)
    arrived = (
        arrived.sum(("order", "kind"))
        if name == "total"
        else arrived.sel(order=1, kind=name, drop=True)
    )
    sent = light.sum("batch")
    rest = arrived - light * (arrived.sum("batch") / sent)
    batches = (light > 0).sum("batch")
    # One batch knows nothing of its error: the most that light between 0 and 1 can have.
    known = (rest**2).sum("batch") * batches / (batches - 1).clip(min=1)
    return xr.DataArray(np.sqrt(known) / sent).where(batches > 1, 0.5)


def _second_moment(dataset: xr.Dataset, name: str, n: float, kd: float) -> xr.DataArray:
    weights = datasets.bin_weights(dataset, n, kd) ** 2
    flux = datasets.hemispherical(dataset.flux)
    squares: xr.DataArray = flux * flux.path_weight * weights
    if name == "total":
        return squares.sum(("order", "body_events"))
    first = squares.sel(order=1, drop=True)
    if name == "specular":
        return first.isel(body_events=0, drop=True)
    return first.isel(body_events=slice(1, None)).sum("body_events")


def standard_error(dataset: xr.Dataset, name: str, n: float, kd: float) -> xr.DataArray:
    """Standard error of the mean over realisations; of the rays alone if there is only one."""
    count = dataset.sizes["realisation"]
    if count == 1:
        return ray_error(dataset, name, n, kd).isel(realisation=0, drop=True)
    spread = quantity(dataset, name, n, kd).std("realisation", ddof=1)
    return xr.DataArray(spread / np.sqrt(count))


def lost_light(dataset: xr.Dataset) -> xr.DataArray:
    """Fraction of the light that ended with lost paths, by theta_i and phi_i."""
    lost = dataset.ended.isel(cause=dataset.lost.values).sum(("cause", "realisation"))
    return xr.DataArray(lost / dataset.paths.sum("realisation"))


def lost_paths(dataset: xr.Dataset) -> xr.DataArray:
    """Fraction of paths lost, by theta_i and phi_i; they may have carried hardly any light."""
    lost = _ended_paths(dataset).isel(cause=dataset.lost.values).sum(("cause", "realisation"))
    return xr.DataArray(lost / dataset.paths.sum("realisation"))


def _ended_paths(dataset: xr.Dataset) -> xr.DataArray:
    """Paths by the cause of their end; those of a walk all carry the same light."""
    return dataset["ended_paths" if "ended_paths" in dataset else "ended"]


def _listed(values: list[Any]) -> Any:
    return values[0] if len(values) == 1 else values


def figures(dataset: xr.Dataset, n: float, kds: tuple[float, ...]) -> dict[str, Any]:
    """Albedo, its standard error, and albedo by order, specular and body apart.

    Figures become lists over the angles (θ outermost) if there are several, and
    within them over Kd if there are several.
    """
    report: dict[str, list[Any]] = {}
    cells = {
        kd: {
            "mean": by_order(dataset, n, kd).mean("realisation").stack(angle=("theta_i", "phi_i")),
            "se": standard_error(dataset, "total", n, kd).stack(angle=("theta_i", "phi_i")),
        }
        for kd in kds
    }
    for angle in range(dataset.sizes["theta_i"] * dataset.sizes["phi_i"]):
        rows: dict[str, list[Any]] = {}
        for kd in kds:
            mean = cells[kd]["mean"].isel(angle=angle)
            entry = {
                "albedo": float(mean.sum()),
                "albedo_se": float(cells[kd]["se"].isel(angle=angle)),
                "albedo_by_order": mean.sum("kind").values.tolist(),
                "specular_by_order": mean.sel(kind="specular").values.tolist(),
                "body_by_order": mean.sel(kind="body").values.tolist(),
            }
            for key, value in entry.items():
                rows.setdefault(key, []).append(value)
        for key, values in rows.items():
            report.setdefault(key, []).append(_listed(values))
    return {key: _listed(values) for key, values in report.items()}


def losses(dataset: xr.Dataset) -> dict[str, Any]:
    """Fractions of paths and of light lost at each angle, and paths lost by cause."""
    total = _ended_paths(dataset).sum(("realisation", "theta_i", "phi_i"))
    return {
        "lost": _listed(lost_paths(dataset).values.ravel().tolist()),
        "lost_light": _listed(lost_light(dataset).values.ravel().tolist()),
        "lost_by_cause": {
            str(cause): int(total.sel(cause=cause)) for cause in dataset.cause.values[dataset.lost]
        },
    }
