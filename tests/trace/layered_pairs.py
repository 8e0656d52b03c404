"""Pairs of surfaces, and light between them, for the tests of both engines."""

import functools
import operator

import numpy as np

from microsurf.results import detector
from microsurf.surface import Mesh, generate_surface, mesh
from microsurf.surface.layers import LayeredMesh
from microsurf.trace import engine
from microsurf.trace.wavefront import FacetOptics

CELLS = 64
STRAIGHT = np.zeros((CELLS, CELLS), bool)


def optics(n, substrate=True, survival=1.0):
    return FacetOptics(n, n > 1, substrate, multiple_scattering=True, survival=survival)


@functools.cache
def relief(seed, gamma=8.0, sigma=0.5):
    if sigma == 0:
        return np.zeros((CELLS, CELLS))
    return mesh(generate_surface(gamma, sigma, cells=CELLS, correlation=4.0, seed=seed)).heights


def pair(above, below, gap):
    return LayeredMesh(Mesh(above, STRAIGHT), Mesh(below - gap, STRAIGHT), gap)


PAIRS = {
    "flat over flat": pair(relief(1, sigma=0), relief(1, sigma=0), 0.7),
    "rough over flat": pair(relief(1), relief(1, sigma=0), 6.0),
    "flat over rough": pair(relief(1, sigma=0), relief(2, 3.0), 12.0),
    "same": pair(relief(1), relief(1), 0.3),
    "scaled": pair(relief(1), relief(1) / 2, 4.0),
    "independent": pair(relief(1), relief(2), 9.0),
}


def follow(tile, theta, facets, count=100_000, seed=1, phi=20.0):
    parts = [
        engine.trace(
            tile, theta, phi, facets, count // 4, np.random.default_rng((seed, k)), part=k, parts=4
        )
        for k in range(4)
    ]
    return functools.reduce(operator.add, parts)


def albedo(tally, kd):
    """Total albedo and its standard error; each substrate event weighs Kd."""
    events = np.maximum(detector.BODY_EVENTS[: tally.energy.shape[1]] - 1, 0)
    batches = tally.batches.sum(1) @ kd**events
    mean = batches.sum() / tally.light
    rest = batches - mean * tally.batch_light
    return mean, np.sqrt((rest**2).sum() * len(rest) / (len(rest) - 1)) / tally.light
