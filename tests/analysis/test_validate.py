"""The main job on scenes small enough to be done at once."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from microsurf import model
from microsurf.analysis import comparison, validate, validation
from microsurf.errors import InputError
from microsurf.scene import Accuracy, Effects, Light, Material, Roughness, Scene, Surface
from microsurf.scene.expectation import Expectation
from microsurf.surface import Heightfield, generate_surface, write_surface

pytestmark = pytest.mark.usefixtures("few_walks")

TINY = Scene(
    material=Material(1.5, (0.0,)),  # no substrate: predictions take no time
    surface=Surface(cells=32, realisations=2),
    light=Light((30.0, 60.0)),
    accuracy=Accuracy(2000),
)


@pytest.fixture(scope="module")
def entry():
    return validate.validate_scene("tiny", TINY, seed=3)


def test_every_model_is_asked_and_the_first_is_judged(entry):
    assert tuple(entry.predicted) == ("smith", "vcavity", "smith-walk")
    assert [c.quantity for c in entry.comparisons] == ["specular"] * 2 + ["total"] * 2
    first = entry.predicted["smith"]
    specular = first.flux.isel(body_events=0).sum(("theta_o", "phi_o")).values.ravel()
    np.testing.assert_allclose([c.predicted for c in entry.comparisons[:2]], specular, rtol=1e-12)
    total = (
        entry.predicted["smith-walk"].flux.isel(body_events=0).sum(("order", "theta_o", "phi_o"))
    )
    np.testing.assert_allclose([c.predicted for c in entry.comparisons[2:]], total.values.ravel())
    assert [c.model for c in entry.comparisons] == ["smith"] * 2 + ["smith-walk"] * 2
    assert all(c.predicted_error > 0 for c in entry.comparisons[2:])


def test_without_multiple_scattering_the_total_is_one_bounce():
    alone = replace(TINY, effects=Effects(multiple_scattering=False))
    entry = validate.validate_scene("alone", alone, seed=3)
    assert tuple(entry.predicted) == ("smith", "vcavity")
    assert {c.model for c in entry.comparisons} == {"smith"}
    assert [row["theta_i"] for row in entry.left_out] == [30.0, 60.0]
    assert all(row["with_all"] > row["without"] for row in validation.as_json(entry)["left_out"])


def test_the_measurement_is_that_of_the_scene_and_seed(entry):
    again = validate.validate_scene("tiny", TINY, seed=3, workers=1)
    other = validate.validate_scene("tiny", TINY, seed=4)
    assert again.comparisons == entry.comparisons
    assert other.comparisons != entry.comparisons
    assert dict(entry.measured.sizes)["realisation"] == 2
    assert entry.heightfield.heights.shape == (32, 32)
    assert entry.fit is None
    assert entry.broken == []
    assert entry.left_out == []


def test_a_broken_invariant_is_told(entry):
    """The invariants themselves are tested in tests/invariants."""
    assert len(entry.invariants) >= 5
    wrong = replace(entry.invariants[0], value=1.0)
    (line,) = replace(entry, invariants=[wrong, *entry.invariants[1:]]).broken
    assert line.startswith("energy: 1, must be ≤ 1e-12")


def test_figures_are_strict_json(entry):
    document = validation.as_json(entry)
    text = json.dumps(document, allow_nan=False, default=lambda value: value.tolist())
    read = json.loads(text)
    assert read["name"] == "tiny"
    assert set(read["predicted"]) == {"smith", "vcavity", "smith-walk"}
    assert read["measured"]["paths"] == 2 * 2 * 2000
    assert len(read["comparisons"]) == 4
    assert read["fit"] is None
    assert read["broken"] == []
    assert {"name", "value", "tolerance", "holds"} <= set(read["invariants"][0])


def test_a_flat_scene_has_one_model_and_no_surface(judge):
    flat = replace(TINY, roughness=Roughness(2.0, (0.0,)), accuracy=Accuracy(20_000))
    entry = validate.validate_scene("flat", flat, seed=judge.seed(0))
    assert tuple(entry.predicted) == ("flat",)
    assert entry.heightfield is None
    assert entry.statistics == {}
    for row in entry.comparisons:  # two realisations differ by their rays alone
        error = np.sqrt(row.predicted * (1 - row.predicted) / 40_000)
        judge.near(row.measured, row.predicted, error)
        judge.tells(row.measured, 1.3 * row.predicted, error)  # negative control


def test_expectations_decide_what_is_unexpected():
    wrong = replace(TINY, expect={"specular": Expectation(("departs",), 0.99)})
    rows = validate.validate_scene("tiny", wrong, seed=3).comparisons
    assert [row.unexpected for row in rows] == [True, True, False, False]
    assert "departs" not in {row.verdict for row in rows}


def test_a_surface_from_a_file_is_compared_with_its_fit(tmp_path):
    """Made with γ = 3, σ = 0.2: at 64² the fit is good to a few per cent."""
    made = generate_surface(3.0, 0.2, cells=64, seed=1)
    path = tmp_path / "h.npy"
    write_surface(made, path)
    given = replace(TINY, surface=Surface(file=str(path), realisations=4))
    entry = validate.validate_scene("file", given)
    assert entry.measured.sizes["realisation"] == 1
    assert entry.fit.sigma == pytest.approx(0.2, rel=0.1)
    assert entry.scene.roughness.sigma_x == entry.fit.sigma
    assert entry.scene.roughness.gamma == entry.fit.gamma
    assert {row.basis for row in entry.comparisons} == {"rays on one surface"}
    document = validation.as_json(entry)
    json.dumps(document, allow_nan=False, default=lambda value: value.tolist())
    assert document["fit"]["pixel"] == 1.0


def lay(tmp_path, turn):
    """A scene of σ = (0.2, 0.6), on the file's axes or turned from them by a quarter at most."""
    made = generate_surface(3.0, 0.2, 0.6, cells=256, seed=4)
    heights = made.heights
    if turn:
        back = ndimage.rotate(heights, -turn, reshape=False, mode="grid-wrap")
        heights = back[48:208, 48:208]
    path = tmp_path / "h.npy"
    write_surface(Heightfield(heights, boundary="mirror"), path)
    return replace(
        TINY,
        surface=Surface(file=str(path), boundary="mirror"),
        light=Light((60.0,), (0.0, 90.0)),
        accuracy=Accuracy(100_000),
    )


