"""Every stream of random numbers by its name: first word of a spawn key, so that none meet.

Streams of one seed differ in their key: the name's number, then the place within the work
(numpy's SeedSequence). The numbers are part of the results: the same seed gives the same bits.
"""

from typing import Final

import numpy as np

SURFACES: Final = 0
"""Realisations of a surface: (realisation)."""
REFINEMENT: Final = 5000
"""Among SURFACES, the realisation whose seed is that of an error budget's finer mesh and tile."""
RAYS: Final = 1
"""Paths traced: (realisation, angle, number)."""
WALKS: Final = 2
"""Random walks: (angle, number)."""
VISIBILITY: Final = 2
"""Rays of masking by slope: (realisation, angle, azimuth), one number more than WALKS has."""
CONVERGENCE: Final = 3
"""Meshes and tiles of a convergence study: (step)."""
METHODS: Final = 4
"""Methods of a trade-off: (method, …)."""
REFERENCES: Final = 5
"""Reference surfaces of a trade-off: (batch)."""
MESH_WALKS: Final = 6
"""Walks with the slopes of a mesh: (angle, batch)."""
SUBSTRATES: Final = 7
"""White noise of a substrate under an interface, of whose seed it is: ()."""
SECOND_ENGINE: Final = 8
"""Runs of two engines on one surface: (engine, angle, run)."""
MEAN_CHORD: Final = 9
"""Lambertian light between two layers: ()."""


def generator(seed: int, *key: int) -> np.random.Generator:
    """Random numbers of one stream: ``generator(seed, RAYS, realisation, angle, number)``."""
    return np.random.Generator(np.random.SFC64(np.random.SeedSequence(seed, spawn_key=key)))


def derived(seed: int, *key: int) -> int:
    """A seed in [0, 2³²) for work that makes streams of its own."""
    return int(np.random.SeedSequence(seed, spawn_key=key).generate_state(1)[0])
