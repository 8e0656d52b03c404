"""How the loops of this folder are compiled: the only file of it that knows numba.

Without the interpreter's lock, with numpy's division, and without counting references:
these functions make no arrays, they only read and write those that they are given in
tuples. Counting references to them, an atomic step up and down at each call, took half
of the time.
"""

from functools import partial

from numba import njit

_njit = partial(njit, cache=True, nogil=True, error_model="numpy", _nrt=False)

compiled = _njit()
"""A loop, or what is called from several places."""

inlined = _njit(inline="always")
"""Part of a loop, written apart to be read apart: passing its tuples took a quarter of the time."""
