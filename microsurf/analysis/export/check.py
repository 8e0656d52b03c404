"""How far Mitsuba's reading of a ``.bsdf`` is from what was to be written: `check`."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import MicrosurfError
from ...model import direction
from ...model.single_scattering import importance
from ...results import detector
from .source import Source
from .traced import points_of_bins

Array = NDArray[np.float64]

PAIRS = 20_000
LEAST_COSINE = 0.1
ANGLES = (0.0, 30.0, 60.0, 80.0)
_OFF_AXIS = 1e-4
"""Radians: at azimuth 0 itself Mitsuba 3.9 loses light of an anisotropic ``measured``."""
_MISSING = (
    "mitsuba is not installed, and --check loads the file in it: `pip install 'microsurf[mitsuba]'`"
)


def check(source: Source, path: Path, pairs: int = PAIRS) -> dict[str, float]:
    """Compare the file with its source.

    Pairs have cosθ ≥ 0.1 both; incidence is spread as cosθ, and o drawn as a renderer would.

    Returns
    -------
    dict
        ``error``, Σ |f_file − f| cosθ_o/pdf over Σ f cosθ_o/pdf of all pairs and channels; and
        ``albedo_error``, the largest relative error of an albedo at ANGLES (of the light with
        cosθ_o ≥ 0.1).

    Raises
    ------
    MicrosurfError
        If Mitsuba is not there.

    """
    rng = np.random.default_rng(0)
    theta = np.arccos(np.sqrt(rng.uniform(LEAST_COSINE**2, 1, pairs)))
    i = direction(theta, rng.uniform(0, 2 * np.pi, pairs))
    here, there = _both(source, path, i, rng)
    albedos = []
    for angle in ANGLES:
        at = direction(
            np.full(pairs // 4, np.radians(angle)), rng.uniform(0, 2 * np.pi, pairs // 4)
        )
        one, other = _both(source, path, at, rng)
        albedos.append(abs(other.sum() / one.sum() - 1))
    error = np.abs(there - here).sum() / here.sum()
    return {"error": float(error), "albedo_error": float(max(albedos))}


def check_traced(source: Source, path: Path) -> dict[str, float]:
    """Compare the file with the bins of the trace that it was made of.

    Returns
    -------
    dict
        ``error``, Σ |file − trace| over Σ trace of all bins, incidences and channels;
        ``trace_error``, what the trace's standard errors alone would make of it, were the file
        right; ``albedo_error``, the largest relative error of an albedo.

    Raises
    ------
    MicrosurfError
        If Mitsuba is not there.

    """
    bins = source.traced
    if bins is None:
        raise ValueError(f"{source.name}: is not traced")
    theta_o, turn = points_of_bins()
    area = detector.projected_solid_angles()
    there = np.empty_like(bins.energy)
    for t, theta in enumerate(np.radians(bins.theta_i)):
        for p, phi in enumerate(np.radians(bins.phi_i) + _OFF_AXIS):
            o = direction(theta_o.ravel(), phi + turn.ravel())
            i = np.broadcast_to(direction(theta, phi), o.shape)
            f = in_mitsuba(path, source.wavelengths, i, o) / o[:, 2:]
            of_bins = f.reshape(*theta_o.shape, -1).mean(axis=2)[..., : there.shape[2]]
            there[t, p] = np.moveaxis(of_bins, -1, 0) * area
    whole = bins.energy.sum()
    albedo = there.sum(axis=(-2, -1)) / bins.energy.sum(axis=(-2, -1)) - 1
    return {
        "error": float(np.abs(there - bins.energy).sum() / whole),
        # The mean of |x| of a Gaussian is √(2/π) of its standard deviation.
        "trace_error": float(np.sqrt(2 / np.pi) * bins.error.sum() / whole),
        "albedo_error": float(np.abs(albedo).max()),
    }


def _both(source: Source, path: Path, i: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """f cosθ_o/pdf by the source and by the file at one o for each i, shape (pairs, channels)."""
    drawn = importance.sample(source.scene, i, rng, several=True)
    density = importance.density(source.scene, i, drawn.o, several=True)
    used = (drawn.o[:, 2] >= LEAST_COSINE) & (density > 0)
    i, o, density = i[used], drawn.o[used], density[used]
    here = source.evaluate(i, o) * (o[:, 2] / density)[:, None]
    there = in_mitsuba(path, source.wavelengths, i, o) / density[:, None]
    return here, there[:, : here.shape[1]]


def in_mitsuba(path: Path, wavelengths: tuple[float, ...], i: Array, o: Array) -> Array:
    """f cosθ_o as Mitsuba's plug-in ``measured`` evaluates it, shape (pairs, channels).

    Raises
    ------
    MicrosurfError
        If Mitsuba is not there.

    """
    try:
        import mitsuba as mi  # noqa: PLC0415 - an extra, which may be absent
    except ImportError as error:
        raise MicrosurfError(_MISSING) from error
    mi.set_variant("scalar_spectral" if wavelengths else "scalar_rgb")
    bsdf = mi.load_dict({"type": "measured", "filename": str(path)})
    if not wavelengths:
        return _evaluated(mi, bsdf, i, o, None)
    blocks = [(wavelengths[k : k + 4] * 4)[:4] for k in range(0, len(wavelengths), 4)]
    values = [_evaluated(mi, bsdf, i, o, block) for block in blocks]
    return np.concatenate(values, axis=1)[:, : len(wavelengths)]


def _evaluated(mi: Any, bsdf: Any, i: Array, o: Array, wavelengths: Any) -> Array:
    si, context = mi.SurfaceInteraction3f(), mi.BSDFContext()
    if wavelengths is not None:
        si.wavelengths = list(wavelengths)
    evaluate, values = bsdf.eval, []
    for one, other in zip(i.tolist(), o.tolist(), strict=True):
        si.wi = one
        values.append(list(evaluate(context, si, other)))
    return np.array(values)
