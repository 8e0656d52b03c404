"""The materials a BRDF is fitted with, by name: order 1 of each in closed form.

Each is m = S_λ + w_λ B: mirrored light S, and body light B of a weight w in [0, 1] for each
channel, which `solve` finds inside. Another material is one entry.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from ...model.single_scattering.body_closed_form import averages
from ...model.single_scattering.brdf import white_mirror
from ...model.single_scattering.facets import Facets
from ...physics import fresnel
from .masking_table import MASKING
from .parameters import CONDUCTOR_INDEX, INDEX, Layout, Shape
from .problem import Problem

Array = NDArray[np.float64]


class BodyOfSlopes(Protocol):
    """Body light of each pair as slopes alone decide it; the index comes later."""

    def body(self, n: float) -> Array:
        """f_b in sr⁻¹ at unit body weight, shape (pairs,)."""
        ...

    def select(self, rows: NDArray[np.bool_]) -> Self:
        """Return that of some of the pairs."""
        ...


class OfSlopes(NamedTuple):
    """Light of slopes, whatever the index.

    white : mirror lobe with F = 1 in sr⁻¹, times the share of each direction in what the
    detector sees, shape (pairs, points of its cone); body : None without a substrate.
    """

    white: Array
    body: BodyOfSlopes | None

    def select(self, rows: NDArray[np.bool_]) -> "OfSlopes":
        """Return that of some of the pairs."""
        return OfSlopes(self.white[rows], None if self.body is None else self.body.select(rows))


class Lobes(NamedTuple):
    """Order 1 at unit weights, in sr⁻¹.

    white : as in `OfSlopes`; half : cosine at the mirroring facet, of the same shape; body :
    of shape (pairs,), None without a substrate.
    """

    white: Array
    half: Array
    body: Array | None

    def mirrored(self, n: float, k: float) -> Array:
        """S for one index, shape (pairs,)."""
        reflected = fresnel.reflectance(self.half, n, k)
        return np.asarray(np.einsum("pk,pk->p", reflected, self.white))

    def derivatives(self, n: float, k: float) -> tuple[Array, Array]:
        """∂S/∂ln n and ∂S/∂ln k of a conductor, each of shape (pairs,)."""
        by_n, by_k = fresnel.conductor_derivatives(self.half, n, k)

        def summed(by: Array) -> Array:
            return np.asarray(np.einsum("pk,pk->p", by, self.white))

        return n * summed(by_n), k * summed(by_k)


class Lambertian(NamedTuple):
    """Body light that passes no interface."""

    values: Array

    def body(self, _: float) -> Array:
        """1/π, shape (pairs,)."""
        return self.values

    def select(self, rows: NDArray[np.bool_]) -> "Lambertian":
        """Return that of some of the pairs."""
        return Lambertian(self.values[rows])


@dataclass(frozen=True)
class Material:
    """A material: its name for people, its optics with bounds, and its body light.

    ``body`` takes (γ, σ_x, σ_y) and directions i and o, of shape (pairs, 3).
    """

    label: str
    optics: tuple[tuple[str, float, float], ...]
    start: tuple[tuple[float, ...], ...]
    body: Callable[[tuple[float, float, float], Array, Array], BodyOfSlopes] | None


def _lambertian(_: tuple[float, float, float], i: Array, o: Array) -> Lambertian:
    return Lambertian(np.full(max(len(i), len(o)), 1 / np.pi))


_METAL = (("n", *CONDUCTOR_INDEX), ("k", *CONDUCTOR_INDEX))
MATERIALS = {
    "interfaced-lambertian": Material(
        "interfaced Lambertian", (("n", *INDEX),), ((1.5,), (1.33,), (1.8,)), averages
    ),
    "conductor": Material("conductor", (), ((),), None),
    "lambertian+conductor": Material(
        "Lambertian plus conductor", _METAL, ((1.0, 1.0), (0.3, 3.0)), _lambertian
    ),
}
"""By name; the index of a bare conductor is found for each channel, inside."""


def lobes(problem: Problem, material: Material, layout: Layout, vector: Array) -> Lobes:
    """Order 1 of a material at a vector of parameters."""
    shape = layout.shape(vector)
    slopes: OfSlopes = problem.recent.get(
        (material.label, shape), lambda: _of_slopes(problem, material, shape)
    )
    body = None if slopes.body is None else slopes.body.body(layout.values(vector)["n"])
    return Lobes(slopes.white, problem.collected.half, body)


def _of_slopes(problem: Problem, material: Material, shape: Shape) -> OfSlopes:
    view = turned(problem, shape)
    std = shape.gamma, shape.sigma_x, shape.sigma_y
    facets = Facets(1.0, *std, MASKING)
    white = white_mirror(facets, view.i[:, None], view.collected.o, view.collected.normal)
    body = None if material.body is None else material.body(std, view.i, view.o)
    return OfSlopes(white * problem.collected.share, body)


def turned(problem: Problem, shape: Shape) -> Problem:
    """The pairs seen from the axes of σ_x and σ_y."""
    if shape.sigma_x == shape.sigma_y:
        return problem
    c, s = np.cos(shape.azimuth), np.sin(shape.azimuth)
    turn = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]).T
    view = problem.collected.turned(turn)
    return replace(problem, i=problem.i @ turn, o=problem.o @ turn, collected=view)
