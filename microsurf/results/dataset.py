"""The one object that measurements and predictions share: a labelled Dataset, bin for bin.

``flux[realisation, theta_i, phi_i, order, body_events, theta_o, phi_o]`` is the
part of the incident power that leaves into a bin of the detector after ``order``
facet events (1, 2, 3, 4 = four or more), ``body_events`` of them in the
substrate, *before* the substrate's absorption: each body event still weighs
body_weight(n, Kd) (see `physics.facet`). So one dataset answers for every Kd.
No body event is *specular*, one or more is *body*. Numbers of body events above
BODY_EXACT share bins 25 % wide, named by their middle. If b is spread evenly over a
bin the mean of w^b is then off by less than 2e−3 (of 1, not of what is left); if it
falls geometrically the sum over bins is off by less than 5e−3 of all body light, at
worst near w = 0.97 where hardly any path escapes. Such long paths are also thinned
out (`trace.paths`), ``path_weight`` says how much each of the remaining ones counts.

Rings in θ_o, sectors in φ_o − φ_i, both in degrees. The first ring is the cap
θ_o < 1°; rings and sectors are centred so that mirror directions at whole even
degrees lie inside a bin and not on an edge. The mirror side is φ_o − φ_i = 180°;
in the plane of incidence θ_o is signed, positive on that side.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..errors import InputError, MicrosurfError
from ..files import check_readable, whole_file
from ..physics import facet

Array = NDArray[np.float64]

ORDERS = (1, 2, 3, 4)
KINDS = ("specular", "body")
SECTORS = 36
RING_EDGES = np.concatenate([[0.0], np.arange(1.0, 90.0, 2.0), [90.0]])
SECTOR_EDGES = (np.arange(SECTORS + 1) - 0.5) * 360 / SECTORS
RINGS = len(RING_EDGES) - 1

BODY_EXACT = 16


def _body_edges() -> NDArray[np.int64]:
    edges = list(range(BODY_EXACT + 2))
    while edges[-1] < 10**9:
        edges.append(-(-edges[-1] * 5 // 4))
    return np.array(edges)


BODY_EDGES = _body_edges()
"""First number of body events of each bin; the last edge closes the last bin."""
BODY_EVENTS = (BODY_EDGES[:-1] + BODY_EDGES[1:] - 1) / 2
"""Number of body events that stands for each bin."""

_DIMENSIONS = ("realisation", "theta_i", "phi_i", "order", "body_events", "theta_o", "phi_o")


def ring_centres() -> Array:
    """θ_o of the rings in degrees; 0 for the cap."""
    centres = (RING_EDGES[:-1] + RING_EDGES[1:]) / 2
    centres[0] = 0.0
    return np.asarray(centres)


def solid_angles() -> Array:
    """∫ dω of each bin in sr, shape (rings, 1)."""
    return np.asarray(-np.diff(np.cos(np.radians(RING_EDGES)))[:, None] * 2 * np.pi / SECTORS)


def projected_solid_angles() -> Array:
    """∫ cosθ dω of each bin in sr, shape (rings, 1)."""
    return np.asarray(np.diff(np.sin(np.radians(RING_EDGES)) ** 2)[:, None] * np.pi / SECTORS)


def ring_of(theta_o: float) -> int:
    """Index of the ring that holds θ_o, in degrees."""
    return int(np.clip(np.searchsorted(RING_EDGES, theta_o, side="right") - 1, 0, RINGS - 1))


def build(
    flux: Array,
    theta_i: Sequence[float],
    phi_i: Sequence[float],
    orders: Sequence[int] = ORDERS,
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
            "body_events": BODY_EVENTS[:events],
            "path_weight": (
                "body_events",
                np.ones(events) if path_weight is None else path_weight,
                {"long_name": "how many paths one path of this bin stands for"},
            ),
            "theta_o": ("theta_o", ring_centres(), {"units": "degree"}),
            "phi_o": (
                "phi_o",
                (SECTOR_EDGES[:-1] + SECTOR_EDGES[1:]) / 2,
                {"units": "degree", "long_name": "azimuth from the incident one"},
            ),
            "theta_o_edges": ("ring_edge", RING_EDGES, {"units": "degree"}),
            "phi_o_edges": ("sector_edge", SECTOR_EDGES, {"units": "degree"}),
            "solid_angle": (
                ("theta_o", "phi_o"),
                np.repeat(solid_angles(), SECTORS, axis=1),
                {"units": "sr"},
            ),
        },
    )
    result.attrs.update(attrs or {})
    return result


def body_weights(events: int, n: float, kd: float) -> Array:
    """Weights w^b of the first ``events`` bins of BODY_EVENTS; 0^0 = 1."""
    return np.asarray(float(facet.body_weight(n, kd)) ** BODY_EVENTS[:events])


def by_kind(flux: xr.DataArray, n: float, kd: float) -> xr.DataArray:
    """Apply a substrate's albedo Kd: dimension body_events becomes kind = specular | body."""
    weights = body_weights(flux.sizes["body_events"], n, kd)
    specular = flux.isel(body_events=0, drop=True)
    body = (
        flux.isel(body_events=slice(1, None)) * xr.DataArray(weights[1:], dims="body_events")
    ).sum("body_events")
    return xr.concat(
        [specular, body], xr.Variable("kind", list(KINDS)), coords="minimal", compat="override"
    )


