"""The errors a user sees, and the checks that raise them.

An error is one line that names the value, what is allowed and what to do. An array from outside
that is no plain real array is refused, not converted: ``np.asarray`` drops a mask, a unit and an
imaginary part without a word, so `real_array` is asked in its place.
"""

import reprlib
from typing import Any

import numpy as np
from numpy.typing import NDArray


class MicrosurfError(Exception):
    """Something could not be finished; what was finished is kept. Exit code 3."""

    exit_code = 3


class InputError(MicrosurfError, ValueError):
    """What was asked for makes no sense. Exit code 2."""

    exit_code = 2


def require(condition: bool, name: str, value: Any, allowed: str) -> None:
    """Raise InputError with one line that says what was given and what may be."""
    if not condition:
        plain = value.tolist() if hasattr(value, "tolist") else value  # without numpy's names
        # reprlib cuts what is too long for one line.
        raise InputError(f"{name} = {reprlib.repr(plain)}: must be {allowed}")


def real_array(name: str, values: Any) -> NDArray[Any]:
    """Return ``values`` as a plain array of real numbers, in the type they have.

    Takes whatever numpy does: lists, arrays of any layout, pandas, xarray, dask. Nothing
    is copied that need not be.

    Raises
    ------
    InputError
        If values are masked, carry a unit, or are not real numbers (complex, boolean,
        text, dates, objects such as ``pandas.NA``, rows of unequal length).

    """
    unit = next((word for word in ("unit", "units") if hasattr(type(values), word)), None)
    if unit is not None:
        raise InputError(
            f"{name}: in {getattr(values, unit)}; must be plain numbers: convert them to one unit "
            "of length for all, and take their magnitude"
        )
    try:
        # dask's own way to an array drops a mask.
        values = values.compute() if hasattr(values, "compute") else values
        masked = _masked(values)  # first: numpy makes numbers of what is masked in a list
        array = np.asanyarray(None if masked else values)
    except Exception as error:  # other libraries raise whatever they like here
        raise InputError(
            f"{name}: a {type(values).__name__} is no array of numbers ({str(error)[:200]}); "
            "give a numpy array"
        ) from error
    if masked:
        raise InputError(f"{name}: {masked} values are masked; must all be there. Fill them first")
    require_real(name, array.dtype)
    return np.asarray(array)


def float_array(name: str, values: Any) -> NDArray[np.float64]:
    """Return ``values`` in double precision, refused as by `real_array`; cheap if they are."""
    if type(values) is np.ndarray and values.dtype == np.float64:
        return values
    return real_array(name, values).astype(np.float64, copy=False)


def _masked(values: Any) -> int:
    """Count what is masked in an array, or in lists of arrays, which numpy joins without masks."""
    if isinstance(values, list | tuple):
        return sum(_masked(item) for item in values if not isinstance(item, float | int))
    return int(np.sum(values.mask)) if isinstance(values, np.ma.MaskedArray) else 0


def require_real(name: str, dtype: np.dtype[Any]) -> None:
    """Refuse a type that does not hold real numbers."""
    if dtype.kind not in "fiu":
        raise InputError(f"{name} of type {dtype}: must be real numbers")
