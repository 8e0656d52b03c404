"""Each difference between geometry and theory as an effect size with its confidence interval.

A comparison *holds* if the whole interval of the relative difference lies within
the scene's margin, *departs* if all of it lies outside, and is *undecided* else.
"""

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any, overload

import numpy as np
import xarray as xr

from ..results import albedos
from ..scene import Scene
from ..scene.expectation import Expectation
from ..scene.notebook import table
from ..stats import intervals

_DEFAULT = Expectation()


@dataclass(frozen=True)
class Comparison:
    """One quantity at one incidence: what was measured, what was predicted, what follows.

    ``effect`` is measured/predicted − 1, ``low`` and ``high`` its confidence interval
    over the realisations (over the rays where there is one surface only, ``basis``),
    with the error of a ``model`` that is sampled. ``surfaces`` is their number.
    """

    quantity: str
    theta_i: float
    phi_i: float
    kd: float
    measured: float
    standard_error: float
    model: str
    predicted: float
    predicted_error: float
    effect: float
    low: float
    high: float
    basis: str
    margin: float
    verdict: str
    expected: str
    why: str
    surfaces: int

    @property
    def unexpected(self) -> bool:
        """Whether the verdict is none of those the scene expects."""
        return self.verdict not in self.expected.split("|")


_COLUMNS = (
    "quantity", "θ_i", "φ_i", "Kd", "measured", "predicted", "model", "effect", "95 %", "margin",
    "verdict",
)  # fmt: skip


class ComparisonTable(Sequence[Comparison]):
    """Comparisons in a row each: a sequence that prints as a table, in notebooks too."""

    def __init__(self, comparisons: Iterable[Comparison]) -> None:
        self._comparisons = tuple(comparisons)

    def __len__(self) -> int:
        """How many there are."""
        return len(self._comparisons)

    def __eq__(self, other: object) -> bool:
        """Whether the other is a table of the same comparisons."""
        return isinstance(other, ComparisonTable) and self._comparisons == other._comparisons

    def __hash__(self) -> int:
        """As of any sequence that does not change."""
        return hash(self._comparisons)

    @overload
    def __getitem__(self, index: int) -> Comparison: ...
    @overload
    def __getitem__(self, index: slice) -> "ComparisonTable": ...
    def __getitem__(self, index: int | slice) -> "Comparison | ComparisonTable":
        """One of them, or a table of some."""
        if isinstance(index, slice):
            return ComparisonTable(self._comparisons[index])
        return self._comparisons[index]

    @property
    def rows(self) -> list[dict[str, Any]]:
        """All fields of each, for a data frame or JSON."""
        return [{**asdict(row), "unexpected": row.unexpected} for row in self._comparisons]

    def _cells(self) -> list[tuple[str, ...]]:
        return [
            (
                row.quantity, f"{row.theta_i:g}°", f"{row.phi_i:g}°", f"{row.kd:g}",
                f"{row.measured:.5g} ± {row.standard_error:.2g}", f"{row.predicted:.5g}",
                row.model, f"{row.effect:+.2%}", f"{row.low:+.2%} … {row.high:+.2%}",
                f"±{row.margin:.2%}", row.verdict,
            )
            for row in self._comparisons
        ]  # fmt: skip

    def __repr__(self) -> str:
        """As columns of text."""
        lines = [_COLUMNS, *self._cells()]
        widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
        return "\n".join(
            "  ".join(cell.ljust(w) for cell, w in zip(line, widths, strict=True)).rstrip()
            for line in lines
        )

    def _repr_html_(self) -> str:
        return table(self._cells(), _COLUMNS)


