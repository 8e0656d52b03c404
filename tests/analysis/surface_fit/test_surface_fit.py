import numpy as np
import pytest

from microsurf.analysis.surface_fit.quantisation import height_step
from microsurf.analysis.surface_fit.study import as_json, study_surface
from microsurf.report.figures import surface_fit as drawn
from microsurf.surface import generate_surface

KEYS = {
    "kind", "gamma", "gamma_ci", "sigma_x", "sigma_x_ci", "sigma_y", "sigma_y_ci", "azimuth",
    "azimuth_ci", "ks", "pixel", "unit", "voids", "scales", "Sq", "Sa", "Sdq", "Sdr", "reader",
}  # fmt: skip


def test_the_step_of_heights():
    heights = np.random.default_rng(71).normal(size=(100, 120))
    assert height_step(heights) is None
    for step in (1e-9, 0.02, 3.7):
        stepped = step * np.rint(heights / 0.01)
        assert height_step(stepped * 1.1 / 1.1 + 7 * step) == pytest.approx(step, rel=1e-6)
    # Single precision far from zero is a step, too: that of al3d files.
    far = (76340 + heights).astype(np.float32).astype(float)
    assert height_step(far) == pytest.approx(2.0**-7)
    assert height_step(np.zeros((10, 10))) is None


def test_a_study_says_all_and_draws_it():
    made = generate_surface(2.0, 0.5, cells=128, spacing=0.5, seed=72)
    study = study_surface(made, made)
    values = as_json(study)
    assert values.keys() >= KEYS
    assert values["models"]["ggx"]["ks"] == pytest.approx(values["ks"], abs=5e-3)
    assert values["models"]["beckmann"]["ks"] > 0.1
    assert [row["pixel"] for row in values["scales"]] == [[0.5, 0.5], [1.0, 1.0], [2.0, 2.0]]
    assert values["scales"][0]["gamma"] == values["gamma"]
    assert values["slope_step"] is None
    assert 1.5 < values["tail"]["least_gamma_held"] < 2
    assert values["tail"]["area_beyond"] < 0.01
    rows = drawn.rows(study)
    by_curve = {
        name: [r for r in rows if r["curve"] == name] for name in ("facets", "std", "scale")
    }
    assert len(by_curve["scale"]) == 3
    x, y = np.array([[r["x"], r["y"]] for r in by_curve["facets"]]).T
    std = np.array([[r["x"], r["y"]] for r in by_curve["std"]]).T
    assert np.abs(np.interp(x, *std) - y).max() < 0.02
    drawn.figure(rows, study).savefig("/dev/null", format="svg")


def test_infinite_gamma_is_a_text_and_a_triangle():
    made = generate_surface(np.inf, 0.5, cells=96, seed=73)
    study = study_surface(made, made)
    assert as_json(study)["gamma"] == "inf"
    figure = drawn.figure(drawn.rows(study), study)
    assert any("∞" in axes.get_ylabel() for axes in figure.axes)


def test_an_interval_without_an_end_is_an_arrow_without_a_cap():
    made = generate_surface(2.0, 0.5, cells=128, spacing=0.5, seed=72)
    study = study_surface(made, made)

    def triangles(rows):
        axes = next(a for a in drawn.figure(rows, study).axes if a.get_ylabel().startswith("γ"))
        marks = [line for line in axes.lines if line.get_marker() == "^"]
        caps = [line for line in axes.lines if line.get_marker() == "_"]
        at = [x for line in marks for x in line.get_xdata()]
        missing = [int(np.isnan(line.get_ydata(orig=False)).sum()) for line in caps]
        return len(at), sum(missing), "triangles: ∞" in axes.get_ylabel()

    rows = drawn.rows(study)
    assert triangles(rows) == (0, 0, False)
    first = next(row for row in rows if row["curve"] == "scale")
    first["gamma_high"] = np.inf
    assert triangles(rows) == (1, 1, True)
