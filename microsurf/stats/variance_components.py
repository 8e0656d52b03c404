"""Rays and surfaces separated: a one-way analysis of variance, and what to buy next.

The mean over R surfaces has the variance (σ_b² + σ_w²)/R: σ_b is the standard deviation
*between* surfaces, σ_w *within* one, from its finite number of rays. The spread s² of
the surfaces' means estimates σ_b² + σ_w², their batches know σ_w² alone; what is left is
σ_b² = max(0, s² − σ_w²). Its interval is that of Tukey (1951) and Williams (1962):

    (R−1)(s² − F₊σ_w²)/χ²₊ … (R−1)(s² − F₋σ_w²)/χ²₋

with the upper and lower quantiles of F on (R−1, ν) and of χ² on R−1 degrees of freedom.
It asks for surfaces whose means are normally distributed; its coverage is then the
stated one or a little more. ν is `intervals.dof_of_sum`: what the mean of several
variances of few batches each is worth.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import special

from ..errors import InputError, float_array
from . import intervals
from .intervals import CONFIDENCE

KNOWN = 1e9
"""Degrees of freedom of a variance that is known."""


@dataclass(frozen=True)
class VarianceComponents:
    """How well a mean over surfaces is known, and from what its error comes.

    Attributes
    ----------
    surfaces : int
        R.
    mean, error : float
        Over the surfaces, and its standard error; of the rays if there is one surface.
    within : float
        σ_w, standard deviation of one surface's value from its rays.
    between, low, high : float
        σ_b and its 95 % interval; of one surface nothing is known: 0, 0 and ∞.

    """

    surfaces: int
    mean: float
    error: float
    within: float
    between: float
    low: float
    high: float

    @property
    def floor(self) -> float:
        """Error that is left however many rays there are."""
        return self.between / float(np.sqrt(self.surfaces))

    @property
    def dominant(self) -> str:
        """Say "rays", "surfaces", or "either" where the interval of σ_b does not tell."""
        if self.high < self.within:
            return "rays"
        return "surfaces" if self.low > self.within else "either"


def components_of(
    values: NDArray[np.float64], ray_variance: NDArray[np.float64], dof: float = KNOWN
) -> VarianceComponents:
    """Tell rays and surfaces apart from each surface's value and the variance of its rays.

    ``dof`` is that of the mean of ``ray_variance``, see `intervals.dof_of_sum`. Values and
    variances of a lobe have its bins as further dimensions: variances are then summed
    over them, and the mean is the root of the sum of squares. Bins may vary all together
    between surfaces, so that their sum is worth R−1 degrees of freedom, as one bin is; if
    each varies on its own the interval of σ_b is wider than it need be.
    """
    values = float_array("values", values)
    ray_variance = float_array("ray_variance", ray_variance)
    count = len(values)
    if count == 0 or ray_variance.shape != values.shape:
        raise InputError(f"values {values.shape}, variances {ray_variance.shape}: one of each")
    bins = values.reshape(count, -1)
    mean = bins.mean(axis=0)
    size = float(mean[0]) if values.ndim == 1 else float(np.sqrt((mean**2).sum()))
    within = float(ray_variance.reshape(count, -1).sum(axis=1).mean())
    if count == 1:
        error = float(np.sqrt(within))
        return VarianceComponents(1, size, error, error, 0.0, 0.0, float("inf"))
    total = float(bins.var(axis=0, ddof=1).sum())
    return of_variances(count, size, total, within, dof)


def of_variances(
    count: int, mean: float, total: float, within: float, dof: float = KNOWN
) -> VarianceComponents:
    """The same from s² (``total``) and σ_w² (``within``) of ``count`` > 1 surfaces."""
    free, of_rays = count - 1, min(dof, KNOWN)
    tails = (1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2
    high, low = (
        free
        * max(total - within * float(special.fdtri(free, of_rays, tail)), 0.0)
        / intervals.chi_square(tail, free)
        for tail in tails
    )
    between = max(total - within, 0.0)
    roots = (float(np.sqrt(v)) for v in (total / count, within, between, low, high))
    return VarianceComponents(count, mean, *roots)


@dataclass(frozen=True)
class Improvement:
    """What halves the error of a mean.

    Attributes
    ----------
    dominant : str
        "rays", "surfaces" or "either", see `VarianceComponents`.
    rays : float or None
        How many times the rays; None if surfaces alone leave more than half.
    surfaces : int or None
        How many of them in all; None where there is no other.
    text : str
        The same in one line.

    """

    dominant: str
    rays: float | None
    surfaces: int | None
    text: str


def improvement(components: VarianceComponents, *, only: bool = False) -> Improvement:
    """What to buy next; ``only``: there is one surface and no other, flat or from a file.

    A finer mesh or a larger tile is never part of it: what they leave does not show in
    any spread, `microsurf convergence` measures it.
    """
    if components.error == 0:
        return Improvement("rays", None, None, "no error: nothing to buy")
    if only:
        return Improvement(
            "rays", 4.0, None, "4 times the rays halve it; there is one surface only"
        )
    if components.surfaces == 1:
        text = "one surface does not tell what others would: trace at least 4"
        return Improvement("either", None, 4, text)
    surfaces = 4 * components.surfaces
    within, between = components.within**2, components.between**2
    room = max(components.error**2 * components.surfaces, within) / 4 - between
    rays = within / room if room > 0 and within > 0 else None
    more = f"{surfaces} surfaces instead of {components.surfaces} halve it"
    left = components.floor / components.error
    if rays is None:
        text = f"{more}; rays alone leave {100 * min(left, 1):.0f} % of it"
    else:
        text = f"{rays:.3g} times the rays halve it, or {more.removesuffix(' halve it')}"
    return Improvement(components.dominant, rays, surfaces, f"{_WHY[components.dominant]}: {text}")


_WHY = {
    "rays": "rays dominate",
    "surfaces": "surfaces dominate",
    "either": "too few surfaces to tell what dominates",
}
