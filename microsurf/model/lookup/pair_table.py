"""Values on a grid of pairs of directions, linear between its points.

STD facets look the same in a mirror along x or along y, and so do their BRDFs. Isotropic
ones have a grid in θ_i, θ_o and the azimuth between both, from 0 to π. Others have φ_i from
0 to π/2 as well, and azimuths between both from 0 to 2π.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ..directions import direction

Array = NDArray[np.float64]

MOST_THETA = np.radians(89.9)
"""Last node of θ: beyond it the values there are taken."""


@dataclass(frozen=True)
class PairTable:
    """A grid and its values.

    Attributes
    ----------
    theta_i, phi_i, theta_o, turn : array
        Nodes in radians, ascending; one φ_i if isotropic. ``turn`` is φ_o − φ_i.
    values : array, shape (theta_i, phi_i, theta_o, turn, ...)
        At these nodes.

    """

    theta_i: Array
    phi_i: Array
    theta_o: Array
    turn: Array
    values: Array

    @property
    def isotropic(self) -> bool:
        """Whether only the azimuth between both directions matters."""
        return len(self.phi_i) == 1

    def at(self, i: Array, o: Array) -> Array:
        """Interpolate at pairs of unit directions, shape (pairs, 3) each: shape (pairs, ...)."""
        if not self.isotropic:
            sides = np.where(i[:, :2] < 0, -1.0, 1.0)
            i, o = (np.concatenate([w[:, :2] * sides, w[:, 2:]], axis=1) for w in (i, o))
        polar = [np.arctan2(np.hypot(w[:, 0], w[:, 1]), w[:, 2]) for w in (i, o)]
        azimuth = [np.arctan2(w[:, 1], w[:, 0]) for w in (i, o)]
        turn = np.mod(azimuth[1] - azimuth[0], 2 * np.pi)
        if self.isotropic:
            turn = np.minimum(turn, 2 * np.pi - turn)
        axes = (self.theta_i, self.phi_i, self.theta_o, self.turn)
        places = [
            _place(axis, x)
            for axis, x in zip(axes, (polar[0], azimuth[0], polar[1], turn), strict=True)
        ]
        total = np.zeros((len(i), *self.values.shape[4:]))
        for corner in product((0, 1), repeat=4):
            weight = np.ones(len(i))
            index = []
            for (low, part), high, axis in zip(places, corner, axes, strict=True):
                weight = weight * (part if high else 1 - part)
                index.append(np.minimum(low + high, len(axis) - 1))
            total += self.values[tuple(index)] * weight.reshape(-1, *[1] * (total.ndim - 1))
        return total


def tabulate(
    function: Callable[[Array, Array], Array],
    *,
    isotropic: bool,
    polar: int,
    turns: int,
    azimuths: int = 5,
) -> PairTable:
    """Make the table of a function of directions, shape (pairs, 3) each, that gives (pairs, ...).

    ``polar`` nodes in θ_i and in θ_o, closer and closer towards the horizon; ``turns`` nodes
    between 0 and π (twice as many intervals around where it is not isotropic), and
    ``azimuths`` nodes in φ_i where it is not.
    """
    theta = polar_nodes(polar)
    phi_i = np.zeros(1) if isotropic else np.linspace(0, np.pi / 2, azimuths)
    turn = np.linspace(0, np.pi, turns) if isotropic else np.linspace(0, 2 * np.pi, 2 * turns - 1)
    grid = np.meshgrid(theta, phi_i, theta, turn, indexing="ij")
    theta_i, azimuth_i, theta_o, between = (axis.ravel() for axis in grid)
    values = function(direction(theta_i, azimuth_i), direction(theta_o, azimuth_i + between))
    shape = (*grid[0].shape, *values.shape[1:])
    return PairTable(theta, phi_i, theta, turn, values.reshape(shape))


def polar_nodes(count: int) -> Array:
    """Angles from 0 to MOST_THETA in radians, their steps falling towards the horizon."""
    return np.asarray(MOST_THETA * (1 - (1 - np.linspace(0, 1, count)) ** 2))


def _place(axis: Array, x: Array) -> tuple[NDArray[np.intp], Array]:
    """Number of the node below each x, and the part of the step beyond it, in [0, 1]."""
    if len(axis) == 1:
        return np.zeros(len(x), np.intp), np.zeros(len(x))
    low = np.clip(np.searchsorted(axis, x, side="right") - 1, 0, len(axis) - 2)
    return low, np.clip((x - axis[low]) / (axis[low + 1] - axis[low]), 0, 1)
