"""The figures that commands print of a result: albedos, their standard errors, the losses."""

from typing import Any

import xarray as xr

QUANTITIES = {
    "specular": "order-1 specular albedo",
    "body": "order-1 body albedo",
    "total": "total albedo",
}
SELECTED: dict[str, dict[str, Any]] = {
    "specular": {"order": 1, "kind": "specular"},
    "body": {"order": 1, "kind": "body"},
    "total": {},
}
"""The same as arguments of ``result.microsurf.albedo`` and the errors beside it."""


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


def figures(
    dataset: xr.Dataset, kds: tuple[float, ...] | None = None, *, n: float | None = None
) -> dict[str, Any]:
    """Albedo, its standard error, and albedo by order, specular and body apart.

    Figures become lists over the angles (θ outermost) if there are several, and
    within them over Kd if there are several; n and Kd are by default those of the result's scene.
    """
    result = dataset.microsurf
    kds = result.scene.material.kd if kds is None else kds
    report: dict[str, list[Any]] = {}
    cells = {
        kd: {
            "mean": result.albedo_by_order(kd=kd, n=n)
            .mean("realisation")
            .stack(angle=("theta_i", "phi_i")),
            "se": result.standard_error(kd=kd, n=n).stack(angle=("theta_i", "phi_i")),
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
