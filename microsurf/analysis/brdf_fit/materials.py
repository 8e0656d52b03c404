"""The materials a BRDF is fitted with, by name: order 1 of each in closed form.

Each is m = S_λ + w_λ B: mirrored light S, and body light B of a weight w in [0, 1] for each
channel, which `solve` finds inside. Another material is one entry.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...model.single_scattering.body_closed_form import APPROXIMATE
from ...model.single_scattering.brdf import body, white_mirror
from ...model.single_scattering.facets import Facets
from ...physics import fresnel
from .parameters import CONDUCTOR_INDEX, INDEX, Layout, Shape
from .problem import Problem

Array = NDArray[np.float64]


class Lobes(NamedTuple):
    """Order 1 at unit weights, in sr⁻¹.

    white : mirror lobe with F = 1; half : cosine at the mirroring facet; both of shape
    (pairs, points of the detector's cone); share : weight of each point in what the
    detector sees; body : of shape (pairs,), None without a substrate.
    """

    white: Array
    half: Array
    share: Array
    body: Array | None

    def mirrored(self, n: float, k: float) -> Array:
        """S for one index, shape (pairs,)."""
        reflected = fresnel.reflectance(self.half, n, k)
        return np.asarray(np.sum(reflected * self.white * self.share, axis=1))


@dataclass(frozen=True)
class Material:
    """A material: its name for people, its optics with bounds, and its body light."""

    label: str
    optics: tuple[tuple[str, float, float], ...]
    start: tuple[tuple[float, ...], ...]
    body: Callable[[Problem, Facets], Array] | None


def _interfaced(problem: Problem, facets: Facets) -> Array:
    return body(facets, problem.i, problem.o)


def _lambertian(problem: Problem, _: Facets) -> Array:
    return np.full(len(problem.i), 1 / np.pi)


_METAL = (("n", *CONDUCTOR_INDEX), ("k", *CONDUCTOR_INDEX))
MATERIALS = {
    "interfaced-lambertian": Material(
        "interfaced Lambertian", (("n", *INDEX),), ((1.5,), (1.33,), (1.8,)), _interfaced
    ),
    "conductor": Material("conductor", (), ((),), None),
    "lambertian+conductor": Material(
        "Lambertian plus conductor", _METAL, ((1.0, 1.0), (0.3, 3.0)), _lambertian
    ),
}
"""By name; the index of a bare conductor is found for each channel, inside."""


def lobes(problem: Problem, material: Material, layout: Layout, vector: Array) -> Lobes:
    """Order 1 of a material at a vector of parameters."""
    shape, of = layout.shape(vector), layout.values(vector)
    n = of.get("n", 1.5) if "k" not in of else 1.5
    facets = Facets(n, shape.gamma, shape.sigma_x, shape.sigma_y, APPROXIMATE)
    view = turned(problem, shape)
    i, o = view.i[:, None], view.o[:, None] if view.cone is None else view.cone
    up = o[..., 2] > 0
    o = np.where(up[..., None], o, [0.0, 0.0, 1.0])
    share = np.where(up, o[..., 2], 0.0) / (o.shape[1] * problem.cosine[:, None])
    half = np.minimum(np.linalg.norm(i + o, axis=-1) / 2, 1.0)
    modelled = None if material.body is None else material.body(view, facets)
    return Lobes(white_mirror(facets, i, o), half, share, modelled)


def turned(problem: Problem, shape: Shape) -> Problem:
    """The pairs seen from the axes of σ_x and σ_y."""
    if shape.sigma_x == shape.sigma_y:
        return problem
    c, s = np.cos(shape.azimuth), np.sin(shape.azimuth)
    turn = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]).T
    return Problem(
        problem.i @ turn,
        problem.o @ turn,
        None if problem.cone is None else problem.cone @ turn,
        problem.cosine,
        problem.logs,
        problem.known,
        problem.groups,
    )
