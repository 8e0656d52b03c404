"""`microsurf fit -`: what is piped in is known by its first bytes."""

import json
import tempfile

import forked
import numpy as np
import pytest

from microsurf.results.measured_brdf import write_csv
from microsurf.results.measured_brdf.scattered import MeasuredBrdf
from microsurf.surface import generate_surface


def piped(content, *more):
    """Run `microsurf fit -` with content on its standard input."""
    return forked.run(forked.MAIN, "fit", "-", *more, content=content)


def test_a_surface_is_fitted_as_from_its_file(tmp_path):
    np.save(tmp_path / "h.npy", generate_surface(2.0, 0.5, cells=64, seed=3).heights)
    ran = piped((tmp_path / "h.npy").read_bytes(), "--json")
    assert ran.returncode == 0
    assert "bare heights, taken as spacing 1" in ran.stderr
    found = json.loads(ran.stdout)
    assert found["sigma"] == pytest.approx(0.5, rel=0.1)
    assert tempfile.gettempdir() not in ran.stdout + ran.stderr
    ran = piped((tmp_path / "h.npy").read_bytes(), "--out", str(tmp_path / "scene.toml"))
    assert ran.returncode == 2
    assert "a scene names the file of its surface" in ran.stderr
    assert not (tmp_path / "scene.toml").exists()


def test_a_brdf_reaches_the_fit(tmp_path):
    """One incidence is too few for a fit, which is said of what was piped in."""
    theta = np.radians(np.linspace(0, 60, 5))
    nothing = np.zeros(5)
    values = np.full((5, 1), 0.1)
    brdf = MeasuredBrdf(nothing, nothing, theta, nothing, values, ("550 nm",), (550.0,), source="x")
    write_csv(brdf, tmp_path / "x.csv")
    ran = piped((tmp_path / "x.csv").read_bytes())
    alone = forked.run(forked.MAIN, "fit", tmp_path / "x.csv")
    assert (ran.returncode, ran.stdout) == (alone.returncode, alone.stdout)
    assert ran.returncode == 2
    assert ran.stderr.count("\n") == 1
    assert "x.csv" not in ran.stderr


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "/dev/stdin"),
        (b"PK\x03\x04\0\0\0", "must be CSV, ASTM's text or .npy"),
        (b"1 2\n3 4\n", "/dev/stdin"),
        (b"\x93NUMPY\x01\0", "/dev/stdin"),
    ],
)
def test_what_is_nothing_known_is_refused(content, said):
    ran = piped(content)
    assert ran.returncode == 2
    assert said in ran.stderr
    assert ran.stderr.count("\n") == 1
    assert tempfile.gettempdir() not in ran.stderr
