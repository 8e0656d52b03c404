"""LBNL's XML of a BRDF averaged over Klems' full basis of 145 patches, for Radiance and WINDOW.

A patch of incidence is named for the azimuth that light travels to, so that the mirror
direction of a patch is the patch of the same number (Ward et al., "A Practical Framework for
Sharing and Rendering Real-World Bidirectional Scattering Distribution Functions", 2012).
Rows are patches of reflected light, columns patches of incidence; values are in sr⁻¹.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...model import direction
from .source import Source

Array = NDArray[np.float64]

EDGES = (0, 5, 15, 25, 35, 45, 55, 65, 75, 90)
COUNTS = (1, 8, 16, 20, 24, 24, 24, 16, 12)
_POINTS = 64
"""Pairs of directions in each pair of patches."""


def write(source: Source, path: Path) -> None:
    """Write the file; the same matrix stands for front and back.

    Raises
    ------
    InputError
        If there are several channels: the format holds the visible band.

    """
    if len(source.channels) > 1:
        raise InputError(
            f"{source.name}: {len(source.channels)} channels, and the format holds one; give one Kd"
        )
    path.write_text(_xml(source.name, matrix(source)), encoding="utf-8", newline="\n")


def patches() -> Array:
    """Edges θ_low, θ_high, φ_low, φ_high of all patches in radians, shape (145, 4)."""
    rows = []
    for low, high, count in zip(EDGES, EDGES[1:], COUNTS, strict=False):
        # The first patch of a ring is centred at azimuth 0.
        width = 2 * np.pi / count
        rows += [
            (np.radians(low), np.radians(high), (k - 0.5) * width, (k + 0.5) * width)
            for k in range(count)
        ]
    return np.array(rows)


def projected_solid_angles() -> Array:
    """∫ cosθ dω of each patch in sr."""
    low, high, left, right = patches().T
    return np.asarray((np.sin(high) ** 2 - np.sin(low) ** 2) / 2 * (right - left))


def matrix(source: Source) -> Array:
    """Mean BRDF of each pair of patches, spread as cosθ in both, shape (145 out, 145 in)."""
    from scipy.stats import qmc  # noqa: PLC0415 - late: it takes 0.2 s to load

    points = qmc.Sobol(4, rng=np.random.default_rng(0)).random(_POINTS)
    low, high, left, right = patches().T[..., None]

    def inside(u: Array, v: Array, turn: float) -> Array:
        rise = np.sin(low) ** 2 + (np.sin(high) ** 2 - np.sin(low) ** 2) * u
        return direction(np.arcsin(np.sqrt(rise)), left + (right - left) * v + turn)

    incident = inside(points[:, 0], points[:, 1], np.pi)
    reflected = inside(points[:, 2], points[:, 3], 0.0)
    count = len(incident)
    averages = np.empty((count, count))
    for column in range(count):
        i = np.broadcast_to(incident[column], reflected.shape).reshape(-1, 3)
        values = source.evaluate(i, reflected.reshape(-1, 3))[:, 0]
        averages[:, column] = values.reshape(count, _POINTS).mean(axis=1)
    return averages


def _xml(name: str, values: Array) -> str:
    basis = "".join(
        f"<AngleBasisBlock><Theta>{(low + high) / 2 if low else 0:g}</Theta><nPhis>{count}</nPhis>"
        f"<ThetaBounds><LowerTheta>{low}</LowerTheta><UpperTheta>{high}</UpperTheta></ThetaBounds>"
        "</AngleBasisBlock>\n"
        for low, high, count in zip(EDGES, EDGES[1:], COUNTS, strict=False)
    )
    rows = "\n".join(", ".join(f"{v:.6e}" for v in row) + "," for row in values)
    blocks = "".join(
        '<WavelengthData><LayerNumber>System</LayerNumber><Wavelength unit="Integral">Visible'
        "</Wavelength><SourceSpectrum>CIE Illuminant D65 1nm.ssp</SourceSpectrum>"
        "<DetectorSpectrum>ASTM E308 1931 Y.dsp</DetectorSpectrum>\n<WavelengthDataBlock>"
        f"<WavelengthDataDirection>Reflection {side}</WavelengthDataDirection>"
        "<ColumnAngleBasis>LBNL/Klems Full</ColumnAngleBasis>"
        "<RowAngleBasis>LBNL/Klems Full</RowAngleBasis>"
        f"<ScatteringDataType>BRDF</ScatteringDataType>\n<ScatteringData>\n{rows}\n"
        "</ScatteringData></WavelengthDataBlock></WavelengthData>\n"
        for side in ("Front", "Back")
    )
    plain = "".join(c if c.isalnum() or c in " ._-" else "_" for c in name)
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<WindowElement xmlns="http://windows.lbl.gov">\n'
        "<WindowElementType>System</WindowElementType>\n<Optical><Layer>\n"
        f"<Material><Name>{plain}</Name><Manufacturer>microsurf</Manufacturer>"
        '<Thickness unit="Meter">0</Thickness><DeviceType>Other</DeviceType></Material>\n'
        "<DataDefinition><IncidentDataStructure>Columns</IncidentDataStructure>\n"
        f"<AngleBasis><AngleBasisName>LBNL/Klems Full</AngleBasisName>\n{basis}</AngleBasis>"
        f"</DataDefinition>\n{blocks}</Layer></Optical></WindowElement>\n"
    )
