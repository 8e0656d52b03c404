"""Complex indices n + ik of some metals, at wavelengths their sources tabulate: none interpolated.

Gold and copper: Johnson and Christy, Physical Review B 6, 4370, 1972. Aluminium: Rakić,
Applied Optics 34, 4755, 1995.
"""

from typing import NamedTuple


class Index(NamedTuple):
    """Refractive index n and extinction coefficient k at one wavelength in nm."""

    wavelength: float
    n: float
    k: float


GOLD = (Index(450.9, 1.38, 1.914), Index(548.6, 0.43, 2.455), Index(616.8, 0.21, 3.272))
COPPER = (Index(450.9, 1.24, 2.397), Index(548.6, 1.02, 2.577), Index(616.8, 0.30, 3.205))
ALUMINIUM = (
    Index(442.80, 0.6079, 5.3676),
    Index(563.57, 1.0728, 6.7839),
    Index(619.93, 1.3660, 7.4052),
)
METALS = {"gold": GOLD, "copper": COPPER, "aluminium": ALUMINIUM}
