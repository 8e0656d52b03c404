"""How the loops of this folder are compiled: the only file of it that knows numba."""

from numba import njit

compiled = njit(cache=True, nogil=True, error_model="numpy", _nrt=False)  # type: ignore[call-overload]
"""Without the interpreter's lock, with numpy's division, and without counting references.

These functions make no arrays, they only read and write those that they are given in
tuples. Counting references to them, an atomic step up and down at each of a ray's
calls, took half of the time.
"""