def compare(
    measured: xr.Dataset,
    predicted: xr.Dataset,
    scene: Scene,
    all_orders: xr.Dataset | None = None,
) -> ComparisonTable:
    """Compare what the scene has of order-1 specular, order-1 body and total albedo.

    The total is compared with ``all_orders``, a prediction of multiple scattering; without one
    with ``predicted`` if that is of all orders or light meets no second facet, and else not at
    all: one bounce is no theory of all of them. Quantities that the theory says are zero (no
    interface, no substrate) are left out, and so are parts that a user BRDF of all orders does not
    tell apart. One comparison for each quantity, angle and Kd.
    """
    needs = scene.requires
    in_parts = predicted.attrs.get("orders") != "all"
    names = [
        name
        for name, wanted in (
            ("specular", needs.interface and in_parts),
            ("body", needs.substrate and in_parts),
            (
                "total",
                (needs.interface or needs.substrate)
                and (all_orders is not None or _of_all_orders(measured, predicted, scene)),
            ),
        )
        if wanted
    ]
    rows = []
    for name in names:
        expectation = scene.expect.get(name, _DEFAULT)
        theory = all_orders if name == "total" and all_orders is not None else predicted
        for kd in scene.material.kd:
            which = {**albedos.SELECTED[name], "n": scene.material.n, "kd": kd}
            of = [d.microsurf.albedo(**which) for d in (measured, theory)]
            noise, sampling = (d.microsurf.ray_error(**which) for d in (measured, theory))
            for t, theta in enumerate(scene.light.theta):
                for p, phi in enumerate(scene.light.phi):
                    index = {"theta_i": t, "phi_i": p}
                    prediction = float(of[1].isel(index).item())
                    if prediction == 0:
                        continue
                    rows.append(
                        _comparison(
                            name, (theta, phi, kd), expectation, t,
                            of[0].isel(index).values, noise.isel(index).values,
                            str(theory.attrs.get("model", "")), prediction,
                            float(sampling.isel(index).item()),
                        )
                    )  # fmt: skip
    return ComparisonTable(rows)


def _of_all_orders(measured: xr.Dataset, predicted: xr.Dataset, scene: Scene) -> bool:
    """Whether a prediction answers for all light that was measured."""
    one_bounce = not (scene.requires.roughness and scene.requires.multiple_scattering)
    several = predicted.sizes["order"] > 1 or predicted.attrs.get("orders") == "all"
    return one_bounce or several or measured.sizes["order"] == 1


def _comparison(
    name: str,
    incidence: tuple[float, float, float],
    expectation: Expectation,
    angle: int,
    values: np.ndarray,
    noise: np.ndarray,
    model: str,
    prediction: float,
    sampling: float,
) -> Comparison:
    """Decide on one quantity at one angle from its value on each realisation."""
    count = len(values)
    error = float(values.std(ddof=1) / np.sqrt(count) if count > 1 else noise[0])
    mean = float(values.mean())
    effect = mean / prediction - 1
    half = half_width(error, count, effect, prediction, sampling, intervals.CONFIDENCE)
    low, high = effect - half, effect + half
    expected = expectation.verdict[angle % len(expectation.verdict)]
    return Comparison(
        quantity=name,
        theta_i=incidence[0],
        phi_i=incidence[1],
        kd=incidence[2],
        measured=mean,
        standard_error=error,
        model=model,
        predicted=prediction,
        predicted_error=sampling,
        effect=effect,
        low=low,
        high=high,
        basis=f"{count} surfaces" if count > 1 else "rays on one surface",
        margin=expectation.margin,
        verdict=decide(low, high, expectation.margin),
        expected=expected,
        why=expectation.why,
        surfaces=count,
    )


def half_width(
    error: float,
    surfaces: int,
    effect: float,
    prediction: float,
    sampling: float,
    confidence: float,
) -> float:
    """Half of an effect's interval: Student's t over surfaces, normal of one surface's rays.

    The prediction's own error (``sampling``) is carried into the ratio, to first order.
    """
    normal = intervals.normal(confidence)
    factor = intervals.over_values(surfaces, confidence)
    return float(np.hypot(factor * error, normal * sampling * (1 + effect))) / prediction


def decide(low: float, high: float, margin: float) -> str:
    """Say holds, departs or undecided of an interval [low, high] and a margin ±margin."""
    if -margin <= low and high <= margin:
        return "holds"
    if low > margin or high < -margin:
        return "departs"
    return "undecided"
