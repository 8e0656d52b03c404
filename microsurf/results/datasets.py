"""The one object that measurements and predictions share: a labelled Dataset, bin for bin.

``flux[realisation, theta_i, phi_i, order, body_events, theta_o, phi_o]`` is the
part of the incident power that leaves into a bin of the detector after ``order``
facet events (1, 2, 3, 4 = four or more), ``body_events`` of them in the
substrate, *before* the substrate's absorption: each body event still weighs
body_weight(n, Kd) (see `physics.facet`). So one dataset answers for every Kd.
No body event is *specular*, one or more is *body*. The bins are those of `detector`; such
long paths as share a bin of many body events are thinned out (`trace.wavefront`),
``path_weight`` says how much each of the remaining ones counts. In the plane of incidence
θ_o is signed, positive on the mirror side.
"""

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..errors import InputError
from ..files import check_readable, read_once, whole_file
from ..physics import facet
from . import detector

Array = NDArray[np.float64]

_MOST_PIPED = 2**31
_LARGE = 4096
"""Numbers of a variable that is worth compressing."""

SUBSTRATE_EVENTS = "substrate_events"
"""Coordinate along body_events of results of two layers, see `layers`."""

_DIMENSIONS = ("realisation", "theta_i", "phi_i", "order", "body_events", "theta_o", "phi_o")


def build(
    flux: Array,
    theta_i: Sequence[float],
    phi_i: Sequence[float],
    orders: Sequence[int] = detector.ORDERS,
    path_weight: Array | None = None,
    attrs: Mapping[str, str | float | int] | None = None,
) -> xr.Dataset:
    """Label a flux array, shape as in the module's text, with its coordinates and units."""
    events = flux.shape[4]
    result = xr.Dataset(
        {"flux": (_DIMENSIONS, flux, {"units": "1", "long_name": "part of the incident power"})},
        coords={
            "realisation": np.arange(flux.shape[0]),
            "theta_i": ("theta_i", np.asarray(theta_i, float), {"units": "degree"}),
            "phi_i": ("phi_i", np.asarray(phi_i, float), {"units": "degree"}),
            "order": ("order", np.asarray(orders), {"long_name": "facet events; 4 = four or more"}),
            "body_events": detector.BODY_EVENTS[:events],
            "path_weight": (
                "body_events",
                np.ones(events) if path_weight is None else path_weight,
                {"long_name": "how many paths one path of this bin stands for"},
            ),
            "theta_o": ("theta_o", detector.ring_centres(), {"units": "degree"}),
            "phi_o": (
                "phi_o",
                (detector.SECTOR_EDGES[:-1] + detector.SECTOR_EDGES[1:]) / 2,
                {"units": "degree", "long_name": "azimuth from the incident one"},
            ),
            "theta_o_edges": ("ring_edge", detector.RING_EDGES, {"units": "degree"}),
            "phi_o_edges": ("sector_edge", detector.SECTOR_EDGES, {"units": "degree"}),
            "solid_angle": (
                ("theta_o", "phi_o"),
                np.repeat(detector.solid_angles(), detector.SECTORS, axis=1),
                {"units": "sr"},
            ),
        },
    )
    result.attrs.update(attrs or {})
    return result


def body_weights(events: int, n: float, kd: float) -> Array:
    """Weights w^b of the first ``events`` bins of BODY_EVENTS; 0^0 = 1."""
    return np.asarray(float(facet.body_weight(n, kd)) ** detector.BODY_EVENTS[:events])


def bin_weights(data: xr.DataArray | xr.Dataset, n: float, kd: float) -> xr.DataArray:
    """Weights of the bins of body events of a result, over its dimension body_events.

    Body events of one surface weigh w, see `body_weights`. Results of two layers say how many
    substrate events a bin stands for, and each weighs Kd.
    """
    if SUBSTRATE_EVENTS in data.coords:
        weights = np.asarray(kd ** data[SUBSTRATE_EVENTS].values)
    else:
        weights = body_weights(data.sizes["body_events"], n, kd)
    return xr.DataArray(weights, dims="body_events")


