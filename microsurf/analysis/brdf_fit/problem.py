"""What a fit is made of: pairs, logarithms of what was measured, and groups of incidences.

Metric of Löw, Kronander, Ynnerman and Unger, "BRDF Models for Accurate and Efficient
Rendering of Glossy Surfaces", ACM TOG 31(1), 2012: with f measured and m modelled,
Σ [ln(1 + f cosθ_o) − ln(1 + m cosθ_o)]², so that peaks do not drown everything else and
dark noise does not either.
"""

from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...results.measured_brdf import MeasuredBrdf
from .recent import Recent

Array = NDArray[np.float64]

LEAST_INCIDENCES = 3
"""Incidences that resampling needs at least."""
MOST_GROUPS = 40
"""More incidences than that are resampled in groups of neighbours."""
MOST_PAIRS = 4000
"""More pairs than that are thinned: a fit of few parameters does not need them."""
_SAME_ANGLE = np.radians(0.05)


class Collected(NamedTuple):
    """Directions that the detector collects for each pair, and what follows from them alone.

    o : unit directions, shape (pairs, points, 3), the zenith for those below the horizon;
    share : weight of each in what the detector sees, 0 for these; normal : of the facet that
    mirrors i to each, shape (pairs, points, 3), and half : the cosine there.
    """

    o: Array
    share: Array
    normal: Array
    half: Array

    def turned(self, turn: Array) -> "Collected":
        """Return them with the directions times a matrix about the vertical."""
        return self._replace(o=self.o @ turn, normal=self.normal @ turn)


def collected(i: Array, o: Array, cone: Array | None) -> Collected:
    """Directions of a cone about each o, shape (pairs, points, 3), or o alone."""
    i, points = i[:, None], o[:, None] if cone is None else cone
    up = points[..., 2] > 0
    points = np.where(up[..., None], points, [0.0, 0.0, 1.0])
    share = np.where(up, points[..., 2], 0.0) / (points.shape[1] * o[:, 2:])
    normal = i + points
    length = np.linalg.norm(normal, axis=-1)
    return Collected(points, share, normal / length[..., None], np.minimum(length / 2, 1.0))


@dataclass(frozen=True)
class Problem:
    """Pairs of a measured BRDF as a fit sees them.

    i, o : unit directions, shape (pairs, 3); collected : what the detector sees; cosine :
    cosθ_o, shape (pairs,); logs : ln(1 + f cosθ_o), shape (pairs, channels), 0 where
    ``known`` is false; groups : number of the group of incidences of each pair; recent : light
    of the slopes tried last.
    """

    i: Array
    o: Array
    collected: Collected
    cosine: Array
    logs: Array
    known: NDArray[np.bool_]
    groups: NDArray[np.intp]
    recent: Recent[Any] = field(default_factory=Recent, repr=False, compare=False)

    def select(self, rows: NDArray[np.bool_]) -> "Problem":
        """Return some of the pairs."""
        return replace(
            self,
            i=self.i[rows],
            o=self.o[rows],
            collected=Collected(*(values[rows] for values in self.collected)),
            cosine=self.cosine[rows],
            logs=self.logs[rows],
            known=self.known[rows],
            groups=self.groups[rows],
            recent=self.recent.select(rows),
        )

    def of_channels(self, channels: NDArray[np.intp]) -> "Problem":
        """Return some of the channels, by their numbers."""
        return replace(self, logs=self.logs[:, channels], known=self.known[:, channels])

    def residuals(self, model: Array) -> Array:
        """Measured less modelled logarithms, shape (pairs, channels); 0 where nothing is known."""
        # A noisy correction may push a dark model below −1/cosθ: keep the logarithm.
        flux = np.maximum(model * self.cosine[:, None], -0.999)
        return np.where(self.known, self.logs - np.log1p(flux), 0.0)

    def rms(self, residuals: Array) -> float:
        """Root mean square of residuals over what is known."""
        return float(np.sqrt(np.sum(residuals**2) / np.count_nonzero(self.known)))


def incidences(brdf: MeasuredBrdf, *, isotropic: bool) -> NDArray[np.intp]:
    """Number of the incidence of each pair; only θ_i tells them apart if ``isotropic``."""
    theta = np.round(brdf.theta_i / _SAME_ANGLE)
    if isotropic:
        keys = theta[:, None]
    else:
        turn = round(2 * np.pi / _SAME_ANGLE)
        azimuth = np.where(theta == 0, 0, np.round(brdf.phi_i / _SAME_ANGLE) % turn)
        keys = np.stack([theta, azimuth], axis=1)
    return np.unique(keys, axis=0, return_inverse=True)[1].reshape(-1)


def problem_of(brdf: MeasuredBrdf, *, isotropic: bool = True, cone: Array | None = None) -> Problem:
    """Make the problem of a measured BRDF.

    Raises
    ------
    InputError
        If there are fewer than three incidences, from resampling of which intervals come, or
        one θ_o only: by reciprocity that is the BRDF of one incidence; or if all directions lie
        as near to the normal as angles in radians taken for degrees.

    """
    number = incidences(brdf, isotropic=isotropic)
    count = int(number.max()) + 1
    if count < LEAST_INCIDENCES:
        shown = ", ".join(f"{a:.4g}°" for a in np.unique(np.degrees(brdf.theta_i).round(1)))
        raise InputError(
            f"{brdf.source}: {count} incidence{'s' if count > 1 else ''} only (θ_i = {shown}): "
            f"a fit needs {LEAST_INCIDENCES} or more, of which its intervals come"
        )
    if np.ptp(brdf.theta_o) < _SAME_ANGLE:
        raise InputError(
            f"{brdf.source}: all pairs are seen at θ_o = {np.degrees(brdf.theta_o[0]):.4g}°: light "
            "and detector exchanged, that is one incidence, and a fit needs several"
        )
    if max(brdf.theta_i.max(), brdf.theta_o.max()) <= np.radians(np.pi / 2):
        raise InputError(
            f"{brdf.source}: all pairs are within {np.pi / 2:.4f}° of the normal: angles must be "
            "in degrees, and these look like radians"
        )
    known = ~np.isnan(brdf.values)
    cosine = np.cos(brdf.theta_o)
    flux = np.where(known, brdf.values, 0.0) * cosine[:, None]
    return Problem(
        brdf.light,
        brdf.detector,
        collected(brdf.light, brdf.detector, cone),
        cosine,
        np.log1p(flux),
        known,
        number * min(count, MOST_GROUPS) // count,
    )


def thinned(brdf: MeasuredBrdf, most: int = MOST_PAIRS) -> MeasuredBrdf:
    """Keep at most so many pairs, drawn with a fixed seed, and say so."""
    if brdf.pairs <= most:
        return brdf
    rows = np.sort(np.random.default_rng(17).choice(brdf.pairs, most, replace=False))
    return brdf.select(rows).remarked(f"{most} of {brdf.pairs} pairs, drawn at random, are fitted")
