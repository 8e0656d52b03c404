"""Loaded by a server of forked children: numba, and what it loads as it compiles first."""

import numba

numba.njit(lambda x: x + 1)(1.0)
