"""What models cost on what was measured: a wrong one is shown wrong, and nothing is made twice."""

from dataclasses import replace

import pytest

from microsurf import model, trace
from microsurf.analysis.self_test import SelfTest
from microsurf.analysis.tradeoff import from_validation, methods, pareto
from microsurf.analysis.tradeoff.from_validation import frontier_of
from microsurf.analysis.validation import Validation
from microsurf.invariants import Invariant
from microsurf.report import sections
from microsurf.scene import Accuracy, Light, Material, Roughness, Scene, Surface

SCENE = Scene(
    material=Material(1.5, (0.0,)),
    roughness=Roughness(8.0, (0.3,)),
    surface=Surface(cells=64, correlation=4.0, realisations=4),
    light=Light((50.0,)),
    accuracy=Accuracy(5000),
)
SPENT = 0.25
OFF = 1.5
CHECKED = SelfTest([], None, "2020-01-01 00:00")


@pytest.fixture(scope="module")
def measured(new_seed):
    return trace.measure(SCENE, seed=new_seed(3))


@pytest.fixture(scope="module")
def found(measured):
    """With a prediction that is far too bright, in place of the V-cavity's own."""
    smith = model.predict(SCENE, "smith")
    planted = smith.assign(flux=OFF * smith.flux)
    with pytest.MonkeyPatch.context() as patch:
        effort = replace(from_validation.EFFORT, walks=((1000, 4),))
        patch.setattr(from_validation, "EFFORT", effort)
        made = {"smith": (smith, SPENT), "vcavity": (planted, 4 * SPENT)}
        return frontier_of(SCENE, measured, made, seed=1)


def test_all_models_run_and_no_surface(found):
    models = {run.method.model for run in found.runs}
    assert models == {*model.order_one(), *model.all_orders()}
    smith = next(p for p in found.points["albedo"] if p.name == "smith")
    assert smith.seconds == SPENT  # as long as it took when it was made
    assert (found.reference.surfaces, found.reference.paths) == (4, 5000)
    assert found.reference.half_width["albedo"] > 0


def test_a_model_that_is_off_is_shown_worse(found):
    """Apart by 13.9 standard errors or more with 40 seeds; about 3 are needed."""
    points = {point.name: point.squared for point in found.points["albedo"]}
    assert pareto.worse(points["vcavity"], points["smith"])
    assert not pareto.worse(points["smith"], points["vcavity"])
    assert "vcavity" in found.dominated["albedo"]
    # The reference's own error is in it, and does not hide it: 0.40 at least with 40 seeds.
    assert pareto.error(points["vcavity"]).low > 0.2


def test_none_where_nothing_could_be_told(measured):
    few = measured.isel(realisation=slice(0, from_validation.LEAST - 1))
    assert frontier_of(SCENE, few, {}) is None
    black = replace(SCENE, material=Material(1.0, (0.0,)))
    assert frontier_of(black, measured, {}) is None


def test_sections_of_scenes_and_of_all(found, measured):
    entry = Validation("small", SCENE, measured, {}, [], list[Invariant](), frontier=found)
    bare = replace(entry, name="bare", frontier=None)
    assert sections.of_scene(bare, "bare") == []
    (part,) = sections.of_scene(entry, "small")
    assert "microsurf tradeoff" in part.text
    (picture,) = part.pictures
    assert len(picture.rows) == sum(len(points) for points in found.points.values())
    assert not any(row["model"] == "surface" for row in picture.rows)
    other = replace(entry, name="other")
    (over_all,) = sections.of_all([entry, other, bare], CHECKED)
    assert {row["rung"] for row in over_all.pictures[0].rows} == {r.method.name for r in found.runs}
    assert {row["scenes"] for row in over_all.pictures[0].rows} == {2}
    assert sections.of_all([entry, bare], CHECKED) == []  # it would say the same again


def test_a_flat_scene_has_one_rung_that_is_right():
    flat = replace(SCENE, roughness=Roughness(2.0, (0.0,)), material=Material(1.5, (0.5,)))
    measured = trace.measure(flat, seed=2)
    found = frontier_of(flat, measured, {}, seed=0)
    assert [run.method for run in found.runs] == methods.methods_of(flat, from_validation.EFFORT)
    assert pareto.error(found.points["albedo"][0].squared).low < 0.01