def hemispherical(flux: xr.DataArray) -> xr.DataArray:
    """Sum over the detector: albedos out of lobes."""
    return flux.sum(("theta_o", "phi_o"))


def brdf(energy: xr.DataArray) -> xr.DataArray:
    """Mean BRDF of each bin in sr⁻¹: its energy over ∫ cosθ dω."""
    return energy / xr.DataArray(
        np.repeat(projected_solid_angles(), SECTORS, axis=1), dims=("theta_o", "phi_o")
    )


def in_plane(values: xr.DataArray) -> xr.DataArray:
    """Cut along the plane of incidence: θ_o signed, positive on the mirror side.

    The cap θ_o < 1° has no azimuth to speak of: it stands once, as the mean of its sectors.
    """
    values = values.where(values.theta_o > 0, values.mean("phi_o"))
    back = values.isel(phi_o=0, drop=True).isel(theta_o=slice(None, 0, -1))
    front = values.isel(phi_o=SECTORS // 2, drop=True)
    back = back.assign_coords(theta_o=-back.theta_o)
    return xr.concat([back, front], "theta_o", coords="minimal", compat="override")


def save(result: xr.Dataset, path: Path) -> None:
    """Write a result as netCDF-3, whole or not at all.

    Realisations are its records: then only what one of them holds is limited to 2 GiB.
    Whole numbers in the attributes that netCDF-3 has no type for, such as large seeds,
    are written as text.

    Raises
    ------
    MicrosurfError
        If there is no room for it, or one realisation is larger than 2 GiB.

    """
    plain = result.assign_attrs(
        {
            name: str(value) if isinstance(value, int) and abs(value) >= 2**31 else value
            for name, value in result.attrs.items()
        }
    )
    with whole_file(path) as temporary:
        try:
            plain.to_netcdf(
                temporary, engine="scipy", format="NETCDF3_64BIT", unlimited_dims=["realisation"]
            )
        except OverflowError as error:
            size = result.flux.nbytes / result.sizes["realisation"] / 2**30
            raise MicrosurfError(
                f"{path}: {size:.1f} GiB of lobes a realisation, a netCDF-3 file holds 2; "
                "take fewer angles at a time"
            ) from error


def load(path: Path) -> xr.Dataset:
    """Read a result that `save` wrote.

    Raises
    ------
    InputError
        If the file is missing, truncated or not a result of microsurf.

    """
    check_readable(path, "`microsurf measure --out FILE.nc` writes one")
    try:
        result = xr.load_dataset(path, engine="scipy")
    except Exception as error:  # scipy raises anything from TypeError to IndexError here
        raise InputError(f"{path}: not a netCDF file, or truncated; measure it again") from error
    if "flux" not in result or result.flux.dims != _DIMENSIONS:
        raise InputError(f"{path}: not a result of microsurf (no flux with its seven dimensions)")
    if result.flux.shape[-2:] != (RINGS, SECTORS) or not {"source", "scene"} <= set(result.attrs):
        raise InputError(f"{path}: not a result of this microsurf; measure it again")
    return result
