"""What order 1 in closed form leaves out: later orders, and its own error.

For given parameters the correction is what Smith's random walk says of orders 2 and more,
by next-event estimation, plus the exact body integral less its closed form. It is a power
series in the body weight w, whose terms one set of walks gives for all channels. A fit of
all orders alternates: correct, fit order 1 and the correction, correct again. Walks have
common random numbers, so that this ends at a point and not in a cloud.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...model.random_walk.common import EVENTS, by_body
from ...model.single_scattering.body_closed_form import APPROXIMATE
from ...model.single_scattering.brdf import body
from ...model.single_scattering.facets import SMITH, Facets
from ...physics import fresnel
from ...scene import BECKMANN, Material, Roughness, Scene
from . import materials
from .nearby import follow
from .solve import Question, Solution

Array = NDArray[np.float64]

ROUNDS = 8
WALKS = 1000
_DONE = 1e-3
"""Change of the parameters in one round, of σ relative and of the others, that ends it."""


def possible(question: Question) -> bool:
    """Whether the material is one that light can walk in."""
    return question.material is not materials.MATERIALS["lambertian+conductor"]


def correction(question: Question, solution: Solution, walks: int, seed: int) -> Array:
    """BRDF beyond the closed form in sr⁻¹, shape (pairs, channels)."""
    layout, vector = question.layout, solution.vector
    shape = layout.shape(vector)
    view = materials.turned(question.problem, shape)
    rough = Roughness(min(shape.gamma, BECKMANN), (shape.sigma_x, shape.sigma_y))

    def walked(material: Material) -> Array:
        return by_body(Scene(material=material, roughness=rough), view.i, view.o, walks, seed)

    if question.material.body is None:
        return np.stack([walked(Material(n, (), k))[:, 0] for n, k in solution.channel], axis=1)
    n, weights = layout.values(vector)["n"], solution.channel
    facets = Facets(n, shape.gamma, shape.sigma_x, shape.sigma_y, SMITH)
    closed = replace(facets, masking=APPROXIMATE)
    exact = body(facets, view.i, view.o) - body(closed, view.i, view.o)
    powers = weights ** np.arange(EVENTS + 1)[:, None]
    return np.asarray(exact[:, None] * weights + walked(Material(n, (1.0,))) @ powers)


def kd_of(weight: float, n: float) -> float:
    """Kd of the body weight w = Kd e/((1 − Kd) + Kd e), e = (1 − r_e)/n²."""
    escape = float(fresnel.external_diffuse_transmittance(n)) / n**2
    return float(np.clip(weight / (escape + weight * (1 - escape)), 0, 1))


def fit_all_orders(
    question: Question, first: Solution, walks: int = WALKS, seed: int = 0
) -> tuple[Question, Solution, int]:
    """Fit with all orders from the solution of order 1.

    Returns
    -------
    Question
        With the correction in it, of the last round.
    Solution
        Its best parameters.
    int
        Rounds made; ROUNDS if the last still moved something.

    """
    solution, rounds, moved = first, 0, np.inf
    while moved >= _DONE and rounds < ROUNDS:
        rounds += 1
        question = replace(question, later=correction(question, solution, walks, seed))
        new = follow(question, solution)
        moved = float(np.max(np.abs(new.vector - solution.vector)))
        solution = new
    return question, solution, rounds
