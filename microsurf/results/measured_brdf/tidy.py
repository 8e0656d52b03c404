"""Say what is odd about a measured BRDF, and leave out what can't be used.

Values are never changed. Pairs that no BRDF has are left out and counted; the rest is said.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from .scattered import MeasuredBrdf

_HORIZON = np.pi / 2
_SATURATED = 4  # equal largest values from which on chance is no explanation
_TOO_BRIGHT = 1e6  # sr⁻¹: above it a value is a sentinel or has another unit
_DEGREE = np.pi / 180


def tidy(brdf: MeasuredBrdf) -> MeasuredBrdf:
    """Put directions into the upper hemisphere and add remarks on what is odd.

    Raises
    ------
    InputError
        If no pair is left, a channel has no value, or an angle is not finite.

    """
    angles = np.stack([brdf.theta_i, brdf.phi_i, brdf.theta_o, brdf.phi_o])
    if not np.isfinite(angles).all():
        bad = int(np.count_nonzero(~np.isfinite(angles).all(axis=0)))
        raise InputError(f"{bad} of {brdf.pairs} pairs: an angle is no finite number; remove them")
    brdf = _usable(_unsigned(brdf))
    if (without := np.isnan(brdf.values).all(axis=0)).any():
        which = ", ".join(np.array(brdf.channels)[without])
        raise InputError(f"no usable value at {which}; leave these channels out of the file")
    return brdf.remarked(*_odd_values(brdf), *_odd_sides(brdf))


def _unsigned(brdf: MeasuredBrdf) -> MeasuredBrdf:
    """Polar angles with a sign become positive: −θ at φ is θ at φ + 180°."""
    remarks = []
    for name, text in (("i", "incidence"), ("o", "detector")):
        theta, phi = getattr(brdf, f"theta_{name}"), getattr(brdf, f"phi_{name}")
        negative = theta < 0
        if negative.any():
            remarks.append(
                f"{int(negative.sum())} pairs store the polar angle of the {text} with a minus "
                "sign: read as the positive angle at azimuth + 180°"
            )
            phi = np.where(negative, phi + np.pi, phi)
            brdf = replace(brdf, **{f"theta_{name}": np.abs(theta), f"phi_{name}": phi})
    return brdf.remarked(*remarks)


def _usable(brdf: MeasuredBrdf) -> MeasuredBrdf:
    """Leave out what lies at or below the horizon, and values that are no BRDF."""
    values = brdf.values
    cosine = np.cos(brdf.theta_o)[:, None]
    with np.errstate(invalid="ignore"):
        wild = np.isinf(values) | (values > _TOO_BRIGHT) | (values * cosine <= -1)
    below = (brdf.theta_i >= _HORIZON - 1e-9) | (brdf.theta_o >= _HORIZON - 1e-9)
    values = np.where(wild, np.nan, values)
    empty = np.isnan(values).all(axis=1)
    remarks = []
    if below.any():
        remarks.append(f"{_share(below)} pairs at or below the horizon are left out")
    if wild.any():
        remarks.append(
            f"{int(wild.sum())} values below −1/cosθ or above {_TOO_BRIGHT:g} sr⁻¹ are no BRDF "
            "(a sentinel?) and are left out"
        )
    if (empty & ~below).any():
        remarks.append(f"{_share(empty & ~below)} pairs have no value and are left out")
    kept = replace(brdf, values=values).select(~below & ~empty)
    if kept.pairs == 0:
        raise InputError(
            f"none of {brdf.pairs} pairs has both directions above the horizon and a value; "
            "look at its columns and at the unit of its angles"
        )
    return kept.remarked(*remarks)


def _odd_values(brdf: MeasuredBrdf) -> list[str]:
    values, remarks = brdf.values, []
    known = ~np.isnan(values)
    negative = known & (values < 0)
    if negative.any():
        remarks.append(
            f"{_share(negative[known])} values are negative (down to {values[negative].min():.3g} "
            "sr⁻¹): kept, as the noise about a small value"
        )
    zero = known & (values == 0)
    if np.count_nonzero(zero) > 1:
        remarks.append(
            f"{_share(zero[known])} values are exactly 0: kept; they may stand for what was "
            "not measured"
        )
    top = np.nanmax(values, axis=0)
    equal = np.count_nonzero(values == top, axis=0)
    for name, often, value in zip(brdf.channels, equal, top, strict=True):
        if often >= _SATURATED and value > 0:
            remarks.append(
                f"saturation? {often} pairs of channel {name} share its largest value "
                f"{value:.6g} sr⁻¹"
            )
    return remarks


def _odd_sides(brdf: MeasuredBrdf) -> list[str]:
    """Point out lobes on the side of the light: azimuths of where light goes, not comes from."""
    oblique = (brdf.theta_i > 25 * _DEGREE) & (brdf.theta_o > 25 * _DEGREE)
    toward = np.cos(brdf.phi_o - brdf.phi_i)
    level = np.nanmean(brdf.values, axis=1)
    back, forward = level[oblique & (toward > 0.9)], level[oblique & (toward < -0.9)]
    if len(back) > 2 and len(forward) > 2 and back.max() > 3 * forward.max():
        remark = (
            f"the largest values lie on the side of the light ({back.max():.3g} sr⁻¹ against "
            f"{forward.max():.3g} on the mirror side): a retroreflector, or azimuths of where the "
            "light travels to; add 180° to phi_i if so"
        )
        return [remark]
    return []


def _share(mask: NDArray[np.bool_]) -> str:
    return f"{int(np.count_nonzero(mask))} of {mask.size}"
