"""Budgets of traced surfaces: planted defects land in their own term."""

from dataclasses import replace

import numpy as np
import pytest

from microsurf import measure, model
from microsurf.analysis.error_budget import assemble, refinement
from microsurf.analysis.error_budget.regions import FIRST, HIGHER, TOTAL
from microsurf.report.figures import error_budget
from microsurf.scene import Accuracy, Light, Material, Roughness, Scene, Surface
from microsurf.surface import Heightfield, surfaces_of

SMALL = Scene(
    material=Material(1.5, (0.8,)),
    roughness=Roughness(4.0, (0.5,)),
    surface=Surface(cells=64, realisations=4),
    light=Light((45.0,)),
    accuracy=Accuracy(16_384),
)


def theory(scene, walks=100_000):
    return model.predict(scene), model.walk(scene, walks=walks, seed=9)


@pytest.fixture(scope="module")
def made():
    surfaces = list(surfaces_of(SMALL, 1))
    return surfaces, measure(SMALL, surfaces, seed=2), theory(SMALL)


def of(scene, measured, predicted, surfaces, **more):
    return assemble.budget_of(
        assemble.cases_of(scene, measured, predicted, surfaces, walks=20_000, **more)
    )[0].terms


def share(before, after, quantity, term):
    """Part of the difference that a defect makes which lands in a term."""
    moved = {
        name: after[quantity][name].value - before[quantity][name].value for name in after[quantity]
    }
    return moved[term] / sum(moved.values()), sum(moved.values())


def test_terms_add_up_to_measured_less_predicted(made):
    surfaces, measured, predicted = made
    found = assemble.budget_of(
        assemble.cases_of(SMALL, measured, predicted, surfaces, walks=20_000)
    )
    (only,) = found
    total = float(measured.microsurf.albedo(n=1.5, kd=0.8).mean())
    assert sum(t.value for t in only.terms[TOTAL].values()) == pytest.approx(
        total - only.predicted["total"], abs=1e-12
    )
    rows = assemble.rows(found)
    assert {row["term"] for row in rows} == {
        "model", "slopes", "losses", "masking", "multiple", "noise",
    }  # fmt: skip
    figure = error_budget.figure(rows)
    assert len(figure.axes) == 3


def test_slopes_two_per_cent_too_steep_are_slopes(made):
    surfaces, _, predicted = made
    many = replace(SMALL, accuracy=Accuracy(131_072))  # the rays' noise must not move the share
    steep = [replace(h, heights=1.02 * h.heights) for h in surfaces]
    before = of(many, measure(many, surfaces, seed=2), predicted, surfaces)
    after = of(many, measure(many, steep, seed=2), predicted, steep)
    for quantity in FIRST:
        part, moved = share(before, after, quantity, "slopes")
        assert moved < 0
        assert 0.8 < part < 1.25


def test_a_capped_tracer_is_multiple_scattering(made):
    """Paths that end at their third facet: orders 3 and more are missing from the measurement."""
    surfaces, measured, predicted = made
    capped = measured.copy()
    capped["flux"] = measured.flux.where(measured.order < 3, 0.0)
    before = of(SMALL, measured, predicted, surfaces)
    after = of(SMALL, capped, predicted, surfaces)
    for quantity in (*HIGHER[1:], TOTAL):
        assert share(before, after, quantity, "multiple")[0] == pytest.approx(1)


@pytest.mark.parametrize(("kind", "term"), [("r_i", "model"), ("cap", "multiple")])
def test_a_fault_of_the_model_is_in_its_own_term(made, kind, term):
    """Body light 2 % too weak at every event is law; a walk capped at two events is multiple."""
    surfaces, measured, predicted = made
    first, walk = (d.copy(deep=True) for d in predicted)
    if kind == "cap":
        walk["flux"] = walk.flux.where(walk.order < 3, 0.0)
    else:
        first["flux"] = first.flux.where(first.body_events == 0, 0.98 * first.flux)
        walk["flux"] = walk.flux * xr_power(walk)
    before = of(SMALL, measured, predicted, surfaces)
    after = of(SMALL, measured, (first, walk), surfaces, theory=predicted)
    quantities = (*HIGHER[1:], TOTAL) if kind == "cap" else (FIRST[1], *HIGHER, TOTAL)
    for quantity in quantities:
        assert share(before, after, quantity, term)[0] == pytest.approx(1, abs=1e-6)


def xr_power(walk):
    return 0.98**walk.body_events


def test_a_file_and_one_surface_have_the_error_of_their_rays(made):
    surfaces, _, predicted = made
    one = replace(SMALL, surface=replace(SMALL.surface, realisations=1))
    found = of(one, measure(one, surfaces[:1], seed=2), predicted, surfaces[:1])
    for quantity in (*FIRST, TOTAL):
        noise = found[quantity]["noise"]
        assert noise.high > 0
        masking = found[quantity]["masking"]
        assert masking.high - masking.value >= noise.high * (quantity != TOTAL)


def test_refinement_pairs_are_better_than_strangers(made):
    """The interval of pairs beside that of unpaired surfaces of the same number."""
    _, measured, _ = made
    found = refinement.refine(SMALL, measured, seed=3)
    for quantity in FIRST:
        mesh = found.parts("mesh", 0.8, (0, 0))[quantity]
        tile = found.parts("tile", 0.8, (0, 0))[quantity]
        assert np.isfinite(mesh.value)
        assert 0 < mesh.half < 0.1 * float(measured.flux.sum())
        assert tile.value == 0
        assert tile.half > 0
    flat = replace(SMALL, roughness=Roughness(2.0, (0.0,)))
    assert refinement.refine(flat, measured) is None
    assert refinement.refine(replace(SMALL, surface=Surface(file="x.npy")), measured) is None


@pytest.mark.long
@pytest.mark.parametrize("structure", ["tops", "middle", "extremes"])
def test_another_structure_is_masking(structure):
    """Order 1 at 75°, γ = 2, 512²: at least four fifths of what the structure changes."""
    scene = replace(
        SMALL, roughness=Roughness(2.0, (0.5,)), light=Light((75.0,)),
        surface=Surface(cells=512, realisations=6), accuracy=Accuracy(131_072),
    )  # fmt: skip
    predicted = theory(scene, 1_000_000)
    found = []
    for name in ("independent", structure):
        asked = replace(scene, surface=replace(scene.surface, structure=name))
        surfaces: list[Heightfield] = list(surfaces_of(asked, 1))
        measured = measure(asked, surfaces, seed=2)
        found.append(
            assemble.budget_of(assemble.cases_of(asked, measured, predicted, surfaces))[0].terms
        )
    part, moved = share(*found, FIRST[0], "masking")
    if structure == "tops":
        assert moved < -0.005
    assert part > 0.8 or abs(moved) < 1e-3
