"""A user BRDF's lobes in the detector's bins: the same Dataset as every prediction."""

import time
from itertools import product

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...errors import InputError
from ...physics import facet
from ...results import detector
from ...scene import Scene
from ...scene.layers import refuse
from ..directions import direction
from ..prediction import prediction
from .bin_integrals import integrate
from .brdf import ALL, BODY, SPECULAR, UserBrdf

Array = NDArray[np.float64]

_REFUSED = 0.02
"""Relative error of a sum over values beyond which they are no function one can integrate."""


def predict_user_brdf(brdf: UserBrdf, scene: Scene) -> xr.Dataset:
    """Integrate a user BRDF over the bins, at the incidences of a scene of one Kd.

    Returns
    -------
    xarray.Dataset
        As `microsurf.results.datasets` describes, one realisation and order 1 alone; ``orders`` in
        its attributes is "1", "1 and all" of one whose pair is all its light, or "all" of a
        user BRDF that holds all orders and kinds together: all its light then stands under
        order 1 with no body event.
        ``relative_error[part, theta_i, phi_i]`` bounds the error of the albedo: of the
        quadrature, and of a table what leaving out every second of its θ_o and φ_o
        changes. Without a substrate a body part has no place in it: ``stray_body`` is its
        largest albedo.

    Raises
    ------
    InputError
        If the values are no BRDF's, can't be integrated to 2 %, or the scene has two layers.

    """
    refuse(scene.layers, f"the user BRDF {brdf.name}")
    begin = time.perf_counter()
    thetas, phis = scene.light.theta, scene.light.phi
    flux = np.zeros((1, len(thetas), len(phis), 1, 2, detector.RINGS, detector.SECTORS))
    (kd,) = scene.material.kd
    weight = float(facet.body_weight(scene.material.n, kd))
    names: tuple[str, ...] = ()
    errors, stray = [], 0.0
    for (t, theta), (p, phi) in product(enumerate(thetas), enumerate(phis)):
        names, bins, error = _lobes(brdf, scene, *np.radians([theta, phi]))
        _check(brdf, names, error, bins, (theta, phi))
        flux[0, t, p, 0, 0] = bins[0]
        if len(names) == 2 and weight > 0:
            flux[0, t, p, 0, 1] = bins[1] / weight
        elif len(names) == 2:
            stray = max(stray, float(bins[1].sum()))
        errors.append(error)
    pair = "1 and all" if brdf.whole else "1"
    attrs: dict[str, str | float | int] = {
        "orders": "all" if names == (ALL,) else pair,
        "stray_body": stray,
        "seconds": time.perf_counter() - begin,
    }
    predicted = prediction(scene, brdf.name, flux, attrs, orders=(1,))
    relative = np.array(errors).reshape(len(thetas), len(phis), len(names))
    return predicted.assign_coords(part=list(names)).assign(
        relative_error=(("theta_i", "phi_i", "part"), relative)
    )


def _lobes(
    brdf: UserBrdf, scene: Scene, theta: float, phi: float
) -> tuple[tuple[str, ...], Array, Array]:
    """Names of the parts, their energies by bin, and their relative errors."""
    i = direction(theta, phi)

    def values(which: UserBrdf, o: Array) -> Array:
        parts = which.evaluate(np.broadcast_to(i, o.shape), o, scene)
        return np.stack(list(parts.values()))

    bins, error = integrate(lambda o: values(brdf, o), theta, phi)
    names = (ALL,) if len(bins) == 1 else (SPECULAR, BODY)
    if brdf.mirror is not None:
        bins[0, detector.ring_of(float(np.degrees(theta))), detector.SECTORS // 2] += brdf.mirror(
            i, scene
        )
    if brdf.table is not None:
        halved = UserBrdf(brdf.name, brdf.table.coarser())
        coarse, _ = integrate(lambda o: values(halved, o), theta, phi)
        total, other = (b.sum(axis=(1, 2)) for b in (bins, coarse))
        error = error + np.abs(total - other) / np.where(total > 0, total, 1.0)
    return names, bins, error


def _check(
    brdf: UserBrdf, names: tuple[str, ...], error: Array, bins: Array,
    angles: tuple[float, float],
) -> None:  # fmt: skip
    """Refuse what its values do not determine."""
    for name, off, lobe in zip(names, error, bins, strict=True):
        if off > _REFUSED and lobe.sum() > 0 and brdf.table is None:
            raise InputError(
                f"--model {brdf.name}: {name} f at θ_i = {angles[0]:g}, φ_i = {angles[1]:g} "
                f"can't be integrated: two rules differ by {off:.1%}, {_REFUSED:.0%} are allowed; "
                "it must be a smooth function, without spikes or noise"
            )
