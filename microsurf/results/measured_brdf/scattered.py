"""A BRDF as an instrument saw it: pairs of directions, never interpolated."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError

Array = NDArray[np.float64]

MOST_VALUES = 50_000_000
"""Pairs times channels that are read at most: 400 MB as doubles."""


@dataclass(frozen=True)
class MeasuredBrdf:
    """Scattered pairs of directions and the BRDF in each channel.

    Attributes
    ----------
    theta_i, phi_i, theta_o, phi_o : array, shape (pairs,)
        Directions towards the light and the detector in radians, θ in [0, π/2): the
        mirror direction of (θ_i, φ_i) is (θ_i, φ_i + π).
    values : array, shape (pairs, channels)
        BRDF in sr⁻¹, the cosine not included; NaN where a channel was not measured.
    channels : tuple of str
        Names, such as "550 nm" or "R".
    wavelengths : tuple of float
        In nm, in the order of the channels; empty where the file names none.
    reader, source : str
        Format, and the name of the file.
    remarks : tuple of str
        What is odd about the data or was done to it, one sentence each.

    """

    theta_i: Array
    phi_i: Array
    theta_o: Array
    phi_o: Array
    values: Array
    channels: tuple[str, ...]
    wavelengths: tuple[float, ...] = ()
    reader: str = ""
    source: str = ""
    remarks: tuple[str, ...] = ()

    @property
    def pairs(self) -> int:
        """Number of pairs of directions."""
        return len(self.theta_i)

    @property
    def light(self) -> Array:
        """Unit vectors towards the light, shape (pairs, 3)."""
        return unit(self.theta_i, self.phi_i)

    @property
    def detector(self) -> Array:
        """Unit vectors towards the detector, shape (pairs, 3)."""
        return unit(self.theta_o, self.phi_o)

    def select(self, rows: NDArray[np.bool_] | NDArray[np.intp]) -> "MeasuredBrdf":
        """Return the pairs chosen by a mask or by their numbers."""
        return replace(
            self,
            theta_i=self.theta_i[rows],
            phi_i=self.phi_i[rows],
            theta_o=self.theta_o[rows],
            phi_o=self.phi_o[rows],
            values=self.values[rows],
        )

    def remarked(self, *remarks: str) -> "MeasuredBrdf":
        """Return the same with more remarks."""
        return replace(self, remarks=(*self.remarks, *remarks))


def of_rows(
    angles: Array,
    values: Array,
    channels: Sequence[str],
    wavelengths: Sequence[float] = (),
    remarks: Sequence[str] = (),
) -> MeasuredBrdf:
    """Make a measured BRDF of θ_i, φ_i, θ_o, φ_o in radians, shape (pairs, 4), and values.

    With wavelengths in nm the channels are named for them.
    """
    return MeasuredBrdf(
        angles[:, 0],
        angles[:, 1],
        angles[:, 2],
        angles[:, 3],
        values,
        tuple(f"{w:g} nm" for w in wavelengths) or tuple(channels),
        tuple(map(float, wavelengths)),
        remarks=tuple(remarks),
    )


def unit(theta: Array, phi: Array) -> Array:
    """Unit vectors, shape (..., 3), from angles in radians."""
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)


def check_size(pairs: int, channels: int) -> None:
    """Refuse more values than are read.

    Raises
    ------
    InputError
        If there are none, or more than MOST_VALUES.

    """
    if pairs < 1 or channels < 1:
        raise InputError(f"{pairs} pairs of {channels} channels: nothing measured in it")
    if pairs * channels > MOST_VALUES:
        raise InputError(
            f"{pairs} pairs of {channels} channels: at most {MOST_VALUES} values are read; "
            "thin the file"
        )
