"""Two layers go through `validate` as every scene: verdicts, budget, invariants, the page."""

import json
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from microsurf import report
from microsurf.analysis import predictions, two_layers, validate
from microsurf.analysis.error_budget import assemble
from microsurf.analysis.error_budget.regions import FIRST, HIGHER, TOTAL
from microsurf.report import sections
from microsurf.scene import Accuracy, Layers, Light, Material, Roughness, Scene, Substrate, Surface
from microsurf.surface import write_surface
from microsurf.surface.realisations import surfaces_of

TINY = Scene(
    material=Material(1.5, (0.8, 0.3)),
    roughness=Roughness(8.0, (0.5,)),
    surface=Surface(cells=32, correlation=4.0, realisations=3),
    light=Light((60.0,)),
    accuracy=Accuracy(4000),
    layers=Layers(12.0, Substrate(8.0, (0.5,))),
)


@pytest.fixture(scope="module")
def entry():
    patch = pytest.MonkeyPatch()
    patch.setattr(validate, "WALKS", 4000)
    patch.setattr(two_layers, "WALKS", 4000)
    patch.setattr(assemble, "WALKS", 4000)
    yield validate.validate_scene("layers", TINY, seed=3)
    patch.undo()


def test_all_of_it_is_there(entry):
    """Verdicts against IL facets, the theory of two layers beside them, what holds anyway."""
    assert {c.model for c in entry.comparisons} == {"smith", "smith-walk"}
    assert entry.measured.sizes["body_events"] > 4
    assert "substrate_events" in entry.measured.coords
    assert "layered-walk" in entry.predicted
    assert not entry.broken
    names = {held.name for held in entry.invariants}
    assert {"mean chord", "second engine", "no impossible light"} <= names
    assert entry.layers["pair"]["gap"] == 12.0
    rows = entry.layers["theory"]["layered-walk"]
    assert {row["quantity"] for row in rows} == {"specular", "body", "total"}
    assert all(row["low"] <= row["effect"] <= row["high"] for row in rows)
    assert entry.scene.layers == TINY.layers


def test_terms_add_up_to_the_two_layers_less_the_theory(entry):
    for budget in entry.budget:
        terms = budget.terms[TOTAL]
        total = float(entry.measured.microsurf.albedo(kd=budget.kd).mean())
        assert sum(t.value for t in terms.values()) == pytest.approx(
            total - budget.predicted["total"], abs=1e-12
        )
        specular = budget.terms["order-1 specular"]["il_assumption"]
        assert specular.value == pytest.approx(0, abs=5e-3)


def test_a_planted_change_of_the_layers_is_the_il_assumption():
    """Ten per cent of all body light more between two layers: no other term knows."""
    bare = replace(TINY, layers=None)
    surfaces = list(surfaces_of(bare, 1))
    facets = validate.measure(bare, surfaces, seed=2)
    layered = validate.measure(TINY, surfaces, seed=2)
    first, _ = predictions.order_one(bare, ("smith",), 0.0)
    walk = predictions.all_orders(bare, "smith-walk", 0.0, 4000, {})

    def terms(layers):
        cases = assemble.cases_of(
            bare, facets, (first["smith"], walk), surfaces, layers=layers, walks=4000
        )
        return assemble.budget_of(cases)[0].terms

    more = layered.copy()
    more["flux"] = layered.flux.where(layered.body_events == 0, 1.1 * layered.flux)
    before, after = terms(layered), terms(more)
    for quantity in (FIRST[1], *HIGHER, TOTAL):
        moved = {
            name: after[quantity][name].value - before[quantity][name].value
            for name in after[quantity]
        }
        assert moved.pop("il_assumption") > 0
        assert max(map(abs, moved.values())) < 1e-12
    assert after[FIRST[0]]["il_assumption"] == before[FIRST[0]]["il_assumption"]
    # Paired: the interfaces' own scatter is not in it.
    term, noise = (before[TOTAL][name] for name in ("il_assumption", "noise"))
    values = layered.microsurf.albedo(kd=0.8) - facets.microsurf.albedo(kd=0.8)
    assert term.value == pytest.approx(float(values.mean()), abs=1e-12)
    assert term.high - term.value == pytest.approx(
        4.302653 * float(values.std(ddof=1)) / np.sqrt(3), rel=1e-5
    )
    assert noise.value == 0
    assert "il_assumption" not in terms(None)[TOTAL]


@pytest.mark.usefixtures("undrawn")
def test_the_page_and_the_document(entry, tmp_path):
    parts = sections.of_scene(entry, "layers")
    (layers,) = [part for part in parts if part.name == "layers"]
    assert layers.text.count("IL assumption: ") == 2
    assert "Does not apply to two layers: masking" in layers.text
    document = report.write([entry], tmp_path, 3, of_scenes={"layers": parts})
    schema = json.loads((Path(report.__file__).parent / "report.schema.json").read_text("utf-8"))
    jsonschema.validate(json.loads((tmp_path / "report.json").read_text("utf-8")), schema)
    (scene,) = document["scenes"]
    assert scene["layers"]["il_assumption"].keys() == {"albedo", "lobe"}
    assert {row["term"] for row in scene["budget"]} >= {"il_assumption", "noise"}
    assert "[layers]" in (tmp_path / "scenes" / "layers.toml").read_text("utf-8")


def test_what_is_not_known_is_said(tmp_path):
    """Of a flat interface there is no budget, of a substrate from a file no theory."""
    flat = replace(TINY, roughness=Roughness(8.0, (0.0,)))
    said = two_layers.summary(flat, 3, None, {})
    assert any("flat interface" in text for text in said["left_out"])
    file = tmp_path / "below.npy"
    write_surface(next(iter(surfaces_of(replace(TINY, layers=None), 1))), file)
    measured_below = replace(TINY, layers=Layers(12.0, Substrate(file=str(file))))
    assert two_layers.walked(measured_below, 0.0, {}, None) == {}
    said = two_layers.summary(measured_below, 3, None, {})
    assert any("substrate from a file" in text for text in said["left_out"])
    assert two_layers.summary(replace(TINY, layers=None), 3, None, {}) == {}
