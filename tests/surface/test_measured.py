"""Measured topographies, from the folder that the variable MICROSURF_DATA names."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from microsurf.analysis.validate import validate_scene
from microsurf.scene import Accuracy, Light, Scene, Surface

DATA = os.environ.get("MICROSURF_DATA")

pytestmark = [
    pytest.mark.skipif(not DATA, reason="MICROSURF_DATA names no folder of measured data"),
    pytest.mark.usefixtures("few_walks"),
]


def measured(name, spacing):
    return Scene(
        surface=Surface(
            file=str(Path(DATA) / "topography" / f"{name}.npy"),
            spacing=spacing,
            boundary="mirror",
            level="quadratic",
        ),
        light=Light((0.0, 60.0)),
        accuracy=Accuracy(100_000),
    )


@pytest.mark.parametrize(
    ("name", "spacing", "gamma", "sigma", "ks"),
    [
        ("di-4", 0.0195, 3.25, 0.132, 0.006),
        pytest.param("di-3", 0.039, 2.57, 0.124, 0.022, marks=pytest.mark.long),
        ("al3d-1", 0.438, 6.1, 0.080, 0.013),  # 200 × 296: rectangular
        pytest.param("example_ps", 0.00195, 11.7, 0.367, 0.006, marks=pytest.mark.long),
    ],
)
def test_a_measured_surface_is_traced_fitted_and_compared(name, spacing, gamma, sigma, ks):
    """The published fits lie within our 95 % intervals, and every path is accounted for."""
    entry = validate_scene(name, measured(name, spacing))
    fit = entry.fit
    assert fit.gamma_ci[0] <= gamma <= fit.gamma_ci[1]
    assert abs(fit.sigma - sigma) < 0.05 * sigma
    assert fit.ks < ks
    assert fit.pixel == spacing
    assert entry.broken == []
    assert float(entry.measured.ended.sum()) == 0
    # Nothing made these surfaces for Smith's model, and yet it is near for such gentle slopes.
    body = [row for row in entry.comparisons if row.quantity == "body"]
    assert all(abs(row.effect) < 0.05 for row in body)


def test_heights_with_gaps_are_refused(tmp_path):
    heights = np.load(Path(DATA) / "topography" / "di-3.npy").copy()
    heights[3, 4:9] = np.nan
    np.save(tmp_path / "gaps.npy", heights)
    asked = measured("di-3", 0.039)
    asked = replace(
        asked, surface=replace(asked.surface, file=str(tmp_path / "gaps.npy"), voids="refuse")
    )
    with pytest.raises(ValueError, match="5 of 65536"):
        validate_scene("gaps", asked)
