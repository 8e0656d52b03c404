import numpy as np
import pytest
from judge import rate

from validation.coverage import surfaces

CELLS, COUNT = 160, 32
CHOSEN = (
    "nothing", "tilt and bow, levelled", "dy = 1.5 dx", "frame of 20%, crop",
    "scattered of 20%, fill", "blobs of 5%, fill",
)  # fmt: skip


@pytest.mark.parametrize("make", [surfaces.frame, surfaces.scattered, surfaces.blobs])
@pytest.mark.parametrize("share", surfaces.SHARES)
def test_voids_have_their_share(make, share):
    void = make((900, 600), share, np.random.default_rng(1))
    assert void.mean() == pytest.approx(share, rel=0.25)


def test_counts_of_a_table():
    fitted = {"kind": "a", "refused": False, "isotropic": True}
    held = {**fitted, "gamma": [2.4, 2.3, 2.6], "sigma": [0.3, 0.29, 0.31]}
    missed = {**fitted, "gamma": [3.0, 2.8, 3.2], "sigma": [0.3, 0.29, 0.31]}
    (row,) = surfaces.rows([[held], [missed], [{"kind": "a", "refused": True}]])
    assert (row["surfaces"], row["refused"], row["gamma_held"], row["sigma_held"]) == (3, 1, 1, 2)
    assert row["gamma_low"] < 0.5 < row["gamma_high"]
    assert row["gamma_bias"] == pytest.approx(0.08)


@pytest.mark.long
def test_intervals_hold_the_truth(judge, monkeypatch):
    """Short form of reports/coverage; negative control: voids where the surface is steep."""
    kinds = [(name, change) for name, change in surfaces.kinds() if name in CHOSEN]
    steep = [k for k in surfaces.kinds() if k[0].startswith("the steepest")]
    monkeypatch.setattr(surfaces, "kinds", lambda: iter(kinds + steep))
    first = judge.seed(1) * 100
    drawn = [surfaces.fits(first + number, CELLS) for number in range(COUNT)]
    *honest, last = surfaces.rows(drawn)
    for row in honest:
        for key in ("gamma_held", "sigma_held"):
            judge.keeps(rate(row[key], COUNT, 0.88, 1.0))
    judge.catches(rate(last["gamma_held"], COUNT, 0.88, 1.0))
