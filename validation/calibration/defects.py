"""Comparisons of the suite as functions of a seed, right or with a planted defect.

Each takes a seed and what is planted and returns a p-value, 0 or 1 where nothing is
random. `tests/validation/calibration` and `calibration.py` ask the same functions at the same size.
"""

from functools import cache
from importlib import import_module
from types import FunctionType
from typing import Any
from unittest.mock import patch

import mpmath as mp
import numpy as np
from numba import njit

from microsurf import model
from microsurf.model.random_walk import evaluate
from microsurf.model.random_walk.parameters import (
    SlopeParameters,
    WalkFacet,
    slope_parameters,
    walk_facet,
)
from microsurf.physics import facet, fresnel, smith
from microsurf.scene import Light, Material, Roughness, Scene
from microsurf.stats import hypothesis_tests
from microsurf.surface import Heightfield, generate_surface, surface_statistics
from microsurf.trace import wavefront
from microsurf.trace.embree import EmbreeTile
from microsurf.trace.kernels import empty_space, facet_scattering, intersection
from microsurf.trace.wavefront import Tally

from ..gridwalk.check import IL, ordinary
from ..gridwalk.walk import GridWalk

walks = import_module("microsurf.model.random_walk.simulate")

N, KD = 1.5, 0.8
ROUNDING = 1e-12  # formulas hold to fewer than 64 ε in their own tests
DIRECTIONS = 400_000
WALKS = 100_000
PAIRS = (((30, 0), (40, 130)), ((80, 10), (70, 170)), ((60, 0), (60, 60)), ((85, 0), (60, 170)))
SMITH = Scene(material=Material(N, (KD,)), roughness=Roughness(3.0, (0.5,)))


def exact_transmittance(mu: float, n: float) -> Any:
    """1 − F of a dielectric by Snell's cosine and the amplitudes, 30 digits."""
    mu, n = mp.mpf(mu), mp.mpf(n)
    inside = mp.sqrt(1 - (1 - mu**2) / n**2)
    r_s, r_p = (mu - n * inside) / (mu + n * inside), (n * mu - inside) / (n * mu + inside)
    return 1 - (r_s**2 + r_p**2) / 2


def exact_lambda(theta: float, gamma: float, sigma: float) -> Any:
    """Λ(θ) of STD as Smith's integral over the slopes, 30 digits."""
    nu, x = 2 * mp.mpf(gamma) - 2, mp.cot(mp.mpf(theta)) / (mp.mpf(sigma) / mp.sqrt(2))
    norm = mp.gamma((nu + 1) / 2) / mp.sqrt(nu * mp.pi) / mp.gamma(nu / 2)
    whole = mp.quad(
        lambda u: (u - x) * (1 + u**2 / nu) ** (-(nu + 1) / 2), [x, x + 1, x + 10, mp.inf]
    )
    return norm * whole / x


def formula_against_mpmath(seed: int, formula: str, factor: float = 1.0) -> float:
    """F, T, r_i or Λ at three random arguments, ``factor`` times itself, against mpmath."""
    rng = np.random.default_rng(seed)
    off = 0.0
    with mp.workdps(30):
        for _ in range(3):
            n, mu = rng.uniform(1.1, 3), rng.uniform(0.1, 1)
            theta, gamma = rng.uniform(0.7, 1.4), rng.uniform(1.7, 10)
            if formula == "F":
                value, exact = fresnel.reflectance(mu, n), 1 - exact_transmittance(mu, n)
            elif formula == "T":
                value, exact = fresnel.transmittance(mu, n), exact_transmittance(mu, n)
            elif formula == "r_i":
                value = 1 - fresnel.external_diffuse_transmittance(n) / n**2
                edges = [0, 1 / mp.sqrt(mp.mpf(n) ** 2 + 1), 1]
                escape = mp.quad(lambda c, n=n: 2 * c * exact_transmittance(c, n), edges)
                exact = 1 - escape / mp.mpf(n) ** 2
            else:
                i = np.array([np.sin(theta), 0, np.cos(theta)])
                value, exact = smith.smith_lambda(i, gamma, 0.5), exact_lambda(theta, gamma, 0.5)
            off = max(off, abs(float(value) * factor / float(exact) - 1))
    return float(off < ROUNDING)


def facet_by_evaluation(seed: int, defect: str = "", kd: float = KD) -> float:
    """Body light of one facet, evaluated over o of density cosθ/π, against its albedo T w."""
    rng = np.random.default_rng(seed)
    cosines = np.sqrt(rng.random(DIRECTIONS))
    cos_i = rng.uniform(0.3, 1)
    values = np.pi * facet.body(cos_i, cosines, N, kd)
    through = fresnel.transmittance(np.append(cosines, cos_i), N)
    if defect == "F":
        ratio = (1 - 1.01 * (1 - through)) / through
        values = values * ratio[:-1] * ratio[-1]
    elif defect == "T":
        values = values * 1.01**2
    elif defect == "r_i":
        inside = 1 - float(fresnel.external_diffuse_transmittance(N)) / N**2
        values = values * (1 - kd * inside) / (1 - kd * 1.01 * inside)
    elif defect == "1/n²":
        values = values * N**2
    exact = float(fresnel.transmittance(cos_i, N) * facet.body_weight(N, kd))
    error = values.std(ddof=1) / np.sqrt(DIRECTIONS)
    return float(hypothesis_tests.z_test(values.mean(), exact, error))


def direction(theta: float, phi: float) -> np.ndarray:
    """Unit vector of angles in degrees."""
    t, p = np.radians(theta), np.radians(phi)
    return np.array([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])


