"""One surface's fit with all that says how far to trust it.

Besides STD's γ and σ: GGX's and Beckmann's σ on the same facets, the fit at coarser
pixels, the step of the instrument's heights as a slope, and the part of the fitted
surface that a mesh of that size can't hold.
"""

import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...physics import student_t
from ...surface import Heightfield
from ...surface.fit import LEAST_LENGTHS, StdFit, fit_std, rho2, slopes_to_fit
from ...surface.slope_likelihood import maximise
from ...surface.statistics import (
    correlation_lengths,
    height_parameters,
    ks_distance,
    lengths_across,
)
from .quantisation import height_step

Array = NDArray[np.float64]

MODELS = {"beckmann": 0.0, "ggx": 1.0}
"""η = 1/(γ−1) of the distributions that STD contains."""
LEAST_CELLS = 32
"""A side, at the coarsest pixel that is fitted: four to each tile of the intervals."""
HELD = 0.01
"""Share of STD's area that may be steeper than a mesh holds."""


@dataclass(frozen=True, eq=False)
class SurfaceStudy:
    """What `study_surface` found; ``surface`` is the levelled one.

    models: {name: {sigma, ks}} for Beckmann, GGX and STD. scales: rows of pixel, gamma,
    sigma and their intervals. height_step in the unit of heights, or None.
    """

    surface: Heightfield
    fit: StdFit
    scatters: dict[str, Array]
    models: dict[str, dict[str, float]]
    scales: list[dict[str, Any]]
    height_step: float | None
    tail: dict[str, float | None]
    seconds: float


def study_surface(stored: Heightfield, levelled: Heightfield) -> SurfaceStudy:
    """Fit a surface.

    Parameters
    ----------
    stored, levelled : Heightfield
        As it was read, where the step of its heights is seen, and without its trend.

    Raises
    ------
    InputError
        If no STD fits, see `fit_std`.

    """
    begin = time.perf_counter()
    fit = fit_std(levelled)
    p, q = slopes_to_fit(levelled)
    scatters = {
        name: maximise(p, q, isotropic=fit.isotropic, eta=eta).scatter
        for name, eta in MODELS.items()
    }
    models = {}
    for name, scatter in scatters.items():
        eta = MODELS[name]
        rho = np.sqrt(np.sort(rho2(p, q, scatter)))
        models[name] = {
            "sigma": float(np.linalg.det(scatter) ** 0.25),
            "ks": ks_distance(rho, np.inf if eta == 0 else 1 + 1 / eta),
        }
    models["std"] = {"sigma": fit.sigma, "ks": fit.ks}
    heights = stored.heights if stored.filled is None else stored.heights[~stored.filled]
    return SurfaceStudy(
        surface=levelled,
        fit=fit,
        scatters=scatters,
        models=models,
        scales=_scales(levelled, fit),
        height_step=height_step(heights),
        tail=_tail(fit),
        seconds=time.perf_counter() - begin,
    )


def _scales(h: Heightfield, finest: StdFit) -> list[dict[str, Any]]:
    """The fit at 1, 2, 4 … pixels: every so-manyth height, nothing averaged."""
    rows = [_scale_row(h, finest)]
    factor = 2
    while min(h.heights.shape) // factor >= LEAST_CELLS:
        coarse = Heightfield(
            h.heights[::factor, ::factor],
            (h.pixel[0] * factor, h.pixel[1] * factor),
            # A part of a period need not close: what lies across the edge is left out.
            "mirror",
            filled=None if h.filled is None else h.filled[::factor, ::factor],
        )
        try:
            rows.append(_scale_row(coarse, fit_std(coarse)))
        except InputError:  # too few measured facets, or too flat: no coarser one either
            break
        factor *= 2
    return rows


def _scale_row(h: Heightfield, fit: StdFit) -> dict[str, Any]:
    return {
        "pixel": list(h.pixel),
        "gamma": fit.gamma,
        "gamma_ci": list(fit.gamma_ci),
        "sigma": fit.sigma,
        "sigma_ci": list(fit.sigma_ci),
        "ks": fit.ks,
        "facets": fit.facets,
    }


def _tail(fit: StdFit) -> dict[str, float | None]:
    """What a mesh of as many facets can't hold of the fitted STD, and the least γ it can hold."""

    def share(gamma: float) -> float:
        steepest = float(student_t.slope_quantile(1 - 0.5 / fit.facets, gamma, fit.sigma))
        return student_t.area_beyond(steepest, gamma, fit.sigma)

    low, high = 1.5 + 1e-6, 3.0
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if share(middle) > HELD else (low, middle)
    return {
        "area_beyond": share(fit.gamma) if fit.gamma > 1.5 else None,
        "least_gamma_held": high,
    }


def as_json(study: SurfaceStudy) -> dict[str, Any]:
    """The figures of a fit; ∞ is the text "inf", since JSON has no such number."""
    fit, h = study.fit, study.surface
    along_x, along_y = correlation_lengths(h)
    step = study.height_step
    slopes = None if step is None else [step / d for d in h.pixel]
    values = {
        "kind": "surface",
        "gamma": fit.gamma,
        "gamma_ci": fit.gamma_ci,
        "sigma": fit.sigma,
        "sigma_ci": fit.sigma_ci,
        "isotropic": fit.isotropic,
        "isotropy_p": fit.isotropy,
        "sigma_x": fit.sigma_x,
        "sigma_x_ci": fit.sigma_x_ci,
        "sigma_y": fit.sigma_y,
        "sigma_y_ci": fit.sigma_y_ci,
        "azimuth": fit.azimuth,
        "azimuth_ci": fit.azimuth_ci,
        "ks": fit.ks,
        "models": study.models,
        "facets": fit.facets,
        "effective_facets": fit.effective_facets,
        "pixel": h.pixel,
        "cells": h.heights.shape,
        "unit": h.provenance.get("unit"),
        "boundary": h.boundary,
        "scales": study.scales,
        "height_step": step,
        "slope_step": slopes,
        "slope_step_over_sigma": None if slopes is None else [s / fit.sigma for s in slopes],
        "tail": study.tail,
        **height_parameters(h),
        "correlation_x": None if along_x is None else along_x * h.pixel[0],
        "correlation_y": None if along_y is None else along_y * h.pixel[1],
        "remarks": _remarks(h),
        "voids": h.provenance.get("voids", {"share": 0.0, "treatment": "none"}),
        "level": h.provenance.get("level", "none"),
        "reader": h.provenance.get("reader", "microsurf"),
        "provenance": dict(h.provenance),
        "seconds": study.seconds,
    }
    plain = _plain(values)
    assert isinstance(plain, dict)  # noqa: S101 - for the type checker
    return plain


def _remarks(h: Heightfield) -> list[str]:
    """What makes the intervals doubtful, for people."""
    across = lengths_across(h)
    if across >= LEAST_LENGTHS:
        return []
    said = "too few to see how facets hang together: one of each correlation area counts"
    advice = f"take a surface of {LEAST_LENGTHS} or more, or fill voids instead of cropping"
    wide = f"{across:.3g} correlation lengths" if across else "less than a correlation length"
    return [f"{wide} across, {said}; {advice}"]


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(v) for key, v in value.items()}
    if isinstance(value, tuple | list):
        return [_plain(v) for v in value]
    return "inf" if isinstance(value, float) and np.isinf(value) else value
