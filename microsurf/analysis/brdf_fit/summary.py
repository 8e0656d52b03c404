"""The numbers of a fit by name, for JSON and for people."""

from dataclasses import asdict
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...scene import BECKMANN
from .fit import BrdfFit, Fitted
from .intervals import Refits
from .later_orders import kd_of
from .parameters import MOST_ETA, gamma_of
from .verdict import NARROW

Array = NDArray[np.float64]

_STILL = 1e-6  # change of η over refits that is none


def figures(fit: BrdfFit) -> dict[str, Any]:
    """Return the keys of ``microsurf fit --json`` for a BRDF.

    γ of Beckmann, ∞, is given as 1e9, as in a scene. What is not known is None.
    """
    measured, best = fit.measured, fit.best
    values: dict[str, Any] = {
        "kind": "brdf",
        "material": fit.material,
        **_known(parameters(best), fit.verdict),
        "log_rms": best.solution.rms,
        "held_out_theta_i": list(fit.held_out),
        "held_out_log_rms": dict(fit.held_out_log_rms),
        "left_out_log_rms": {
            **{name: other.resampled.log_rms for name, other in fit.others.items()},
            "std": fit.one_order.resampled.log_rms,
        },
        "evidence": {
            name: {"gain": row.gain, "p": row.p, "better": row.better, "of": row.of}
            for name, row in fit.evidence.items()
        },
        "verdict": fit.verdict,
        "reason": fit.reason,
        "distributions": {
            name: {**parameters(other), "log_rms": other.solution.rms}
            for name, other in {**fit.others, "std": fit.one_order}.items()
        },
        "orders": "all" if fit.all_orders else "1",
    }
    if fit.all_orders:
        values["one_order"] = values["distributions"]["std"]
        values["held_out_log_rms_all_orders"] = fit.held_out_all_orders
        values["rounds"] = fit.rounds
    solution = fit.one_order.solution
    return {
        **values,
        "starts": solution.starts,
        "refined": solution.refined,
        "agreeing": solution.agreeing,
        "aperture": fit.aperture,
        "zones": [asdict(zone) for zone in fit.zones],
        "pairs": measured.pairs,
        "incidences": int(np.unique(best.question.problem.groups).size),
        "channels": list(measured.channels),
        "wavelengths": list(measured.wavelengths),
        "reader": measured.reader,
        "source": measured.source,
        "remarks": list(measured.remarks),
    }


def _known(values: dict[str, Any], verdict: str) -> dict[str, Any]:
    """Parameters, but none of a lobe that was not resolved."""
    if verdict != NARROW:
        return values
    lobe = ("gamma", "sigma", "azimuth")
    return {name: None if name.startswith(lobe) else value for name, value in values.items()}


def parameters(fit: Fitted) -> dict[str, Any]:
    """Parameters of one fit, each with its 95 % interval."""
    layout, solution = fit.question.layout, fit.solution
    index = {name: k for k, name in enumerate(layout.names)}
    resampled = fit.resampled
    of = layout.values(solution.vector)
    shape = layout.shape(solution.vector)
    values: dict[str, Any] = {"gamma": min(shape.gamma, BECKMANN)}
    if "eta" in index:
        low, high = resampled.interval(of["eta"], index["eta"], 0.0, MOST_ETA)
        ends = [min(gamma_of(high), BECKMANN), min(gamma_of(low), BECKMANN)]
        # Where every refit stops at a bound, they say nothing about how far it is from there.
        etas = resampled.incidences.vectors[:, index["eta"]]
        values["gamma_ci"] = None if np.ptp(etas) < _STILL else ends
    for axis in ("sigma",) if layout.isotropic else ("sigma_x", "sigma_y"):
        name = "sigma_x" if axis == "sigma" else axis
        half = float(resampled.half_width(partial(_logs, fit, name)))
        sigma = getattr(shape, name)
        values[axis] = sigma
        values[f"{axis}_ci"] = [float(sigma * np.exp(-half)), float(sigma * np.exp(half))]
    if not layout.isotropic:
        half = float(
            resampled.half_width(
                lambda r: np.degrees(_halfway(_shapes(fit, r, "azimuth") - shape.azimuth))
            )
        )
        half = min(half, 90.0)
        azimuth = float(np.degrees(shape.azimuth))
        values["azimuth"] = azimuth
        values["azimuth_ci"] = [azimuth - half, azimuth + half]
        values["sigma"] = [values["sigma_x"], values["sigma_y"]]
    for name in ("n", "k"):
        if name in index:
            values[name] = of[name]
            bounds = (float(end[index[name]]) for end in layout.bounds)
            values[f"{name}_ci"] = list(resampled.interval(of[name], index[name], *bounds))
    return {**values, **_by_channel(fit)}


def _logs(fit: Fitted, name: str, refits: Refits) -> Array:
    return np.asarray(np.log(_shapes(fit, refits, name)))


def _shapes(fit: Fitted, refits: Refits, name: str) -> Array:
    """One number of the slopes of each refit, shape (groups,)."""
    shapes = map(fit.question.layout.shape, refits.vectors)
    return np.array([getattr(shape, name) for shape in shapes])


def _halfway(differences: Array) -> Array:
    """Differences of axes, which repeat after half a turn, nearest to 0."""
    return np.asarray((differences + np.pi / 2) % np.pi - np.pi / 2)


def _by_channel(fit: Fitted) -> dict[str, Any]:
    channel, resampled = fit.solution.channel, fit.resampled
    if fit.question.material.body is None:
        half = resampled.half_width(lambda refits: refits.channels)
        return {name: channel[:, k].tolist() for k, name in enumerate(("n", "k"))} | {
            f"{name}_ci": np.stack(
                [np.maximum(channel[:, k] - half[:, k], 0), channel[:, k] + half[:, k]], axis=1
            ).tolist()
            for k, name in enumerate(("n", "k"))
        }
    kd = _kd(fit, fit.solution.vector, channel)
    half = resampled.half_width(
        lambda refits: np.array([_kd(fit, *one) for one in zip(*refits, strict=True)])
    )
    low, high = np.maximum(kd - half, 0), np.minimum(kd + half, 1)
    return {"kd": kd.tolist(), "kd_ci": np.stack([low, high], axis=1).tolist()}


def _kd(fit: Fitted, vector: Array, weights: Array) -> Array:
    """Kd of each channel; a body weight belongs to the index of the same fit."""
    names = fit.question.layout.names
    if "k" in names:
        return weights
    return np.array([kd_of(w, vector[names.index("n")]) for w in weights])
