"""A user BRDF against the measurement and against the theory: a bug, or where theory stops.

A user BRDF must *hold*, unless the theory does not hold there either and the user BRDF
comes as near to the measurement as the theory does, within the margin. Albedos can agree
by chance: so its lobes too must come as near the measured ones as those of the theory,
within the margin. The distance of two lobes is the sum over the bins of their absolute
difference over the measured albedo; noise of the measurement is in both distances alike.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from ..results import datasets
from ..scene import Scene
from ..stats import intervals
from .comparison import Comparison, decide

ALL_ORDERS = "total"
_SAME = 1e-3
"""Relative difference up to which a user BRDF is said to be the theory."""


@dataclass(frozen=True)
class BesideTheory:
    """One quantity at one incidence: user BRDF over theory.

    ``effect`` is user_brdf/theory − 1; ``low`` and ``high`` its 95 % interval from the
    error of a theory that is sampled and the bound on the user BRDF's own; ``finding``
    says what follows with both verdicts.
    """

    quantity: str
    theta_i: float
    phi_i: float
    kd: float
    user_brdf: float
    user_brdf_error: float
    model: str
    theory: float
    theory_error: float
    effect: float
    low: float
    high: float
    user_brdf_verdict: str
    theory_verdict: str
    finding: str


@dataclass(frozen=True)
class Lobe:
    """One lobe at one incidence: distances of the three, and where user BRDF and theory part most.

    ``theta_o`` and ``phi_o`` (from the incident azimuth) in degrees; ``user_brdf`` and
    ``theory`` the mean BRDF in that bin in sr⁻¹. ``allowed`` is what ``to_measured`` may be.
    """

    quantity: str
    theta_i: float
    phi_i: float
    kd: float
    to_theory: float
    to_measured: float
    theory_to_measured: float
    allowed: float
    theta_o: float
    phi_o: float
    user_brdf: float
    theory: float


class Lobes(NamedTuple):
    """What was measured, what the theory says, and the user BRDF, as Datasets."""

    measured: xr.Dataset
    theory: xr.Dataset
    user_brdf: xr.Dataset


@dataclass(frozen=True)
class UserBrdfResult:
    """What a user BRDF came to on one scene.

    ``orders`` is "1", "1 and all" or "all"; ``predicted`` holds its lobes by Kd.
    """

    name: str
    orders: str
    beside_theory: list[BesideTheory]
    lobes: list[Lobe]
    predicted: Mapping[float, xr.Dataset]

    def as_json(self) -> dict[str, Any]:
        """Its figures, without the lobes."""
        return {
            "name": self.name,
            "orders": self.orders,
            "beside_theory": [asdict(row) for row in self.beside_theory],
            "lobes": [asdict(row) for row in self.lobes],
        }


def widened(row: Comparison, relative_error: float) -> Comparison:
    """A comparison with a bound on the prediction's error added to its interval."""
    more = relative_error * (1 + row.effect)
    low, high = row.low - more, row.high + more
    return replace(
        row,
        predicted_error=row.predicted * relative_error,
        low=low,
        high=high,
        verdict=decide(low, high, row.margin),
    )


def expected_of(row: Comparison, theory: Comparison) -> Comparison:
    """A user BRDF's comparison with what is expected of it, see the module's text."""
    as_near = abs(row.effect) <= abs(theory.effect) + row.margin
    if theory.verdict == "holds" or not as_near:
        return replace(row, expected="holds", why="a user BRDF must hold where the theory does")
    return replace(
        row,
        expected="|".join(dict.fromkeys(["holds", "undecided", theory.verdict])),
        why=f"the theory ({theory.model}) is {theory.verdict} here itself",
    )


def beside_theory(row: Comparison, theory: Comparison) -> BesideTheory:
    """Put a user BRDF's comparison beside that of the theory."""
    effect = row.predicted / theory.predicted - 1
    half = (1 + effect) * (
        row.predicted_error / row.predicted
        + intervals.normal() * theory.predicted_error / theory.predicted
    )
    low, high = effect - half, effect + half
    return BesideTheory(
        quantity=row.quantity,
        theta_i=row.theta_i,
        phi_i=row.phi_i,
        kd=row.kd,
        user_brdf=row.predicted,
        user_brdf_error=row.predicted_error,
        model=theory.model,
        theory=theory.predicted,
        theory_error=theory.predicted_error,
        effect=effect,
        low=low,
        high=high,
        user_brdf_verdict=row.verdict,
        theory_verdict=theory.verdict,
        finding=_finding((low, high), row, theory),
    )


def _finding(interval: tuple[float, float], row: Comparison, theory: Comparison) -> str:
    if interval[0] <= _SAME and interval[1] >= -_SAME:
        finding = "as the theory"
        return finding if row.verdict == "holds" else f"{finding}, which {_verb(theory)} here"
    if row.verdict == "holds":
        return "not the theory, and holds" + ("" if theory.verdict == "holds" else "; it does not")
    if theory.verdict == "holds":
        return "the user BRDF's own: the theory holds here"
    return f"not the theory, which {_verb(theory)} here too"


def _verb(row: Comparison) -> str:
    return "is undecided" if row.verdict == "undecided" else row.verdict


def lobes(three: Lobes, scene: Scene, quantity: str, margin: float) -> list[Lobe]:
    """Distances of one lobe at each incidence of a scene of one Kd.

    ``quantity`` is "specular" or "body", of order 1, or "total": all that leaves.
    """
    (kd,) = scene.material.kd
    of = [_lobe(d, quantity, scene.material.n, kd) for d in three]
    rows = []
    for t, theta in enumerate(scene.light.theta):
        for p, phi in enumerate(scene.light.phi):
            bins = [a.isel(theta_i=t, phi_i=p) for a in of]
            measured, theory, user_brdf = (b.values for b in bins)
            size = measured.sum()
            if size == 0 or theory.sum() == 0:
                continue
            ring, sector = np.unravel_index(np.abs(user_brdf - theory).argmax(), user_brdf.shape)
            there = {"theta_o": int(ring), "phi_o": int(sector)}
            mean = [float(datasets.brdf(b).isel(there)) for b in bins]
            of_theory = float(np.abs(measured - theory).sum() / size)
            rows.append(
                Lobe(
                    quantity=quantity,
                    theta_i=theta,
                    phi_i=phi,
                    kd=kd,
                    to_theory=float(np.abs(user_brdf - theory).sum() / theory.sum()),
                    to_measured=float(np.abs(measured - user_brdf).sum() / size),
                    theory_to_measured=of_theory,
                    allowed=of_theory + margin,
                    theta_o=float(bins[0].theta_o[there["theta_o"]]),
                    phi_o=float(bins[0].phi_o[there["phi_o"]]),
                    user_brdf=mean[2],
                    theory=mean[1],
                )
            )
    return rows


def _lobe(dataset: xr.Dataset, quantity: str, n: float, kd: float) -> xr.DataArray:
    energy = datasets.by_kind(dataset.flux.mean("realisation"), n, kd)
    if quantity == ALL_ORDERS:
        return energy.sum(("order", "kind"))
    return energy.sel(order=1, kind=quantity, drop=True)
