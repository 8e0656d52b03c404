"""Do intervals of a BRDF fit cover the truth, and what does order 1 alone do to data of all orders.

BRDFs of all orders (order 1 exact, the rest by Smith's walk) with noise of 2 % are drawn and
fitted; two minutes of processor time for 40 draws of 300 pairs, ten for 1500. What is finished
is kept in reports/latest: the same command goes on after a stop.

    python -m validation.calibration.brdf_fit [--pairs 300 1500] [--draws 40] [--out FILE.csv]
"""

import argparse
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from microsurf.analysis.brdf_fit.fit import Fitted
from microsurf.analysis.brdf_fit.intervals import resample
from microsurf.analysis.brdf_fit.later_orders import fit_all_orders
from microsurf.analysis.brdf_fit.materials import MATERIALS
from microsurf.analysis.brdf_fit.parameters import Layout
from microsurf.analysis.brdf_fit.problem import problem_of
from microsurf.analysis.brdf_fit.solve import Question, solve
from microsurf.analysis.brdf_fit.summary import parameters
from microsurf.cli.save import rounded, save
from microsurf.model.random_walk.common import EVENTS, by_body
from microsurf.model.single_scattering.brdf import body, specular
from microsurf.model.single_scattering.facets import Facets
from microsurf.physics.facet import body_weight
from microsurf.results.measured_brdf.scattered import MeasuredBrdf, unit
from microsurf.scene import Material, Roughness, Scene

from ..checkpoint import LATEST, once
from ..coverage.surfaces import exact_interval

GAMMA, SIGMA, N, KD = 2.5, 0.3, 1.5, (0.1, 0.4, 0.8)
NOISE = 0.02
INCIDENCES = 20
MOST_THETA = np.radians(75.0)
NEAR = np.radians(12.0)
WALKS = 4000  # of the data
OUT = Path(__file__).parents[2] / "reports" / "calibration" / "brdf_fit.csv"


def draw(pairs: int, rng: np.random.Generator) -> MeasuredBrdf:
    """Return a BRDF seen to 75°, a third of the pairs near the mirror direction."""
    theta_i = np.repeat(np.linspace(0, MOST_THETA, INCIDENCES), pairs // INCIDENCES)
    count = len(theta_i)
    theta_o = np.arccos(1 - rng.random(count) * (1 - np.cos(MOST_THETA)))
    phi_o = 2 * np.pi * rng.random(count)
    near, off = rng.random(count) < 1 / 3, NEAR * rng.standard_normal((2, count))
    theta_o = np.where(near, np.clip(np.abs(theta_i + off[0]), 0, MOST_THETA), theta_o)
    phi_o = np.where(near, np.pi + off[1], phi_o)
    i, o = unit(theta_i, np.zeros(count)), unit(theta_o, phi_o)
    facets, weights = Facets(N, GAMMA, SIGMA, SIGMA), body_weight(N, KD)
    scene = Scene(material=Material(N, (1.0,)), roughness=Roughness(GAMMA, (SIGMA,)))
    later = by_body(scene, i, o, WALKS, int(rng.integers(2**40)))
    values = specular(facets, i, o)[:, None] + body(facets, i, o)[:, None] * weights
    values = values + later @ weights ** np.arange(EVENTS + 1)[:, None]
    values = values * (1 + NOISE * rng.standard_normal(values.shape))
    channels = tuple(f"Kd {kd:g}" for kd in KD)
    return MeasuredBrdf(theta_i, np.zeros(count), theta_o, phi_o, values, channels, source="drawn")


def fits(pairs: int, seed: int) -> dict[str, dict[str, Any]]:
    """Fit one draw with order 1 and with all orders: parameters with their intervals."""
    brdf = draw(pairs, np.random.default_rng([seed, pairs]))
    material = MATERIALS["interfaced-lambertian"]
    question = Question(problem_of(brdf), material, Layout(material.optics, None, isotropic=True))
    one = solve(question)
    every, best, _ = fit_all_orders(question, one, seed=seed)
    return {
        "1": parameters(Fitted(question, one, resample(question, one))),
        "all": parameters(Fitted(every, best, resample(every, best))),
    }


def rows(pairs: int, drawn: list[dict[str, dict[str, Any]]]) -> Iterator[dict[str, Any]]:
    """Coverage, bias and scatter of each parameter."""
    truths = {"gamma": GAMMA, "sigma": SIGMA, "n": N}
    for orders in ("1", "all"):
        for name, truth in [*truths.items(), *((f"kd {kd:g}", kd) for kd in KD)]:
            at = None if name in truths else KD.index(truth)
            key = name if at is None else "kd"
            of = [draw[orders] for draw in drawn]
            found = np.array([one[key] if at is None else one[key][at] for one in of])
            ends = np.array([one[f"{key}_ci"] if at is None else one["kd_ci"][at] for one in of])
            held = int(np.sum((ends[:, 0] <= truth) & (truth <= ends[:, 1])))
            low, high = exact_interval(held, len(found))
            yield {
                "pairs": pairs,
                "orders fitted": orders,
                "parameter": name,
                "truth": truth,
                "draws": len(found),
                "held": held,
                "held_low": low,
                "held_high": high,
                "bias": float(np.median(found) / truth - 1),
                "scatter": float(found.std(ddof=1) / truth),
            }


def main() -> None:
    """Write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pairs", nargs="+", type=int, default=[300, 1500])
    parser.add_argument("--draws", type=int, default=40)
    parser.add_argument("--out", type=Path, default=OUT)
    options = parser.parse_args()
    table: list[dict[str, Any]] = []
    for pairs in options.pairs:
        kept = LATEST / "calibration" / f"brdf_fit-{pairs}"
        drawn = [once(kept / f"{k}.json", partial(fits, pairs, k)) for k in range(options.draws)]
        table.extend(rows(pairs, drawn))
    options.out.parent.mkdir(parents=True, exist_ok=True)
    save(options.out.parent, {options.out.name: rounded(table, 3)})


if __name__ == "__main__":
    main()
