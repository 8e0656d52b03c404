"""Measured paints and PTFE, from the folder that the variable MICROSURF_DATA names."""

import os
from pathlib import Path

import pytest

from microsurf.analysis.brdf_fit.fit import fit_brdf
from microsurf.analysis.brdf_fit.summary import figures
from microsurf.results.measured_brdf import read_brdf

DATA = os.environ.get("MICROSURF_DATA")

pytestmark = pytest.mark.skipif(not DATA, reason="MICROSURF_DATA names no folder of measured data")


@pytest.mark.parametrize(
    ("name", "verdict", "said"),
    [
        ("garnet_red.brdf", "fits", ""),
        ("acryl_blue.brdf", "narrow", "outshines"),
        ("cayman.brdf", "does not fit", "the mirror zone"),
        ("PTFE.data.csv", "does not fit", "at θ_i = 75°"),
    ],
)
def test_verdicts(name, verdict, said):
    fit = fit_brdf(read_brdf(Path(DATA) / "brdf" / name), orders="1")
    assert fit.verdict == verdict
    assert said in fit.reason
    if name == "garnet_red.brdf":
        values = figures(fit)
        rms = values["held_out_log_rms"]
        assert [rms[d] for d in ("beckmann", "ggx", "std")] == pytest.approx(
            [0.0082, 0.0109, 0.0073], abs=1e-4
        )
        assert values["gamma_ci"][0] < 3.1 < values["gamma_ci"][1]
        assert values["n_ci"][0] < 1.52 < values["n_ci"][1]
