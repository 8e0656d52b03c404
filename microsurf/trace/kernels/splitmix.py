"""Random numbers of compiled loops: splitmix64 (Steele, Lea & Flood 2014), inline.

A stream is an array of two numbers, its state and its own odd increment, both drawn from
a seeded generator: streams of different increments do not overlap.
"""

import numpy as np
from numpy.typing import NDArray

from ...jit import inlined

Stream = NDArray[np.uint64]

_A, _B = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_30, _27, _31, _11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)


def stream(rng: np.random.Generator) -> Stream:
    """Start a stream from a generator."""
    drawn = rng.integers(0, 2**64, 2, dtype=np.uint64)
    drawn[1] |= np.uint64(1)
    return drawn


@inlined
def uniform(state):
    """Next number of a stream, uniform in [0, 1)."""
    state[0] += state[1]
    value = state[0]
    value = (value ^ (value >> _30)) * _A
    value = (value ^ (value >> _27)) * _B
    value ^= value >> _31
    return (value >> _11) * 2.0**-53
