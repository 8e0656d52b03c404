"""The box in which everything must hold, and the places in it that are looked at."""

import numpy as np
from numpy.typing import NDArray

BOX = "γ 1.5+ … 1e9 and ∞, σ 0 … 10, n 1 … 100, Kd 0 … 1, θ 0 … 89.99999°"

_STEEPEST = float(np.nextafter(1.5, 2))
_ALMOST_ONE = 1 - 2.0**-53
_LEAST_INDEX = 1 + 2.0**-52

QUICK: dict[str, tuple[float, ...]] = {
    "gamma": (_STEEPEST, 1.501, 1.75, 2.0, 8.0, 40.0, 1e3, 1e9, np.inf),
    "sigma": (1e-6, 0.02, 0.5, 10.0),
    "theta": (0.0, 1e-3, 5.0, 45.0, 75.0, 89.0, 89.99, 89.99999),
    "below": (90.00001, 91.0, 120.0, 179.9),
    "tilt": (0.0, 20.0, 60.0, 89.0, 89.99999),
    "rho": (1e-8, 1e-3, 0.3, 1.0, 5.0, 100.0, 1e8),
    "wide": (1e-6, 0.5, 10.0),
    "u": (1e-300, 1e-9, 0.1, 0.5, 0.99, 1 - 1e-6, 1 - 1e-12, _ALMOST_ONE),
    "s": (1e-9, 0.01, 1.0, 5.0, 36.0),
    "n": (1.0, _LEAST_INDEX, 1 + 1e-9, 1.0003, 1.33, 1.5, 2.4, 10.0, 100.0),
    "k": (1e-6, 0.1, 1.0, 3.3, 100.0),
    "metal": (1e-3, 0.2, 0.9999, 1.0, 2.0, 100.0),
    "kd": (0.0, 1e-9, 0.5, 0.999, _ALMOST_ONE, 1.0),
}
"""Values of each coordinate on the coarse map; θ and what is like it in degrees."""

FULL: dict[str, tuple[float, ...]] = QUICK | {
    "gamma": (
        _STEEPEST, 1.5 + 1e-9, 1.501, 1.51, 1.6, 1.75, 2.0, 2.5, 4.0, 8.0, 25.999, 26.0, 40.0,
        200.0, 1e3, 1e5, 1e7, 1e9, np.inf,
    ),
    "wide": (1e-6, 1e-3, 0.1, 0.5, 2.0, 10.0),
    "sigma": (1e-6, 1e-3, 0.02, 0.1, 0.5, 1.0, 3.0, 10.0),
    "theta": (
        0.0, 1e-5, 1e-3, 0.1, 1.0, 5.0, 15.0, 30.0, 45.0, 60.0, 75.0, 85.0, 89.0, 89.9, 89.99,
        89.9999, 89.99999,
    ),
    "below": (90.00001, 90.01, 91.0, 100.0, 120.0, 150.0, 170.0, 179.0, 179.9),
    "rho": (1e-8, 1e-5, 1e-3, 0.03, 0.3, 1.0, 2.0, 5.0, 20.0, 100.0, 1e4, 1e8),
    "u": (
        1e-300, 1e-30, 1e-9, 1e-4, 0.1, 0.5, 0.9, 0.99, 0.9999, 1 - 1e-6, 1 - 1e-9, 1 - 1e-12,
        _ALMOST_ONE,
    ),
    "s": (1e-12, 1e-9, 1e-4, 0.01, 0.3, 1.0, 2.0, 5.0, 15.0, 36.0),
    "n": (
        1.0, _LEAST_INDEX, 1 + 1e-12, 1 + 1e-9, 1 + 1e-6, 1.0003, 1.01, 1.33, 1.5, 2.0, 2.4, 4.0,
        10.0, 30.0, 100.0,
    ),
    "k": (1e-9, 1e-6, 1e-3, 0.1, 0.5, 1.0, 3.3, 10.0, 100.0),
    "metal": (1e-3, 0.05, 0.2, 0.5, 0.9999, 1.0, 1.5, 2.0, 7.0, 100.0),
    "kd": (0.0, 1e-9, 1e-3, 0.1, 0.5, 0.9, 0.999, 1 - 1e-9, _ALMOST_ONE, 1.0),
}  # fmt: skip
"""The same on the fine map."""

SYMBOLS = {
    "gamma": "γ", "sigma": "σ", "wide": "σ", "theta": "θ (°)", "below": "θ (°)",
    "tilt": "θ_m (°)",
    "rho": "ρ = |slope|/σ", "u": "u", "s": "s", "n": "n", "k": "k", "metal": "n", "kd": "Kd",
}  # fmt: skip
"""How figures and tables write the coordinates."""


def ticked(name: str, value: float) -> str:
    """How a coordinate's value is written: what differs from a border shows by how much."""
    border = {"gamma": 1.5, "n": 1.0}.get(name)
    if border is not None and 0 < value - border < 1e-3:
        return f"{border:g}+{value - border:.0e}".replace("e-0", "e-")
    if name in ("u", "kd") and 0 < 1 - value < 1e-3:
        return f"1-{1 - value:.0e}".replace("e-0", "e-")
    if np.isinf(value):
        return "∞"
    return f"{value:.7g}"


def unit(theta: float, phi: float = 0.0) -> NDArray[np.float64]:
    """Direction at θ, φ in degrees, in doubles: the formula is asked about these, not about θ."""
    t, p = np.radians(theta), np.radians(phi)
    return np.array([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])
