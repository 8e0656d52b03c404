"""MERL's ``.binary`` and CSV of any BRDF, at the directions that these formats have."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...model import direction
from ...results import detector
from ...results.measured_brdf import merl, write_csv
from ...results.measured_brdf.scattered import of_rows
from .source import Source

Array = NDArray[np.float64]

_CHUNK = 100_000


def write_merl(source: Source, path: Path) -> None:
    """Write the table of MERL: at the centres of its cells, 35 MB.

    Raises
    ------
    InputError
        If the BRDF is anisotropic or has channels that the format has not.

    """
    if not source.scene.roughness.isotropic:
        raise InputError(
            f"{source.name}: σ_x and σ_y differ, and MERL's table is isotropic; write .bsdf or .csv"
        )
    theta_i, phi_i, theta_o, phi_o = merl.angles()
    i, o = direction(theta_i, phi_i), direction(theta_o, phi_o)
    up = np.flatnonzero((i[:, 2] > 0) & (o[:, 2] > 0))
    values = np.full((len(i), 3), np.nan)
    for start in range(0, len(up), _CHUNK):
        rows = up[start : start + _CHUNK]
        values[rows] = source.in_colour(i[rows], o[rows])
    merl.write(values, path)


def write_pairs(source: Source, path: Path) -> None:
    """Write CSV: for each incidence of the scene's light the centres of the detector's bins."""
    light = source.scene.light
    rings = np.radians(detector.ring_centres())
    sectors = np.arange(detector.SECTORS) * 2 * np.pi / detector.SECTORS
    ring, sector = np.meshgrid(rings[1:], sectors, indexing="ij")
    theta_o = np.concatenate([[0.0], ring.ravel()])
    turn = np.concatenate([[0.0], sector.ravel()])
    parts = []
    for theta in np.radians(light.theta):
        for phi in np.radians(light.phi):
            same = np.full(len(turn), theta), np.full(len(turn), phi)
            parts.append(np.stack([*same, theta_o, phi + turn]))
    angles = np.concatenate(parts, axis=1)
    values = source.evaluate(direction(angles[0], angles[1]), direction(angles[2], angles[3]))
    brdf = of_rows(angles.T, values, source.channels, source.wavelengths)
    write_csv(brdf, path)