@pytest.mark.parametrize("turn", [0.0, 30.0])
def test_a_lay_is_compared_with_its_own_axes(tmp_path, turn):
    """Negative control: an isotropic theory, and one that is not turned, are 10 % off."""
    asked = lay(tmp_path, turn)
    entry = validate.validate_scene("lay", asked)
    fit = entry.fit
    assert not fit.isotropic
    assert any("have axes" in note for note in entry.notes)
    effects = {
        (row.quantity, row.phi_i): row.effect
        for row in entry.comparisons
        if row.quantity == "specular"
    }
    assert [row.phi_i for row in entry.comparisons][:2] == [0.0, 90.0]
    worst = max(map(abs, effects.values()))
    rough = Roughness(fit.gamma, (fit.sigma,))
    others = [model.predict(replace(entry.scene, roughness=rough), "smith")]
    if turn:
        others.append(model.predict(entry.scene, "smith"))
        assert entry.budget == []
        assert fit.azimuth == pytest.approx(turn, abs=3)
        assert fit.azimuth_ci[0] > 0
    else:
        assert entry.budget
    for other in others:
        table = comparison.compare(entry.measured, other, entry.scene)
        off = max(abs(row.effect) for row in table if row.quantity == "specular")
        assert off > worst + 0.05
    document = validation.as_json(entry)
    assert document["fit"]["isotropic"] is False
    json.dumps(document, allow_nan=False, default=lambda value: value.tolist())


@pytest.mark.parametrize(
    ("heights", "names"),
    [
        (lambda h: h * 1e-9, ("median slope", "same unit")),
        (lambda h: h * (np.arange(64) > 20)[:, None], ("flat", "plateau")),
        (lambda h: h * (np.arange(64) > 7)[:, None], ("fit γ = 1.", "> 1.5", "flat")),
    ],
)
def test_a_file_without_a_theory_is_refused_before_tracing(tmp_path, monkeypatch, heights, names):
    path = tmp_path / "h.npy"
    made = generate_surface(1.75, 0.5, cells=64, seed=1)
    write_surface(Heightfield(heights(made.heights)), path)
    monkeypatch.setattr(validate, "measure", lambda *_, **__: pytest.fail("traced"))
    with pytest.raises(InputError) as found:
        validate.validate_scene("file", replace(TINY, surface=Surface(file=str(path))))
    for name in ("h.npy", *names):
        assert name in str(found.value)


def test_a_beckmann_fit_is_written_as_inf(tmp_path):
    """JSON has no ∞, and a scene no infinite γ."""
    rng = np.random.default_rng(0)
    path = tmp_path / "h.npy"
    field = np.fft.ifft2(np.fft.fft2(rng.standard_normal((64, 64))) * _low_pass(64)).real
    write_surface(Heightfield(field / field.std()), path)
    given = replace(TINY, surface=Surface(file=str(path)), light=Light((30.0,)))
    entry = validate.validate_scene("file", given)
    assert np.isinf(entry.fit.gamma)
    assert validation.as_json(entry)["fit"]["gamma"] == "inf"
    assert np.isfinite(entry.scene.roughness.gamma)
    text = json.dumps(validation.as_json(entry), allow_nan=False, default=lambda v: v.tolist())
    assert "Infinity" not in text


def _low_pass(cells):
    k = np.fft.fftfreq(cells)
    return np.exp(-200 * (k[:, None] ** 2 + k**2))