def _wrong_facet(right: WalkFacet, defect: str) -> WalkFacet:
    if defect == "F":  # at normal incidence; with it T
        root = np.sqrt(1.01) * (N - 1) / (N + 1)
        return right._replace(n=(1 + root) / (1 - root))
    if defect == "T":  # of body light alone, both ways
        return right._replace(escape=right.escape / 1.01**2)
    inside = 1 - right.escape / N**2
    escape = (1 - 1.01 * inside) * N**2
    weight = KD * escape / N**2 / (1 - KD * 1.01 * inside)
    return right._replace(escape=escape, survival=weight)


def _wrong_lambda(gamma: float, sigma_x: float, sigma_y: float) -> SlopeParameters:
    parameters = slope_parameters(gamma, sigma_x, sigma_y)
    return parameters._replace(table=parameters.table * 1.01)


@cache
def _quadrature() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    i, o = (np.array([direction(*pair[k]) for pair in PAIRS]) for k in (0, 1))
    return i, o, np.array(model.evaluate(SMITH, i, o, "smith"))


def walk_against_quadrature(seed: int, defect: str = "") -> float:
    """Order 1 of the Smith walk for four pairs, specular and body, against the integral."""
    i, o, exact = _quadrature()
    parameters = _wrong_lambda if defect == "Λ" else slope_parameters

    def of_facet(scene: Scene, kd: float) -> WalkFacet:
        right = walk_facet(scene, kd)
        return _wrong_facet(right, defect) if defect in {"F", "T", "r_i"} else right

    with patch.multiple(walks, slope_parameters=parameters, walk_facet=of_facet):
        rng = np.random.default_rng(seed)
        f, se = evaluate.evaluate_walk(SMITH, i, o, "smith-walk", WALKS, rng, (1, 1))
    # The table of Λ is good to 1e−10: 1e−9 covers what it leaves.
    errors = np.hypot([se.specular, se.body], 1e-9 * exact)
    return hypothesis_tests.sidak(hypothesis_tests.z_test([f.specular, f.body], exact, errors))


def white_furnace(seed: int, cap: int = walks.MOST_EVENTS) -> float:
    """All light of a white substrate comes back out of the walk, to rounding."""
    asked = Scene(
        material=Material(N, (1.0,)), roughness=Roughness(1.6, (1.0,)), light=Light((45.0,))
    )
    with patch.object(walks, "MOST_EVENTS", cap):
        walked = walks.walk(asked, walks=20_000, seed=seed, workers=1)
    return float(abs(walked.microsurf.albedo(n=N, kd=1.0).item() - 1) < ROUNDING)


def slope_quantiles(seed: int, factor: float = 1.0) -> float:
    """Quantiles of a GGX surface's slopes to 99.9 %, each within 1 %."""
    made = generate_surface(2.0, 0.5, cells=256, seed=seed)
    found = surface_statistics(Heightfield(made.heights * factor), 2.0, 0.5)
    return float(max(abs(error) for error in found["quantiles"].values()) < 0.01)


class EndlessPathError(Exception):
    """A path that does not end."""


class Offset:
    """Trace with the distance off a facet multiplied, on Embree, and without on float64.

    The compiled loop holds the distance as a constant, so it is compiled once more.
    """

    CALLS, LIGHT = 30, 16
    MOST_BATCHES = 10_000
    """Of a call: a path of the right tracer ends within a hundred or two."""

    def __init__(self, factor: float) -> None:
        grid = ordinary(8.0, 0.7, 64)
        self._embree, self._exact = EmbreeTile(grid), GridWalk(grid)
        options: dict[str, Any] = {"nogil": True, "error_model": "numpy", "_nrt": False}
        inlined = njit(inline="always", **options)
        reconstruct_hit = inlined(
            _with(intersection.reconstruct_hit, OFFSET=factor * empty_space.OFFSET)
        )
        classify_ray = inlined(_with(intersection.classify_ray, reconstruct_hit=reconstruct_hit))
        self._take = njit(**options)(
            _with(facet_scattering.scatter_batch, classify_ray=classify_ray)
        )
        self._batches = 0

    def _counted(self, *arguments: Any) -> Any:
        """Without any distance a path may meet its own facet for ever."""
        self._batches += 1
        if self._batches > self.MOST_BATCHES:
            raise EndlessPathError
        return self._take(*arguments)

    def _run(self, tile: wavefront.Tile, seed: int, call: int) -> Tally:
        self._batches = 0
        rng = np.random.Generator(np.random.SFC64([seed, call]))
        return wavefront.trace(tile, 60.0, 17.0, IL, self.LIGHT * IL.branches, rng)

    def lost(self, seed: int) -> float:
        """No path is lost or goes on for ever, and no ray is sent again."""
        with patch.object(wavefront, "scatter_batch", self._counted):
            try:
                tallies = [self._run(self._embree, seed, call) for call in range(self.CALLS)]
            except EndlessPathError:
                return 0.0
        return float(sum(tally.lost[2:].sum() + tally.leaks for tally in tallies) == 0)

    def paths(self, seed: int) -> float:
        """The same light in the same bins as with float64, all but one call of 30."""
        differ = 0
        for call in range(self.CALLS):
            with patch.object(wavefront, "scatter_batch", self._counted):
                seen = self._run(self._embree, seed, call)
            exact = self._run(self._exact, seed, call)
            events_ = min(seen.energy.shape[1], exact.energy.shape[1])
            gap = seen.energy[:, :events_] - exact.energy[:, :events_]
            differ += np.abs(gap).max() > ROUNDING
        return float(differ <= 1)


def _with(compiled: Any, **constants: Any) -> FunctionType:
    """Return the Python behind a compiled function with other constants."""
    function = compiled.py_func
    return FunctionType(
        function.__code__, {**function.__globals__, **constants}, function.__name__,
        function.__defaults__, function.__closure__,
    )  # fmt: skip
