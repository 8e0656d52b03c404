"""How far a sampled answer is from an uncertain reference: E² with its interval.

x̄ is the mean of K draws of a method that averages n of them, r̄ that of R draws of the
reference, of one component or many (the bins of a lobe); V_x and V_r their covariances,
C = V_x/K + V_r/R that of b = x̄ − r̄. The squared error of the method, its noise in it, is

    E² = β² + ν²,   β² = |b|² − tr C,   ν² = tr V_x / n.

Along b the mean is uncertain by s² = u'Cu (u = b/|b|, Student's t with Satterthwaite's
degrees of freedom), which gives β its interval about √(|b|² − tr C + s²); the noise across b, whose
expectation is taken out, leaves ±z √(2 (tr C² − s⁴)(1 + 1/(R−1))) in β²; ν² has that of χ²
with (K−1)(tr V)²/tr V² degrees of freedom. The parts are put together by the method of
variance estimates recovery (Zou and Donner, Statistics in Medicine 27, 2008) above; below
both are at their least, which is wider but right also where noise hides β. With one
component and an exact method that is |b| ± t s.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import float_array
from . import intervals
from .intervals import CONFIDENCE

Array = NDArray[np.float64]

_KNOWN = 1e9


@dataclass(frozen=True)
class Interval:
    """E² ≥ 0, its two-sided 95 % interval, and its one-sided upper 95 % limit."""

    value: float
    low: float
    high: float
    below: float


def value(sample: Array, reference: Array, draws: float) -> float:
    """Estimate E² without bias; below 0 where noise hides it."""
    sample, reference = float_array("sample", sample), float_array("reference", reference)
    apart = float(((sample.mean(axis=0) - reference.mean(axis=0)) ** 2).sum())
    noise = _trace(sample)
    return apart - noise / len(sample) - _trace(reference) / len(reference) + noise / draws


def _trace(sample: Array) -> float:
    return float(sample.var(axis=0, ddof=1).sum()) if len(sample) > 1 else 0.0


def interval(sample: Array, reference: Array, draws: float) -> Interval:
    """E² of draws of shape (K, components) and (R, components); one own draw has no noise."""
    sample, reference = float_array("sample", sample), float_array("reference", reference)
    shift = sample.mean(axis=0) - reference.mean(axis=0)
    length = float(np.linalg.norm(shift))
    parts = [(s - s.mean(axis=0), len(s)) for s in (sample, reference) if len(s) > 1]
    towards = shift / length if length > 0 else parts[-1][0][0] * 0
    along, dof = _along(parts, towards)
    across = sum(float((rest**2).sum()) / (count * (count - 1)) for rest, count in parts) - along
    beta2 = max(length**2 - max(across, 0.0), 0.0)
    rest = np.sqrt(2 * max(_square_trace(parts) - along**2, 0.0) * (1 + 1 / (len(reference) - 1)))
    noise, noise_dof = _noise(sample, draws)
    ends = []
    for level in ((1 + CONFIDENCE) / 2, CONFIDENCE):
        half = intervals.student(dof, 2 * level - 1) * np.sqrt(along)
        beta = np.sqrt(beta2)
        hidden = intervals.normal(2 * level - 1) * rest
        quantiles = (intervals.chi_square(p, noise_dof) for p in (level, 1 - level))
        least, most = (noise * noise_dof / q for q in quantiles)
        low = max(max(beta - half, 0.0) ** 2 - hidden, 0.0) + least
        up = np.linalg.norm([(beta + half) ** 2 - beta2, hidden, most - noise])
        ends.append((low, beta2 + noise + float(up)))
    estimate = max(value(sample, reference, draws), 0.0)
    (low, high), (_, below) = ends
    return Interval(estimate, min(low, estimate), high, below)


def _along(parts: list[tuple[Array, int]], towards: Array) -> tuple[float, float]:
    """Variance of b along a direction, and its degrees of freedom."""
    variances = [
        (float(((rest @ towards) ** 2).sum()) / (count * (count - 1)), count - 1)
        for rest, count in parts
    ]
    of_parts, free = zip(*variances, strict=True)
    return sum(of_parts), float(intervals.dof_of_sum(of_parts, free))


def _square_trace(parts: list[tuple[Array, int]]) -> float:
    """Tr C² from the products of all deviations with each other."""
    scaled = [rest / np.sqrt(count * (count - 1)) for rest, count in parts]
    total = 0.0
    for k, (one, (_, count)) in enumerate(zip(scaled, parts, strict=True)):
        total += _unbiased(one, count)
        total += 2 * sum(float(((one @ other.T) ** 2).sum()) for other in scaled[k + 1 :])
    return total


def _unbiased(scaled: Array, count: int) -> float:
    """Tr V² of a sample from its deviations whose squares sum up to tr V (Bai, Saranadasa 1996)."""
    free = count - 1
    square = float(((scaled @ scaled.T) ** 2).sum())
    trace2 = float((scaled**2).sum()) ** 2
    if free < 2 or scaled.shape[1] == 1:
        return square
    least = trace2 / scaled.shape[1]
    return float(max(free**2 / ((free - 1) * (free + 2)) * (square - trace2 / free), least))


def _noise(sample: Array, draws: float) -> tuple[float, float]:
    """ν² and its degrees of freedom."""
    count = len(sample)
    trace = _trace(sample)
    if trace == 0:
        return 0.0, _KNOWN
    scaled = (sample - sample.mean(axis=0)) / np.sqrt(count - 1)
    return trace / draws, max((count - 1) * trace**2 / _unbiased(scaled, count), count - 1.0)
