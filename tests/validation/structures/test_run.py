import numpy as np
import pytest

from microsurf import predict
from microsurf.results import detector
from validation.structures import figures, run, text

SHOWN = {"gamma": 2.0, "sigma": 0.5, "correlation": 8.0}


def row(source, quantity, value, *, error=0.0, surfaces=0, correlation=np.nan, theta=80.0):
    """One row of atlas.csv as `run.read` gives it."""
    return {
        "gamma": 2.0, "sigma": 0.5, "correlation": correlation, "source": source,
        "theta_i": theta, "quantity": quantity, "value": value, "error": error,
        "surfaces": surfaces,
    }  # fmt: skip


ROWS = [
    row("smith", "body", 0.4),
    row("smith-walk", "total", 0.5),
    row("vcavity-walk", "total", 0.4),
    row("tops", "body", 0.2, error=0.01, surfaces=8, correlation=8.0),
    row("tops", "total", 0.6, error=0.01, surfaces=8, correlation=8.0),
    row("tops", "total", 0.55, error=0.01, surfaces=8, correlation=16.0),
]


def test_ratios_have_the_interval_of_student():
    """Eight surfaces: 2.365 standard errors, over the right theory's value."""
    for quantity, ratio, half in (("total", 1.2, 2.365 * 0.02), ("body", 0.5, 2.365 * 0.025)):
        theta, found, width = figures.ratios(ROWS, SHOWN, "tops", quantity)
        assert theta.tolist() == [80.0]
        assert found == pytest.approx([ratio])
        assert width == pytest.approx([half], rel=1e-3)


def test_theory_is_the_same_at_every_correlation_length():
    for length in (8.0, 16.0):
        _, found, _ = figures.ratios(ROWS, SHOWN | {"correlation": length}, "vcavity-walk", "total")
        assert found == pytest.approx([0.8])


def test_text_has_a_line_for_each_case_and_a_dash_for_what_is_not_known():
    lines = [line for line in text.text(ROWS).splitlines() if line.startswith("| 2 |")]
    assert len(lines) == 2 * 4
    assert "1.200 ± 0.047" in lines[0]
    assert "1.100" in lines[1]
    assert lines[0].count("–") == 3


def test_tables_are_read_as_written(tmp_path):
    known = [r | {"correlation": ""} if np.isnan(r["correlation"]) else r for r in ROWS]
    run.write(tmp_path / "t.csv", known)
    found = run.read(tmp_path / "t.csv")
    assert len(found) == len(ROWS)
    assert found[-1] == ROWS[-1]
    assert np.isnan(found[0]["correlation"])
    assert run.read(tmp_path / "nothing.csv") == []


def test_near_the_mirror_is_a_part_of_the_specular_albedo():
    """Nine bins about (θ_i, 180°) written out, against all of the lobe."""
    scene = run.StructureCase(8.0, 0.3, 8.0, "independent").scene
    found = predict(scene, "flat")
    near, specular = (run.quantities(found, name)[0] for name in ("mirror", "specular"))
    assert near == pytest.approx(np.where(np.array(run.THETAS) > 0, specular, near))
    assert 0 <= near[0] <= specular[0]
    # Negative control: light that leaves sideways is not near the mirror.
    aside = found.roll(phi_o=detector.SECTORS // 4, roll_coords=False)
    assert run.quantities(aside, "mirror")[0][1:] == pytest.approx(0.0)


def test_errors_are_over_surfaces_and_a_case_not_begun_comes_first(monkeypatch, tmp_path):
    monkeypatch.setattr(run, "KEPT", tmp_path)
    case = run.CASES[0]
    assert run.need(case) == np.inf
    albedos = np.ones((8, len(run.THETAS), len(run.QUANTITIES)))
    albedos[::2, 3, 0] = 1.02  # of "total", at one angle: s.d. 0.0107, error 0.374 % of 1.01
    np.save(case.file, albedos)
    assert run.need(case) == pytest.approx(0.02 / 7**0.5 / 2 / 1.01 / 0.003)