def by_kind(flux: xr.DataArray, n: float, kd: float) -> xr.DataArray:
    """Apply a substrate's albedo Kd: dimension body_events becomes kind = specular | body."""
    weights = bin_weights(flux, n, kd)
    specular = flux.isel(body_events=0, drop=True)
    body = (flux.isel(body_events=slice(1, None)) * weights.isel(body_events=slice(1, None))).sum(
        "body_events"
    )
    # Not xr.concat, whose result is the same and takes half as long again.
    return xr.DataArray(
        np.stack([specular, body]),
        {**specular.coords, "kind": list(detector.KINDS)},
        ("kind", *specular.dims),
        flux.name,
        flux.attrs,
    )


def hemispherical(flux: xr.DataArray) -> xr.DataArray:
    """Sum over the detector: albedos out of lobes."""
    return flux.sum(("theta_o", "phi_o"))


def brdf(energy: xr.DataArray) -> xr.DataArray:
    """Mean BRDF of each bin in sr⁻¹: its energy over ∫ cosθ dω."""
    return energy / xr.DataArray(
        np.repeat(detector.projected_solid_angles(), detector.SECTORS, axis=1),
        dims=("theta_o", "phi_o"),
    )


def in_plane(values: xr.DataArray) -> xr.DataArray:
    """Cut along the plane of incidence: θ_o signed, positive on the mirror side.

    The cap θ_o < 1° has no azimuth to speak of: it stands once, as the mean of its sectors.
    """
    values = values.where(values.theta_o > 0, values.mean("phi_o"))
    back = values.isel(phi_o=0, drop=True).isel(theta_o=slice(None, 0, -1))
    front = values.isel(phi_o=detector.SECTORS // 2, drop=True)
    back = back.assign_coords(theta_o=-back.theta_o)
    return xr.concat([back, front], "theta_o", coords="minimal", compat="override")


def save(result: xr.Dataset, path: Path, *, rounded: bool = False) -> None:
    """Write a result as compressed netCDF-4, whole or not at all.

    Whole numbers in the attributes that netCDF-4 has no type for, such as seeds beyond 64
    bits, are written as text. ``rounded``: lobes in single precision, 6e−8 of each value,
    which takes half the room and less than half the time: for reading, not to go on from.

    Raises
    ------
    MicrosurfError
        If there is no room for it.

    """
    plain = result.assign_attrs(
        {
            name: str(value) if isinstance(value, int) and abs(value) >= 2**63 else value
            for name, value in result.attrs.items()
        }
    )
    # In memory first: HDF5 can't close a file on a disk that is full.
    content = plain.to_netcdf(
        None,
        engine="h5netcdf",
        encoding={
            name: _packed(values, rounded=rounded) for name, values in plain.data_vars.items()
        },
    )
    with whole_file(path) as temporary:
        temporary.write_bytes(content)


def _packed(values: xr.DataArray, *, rounded: bool) -> dict[str, Any]:
    """How a variable is written: large ones compressed, the lobes of all events together."""
    if values.size < _LARGE:
        return {"_FillValue": None}
    kind = {"dtype": "float32"} if rounded and values.dtype == np.float64 else {}
    chunks = (1,) * (values.ndim - 3) + values.shape[-3:]
    packing = {"compression": "gzip", "compression_opts": 4, "shuffle": True}
    return {"_FillValue": None, "chunksizes": chunks, **packing, **kind}


def load(path: Path) -> xr.Dataset:
    """Read a result that `save` wrote.

    Raises
    ------
    InputError
        If the file is missing, truncated or not a result of microsurf.

    """
    instead = "`microsurf measure --out FILE.nc` writes one"
    source: Path | io.BytesIO = path
    if path.is_file():
        check_readable(path, instead)
    else:
        source = io.BytesIO(read_once(path, instead, _MOST_PIPED))
    try:
        result = xr.load_dataset(source, engine="h5netcdf")
    except Exception as error:  # HDF5 raises anything from OSError to KeyError here
        raise InputError(f"{path}: not a netCDF-4 file, or truncated; measure it again") from error
    if "flux" not in result or result.flux.dims != _DIMENSIONS:
        raise InputError(f"{path}: not a result of microsurf (no flux with its seven dimensions)")
    if result.flux.shape[-2:] != (detector.RINGS, detector.SECTORS) or not {
        "source",
        "scene",
    } <= set(result.attrs):
        raise InputError(f"{path}: not a result of this microsurf; measure it again")
    return result
