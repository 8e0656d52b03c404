"""A user BRDF in the model's place: the right one passes, planted errors are found."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from microsurf import model
from microsurf.analysis import validate, validate_user_brdf, validation
from microsurf.model import UserBrdf, examine
from microsurf.report import phrases
from microsurf.scene import Accuracy, Light, Material, Roughness, Scene

ROOT = Path(__file__).parents[2]
SCENE = Scene.read(ROOT / "validation" / "examples" / "ggx.toml")
SMALL = replace(
    SCENE,
    surface=replace(SCENE.surface, realisations=3),
    light=Light((20.0,)),
    accuracy=Accuracy(20_000),
)


@pytest.fixture(scope="module")
def entry():
    return validate.validate_scene("ggx", SMALL, seed=1)


@pytest.fixture
def example(monkeypatch):
    monkeypatch.chdir(ROOT)
    monkeypatch.setattr(sys, "path", list(sys.path))
    return lambda name: model.load_user_brdf(f"validation.examples.{name}")


def lines(judged):
    return phrases.unexpected(
        {"scenes": [validation.as_json(judged)], "invariants": [], "broken": []}
    )


def judge(entry, own):
    return validate_user_brdf.judge(entry, own, examine(own, entry.scene))


def test_the_right_one_passes(entry, example):
    judged = judge(entry, example("user_brdf:brdf"))
    assert lines(judged) == []
    assert [c.verdict for c in judged.comparisons] == ["holds", "holds"]
    assert {c.model for c in judged.comparisons} == {"validation.examples.user_brdf:brdf"}
    specular, body = judged.user_brdf.beside_theory
    assert abs(specular.effect) < 1e-4
    assert abs(body.effect) < 5e-3  # 160 facets
    assert judged.user_brdf.orders == "1"


@pytest.mark.parametrize(
    ("name", "quantity", "effect"),
    [("no_n_squared", "body", 1.25), ("two_for_four", "specular", 1.0)],
)
def test_a_planted_error_is_found_where_it_is(entry, example, name, quantity, effect):
    judged = judge(entry, example(f"user_brdf_wrong:{name}"))
    wrong = [c.quantity for c in judged.comparisons if c.unexpected]
    assert wrong == [quantity]
    (found,) = [a for a in judged.user_brdf.beside_theory if a.quantity == quantity]
    assert found.effect == pytest.approx(effect, abs=0.01)
    assert found.finding == "the user BRDF's own: the theory holds here"
    text = lines(judged)[0]
    assert f"order-1 {quantity} albedo, θ_i = 20°" in text
    assert "the user BRDF's own" in text


def test_the_right_albedo_in_the_wrong_place_is_found(entry, example):
    """A mirror that turns light back: no albedo tells, its lobe does."""
    right = example("user_brdf:brdf")

    def turned(i, o):
        specular, _ = right.function(i, o * [-1, 1, 1])
        return specular, right.function(i, o)[1]

    judged = judge(entry, UserBrdf("own:turned", turned))
    assert [c.verdict for c in judged.comparisons] == ["holds", "holds"]
    (astray,) = judged.broken
    assert astray.startswith("user BRDF: lobe of order-1 specular albedo at θ_i = 20")
    assert "farthest from the theory at θ_o = " in astray


def test_energy_and_what_is_not_there_are_broken_invariants(entry):
    judged = judge(entry, UserBrdf("own:f", lambda _, o: (0 * o[:, 0], np.full(len(o), 0.4))))
    assert any("energy: albedo 1.2566" in text for text in judged.broken)
    assert any("no order-1 specular albedo at θ_i = 20" in text for text in judged.broken)


def test_one_array_is_judged_as_all_orders_against_the_walk(entry):
    whole = float(entry.predicted["smith-walk"].flux.isel(body_events=0).sum())
    total = entry.comparisons[-1]
    assert total.quantity == "total"
    assert total.predicted > whole
    # ∫ i_z o_z cosθ_o dω = i_z 2π/3.
    f = total.predicted * 1.5 / np.pi / np.cos(np.radians(20))
    judged = judge(entry, UserBrdf("own:f", lambda i, o: f * i[:, 2] * o[:, 2]))
    assert [c.quantity for c in judged.comparisons] == ["total"]
    assert judged.user_brdf.beside_theory[0].model == "smith-walk"
    assert judged.user_brdf.beside_theory[0].finding.startswith("as the theory")
    # The albedo is right, its lobe is not.
    assert [text.partition(" of ")[0] for text in judged.broken] == ["user BRDF: lobe"]


def test_a_pair_that_is_all_the_light_is_judged_in_total_too(entry, example):
    """Order 1 misses later ones: its kinds hold, its sum is too dark."""
    judged = judge(entry, replace(example("user_brdf:brdf"), whole=True, notes=lambda _: ["so"]))
    assert [c.quantity for c in judged.comparisons] == ["specular", "body", "total"]
    assert judged.user_brdf.orders == "1 and all"
    total = judged.user_brdf.beside_theory[-1]
    assert total.user_brdf == pytest.approx(
        sum(a.user_brdf for a in judged.user_brdf.beside_theory[:2])
    )
    assert -0.1 < total.effect < -0.02
    assert judged.notes[-1] == "so"


def test_a_mirror_beside_the_values_counts(entry, example):
    right = example("user_brdf:brdf")
    judged = judge(entry, replace(right, mirror=lambda i, _: 0.01 * i[2]))
    plain = judge(entry, right)
    more = judged.comparisons[0].predicted - plain.comparisons[0].predicted
    assert more == pytest.approx(0.01 * np.cos(np.radians(20)))


def test_each_kd_is_asked_on_its_own():
    """Lambert's flat Kd/π, which needs no geometry: exact at each Kd, wrong if one is missed."""
    scene = Scene(
        material=Material(1.0, (0.0, 0.3, 0.9)),
        roughness=Roughness(sigma=(0.0,)),
        light=Light((40.0,), (0.0, 90.0)),
        accuracy=Accuracy(2000),
    )
    flat = validate.validate_scene("flat", scene)

    def lambert(i, _, scene):
        return np.zeros(len(i)), np.full(len(i), scene.material.kd[0] / np.pi)

    def always(i, _, scene):
        return np.zeros(len(i)), np.full(len(i), max(scene.material.kd[0], 0.3) / np.pi)

    judged = judge(flat, UserBrdf("own:f", lambert, takes_scene=True))
    assert lines(judged) == []
    assert [(c.kd, c.phi_i) for c in judged.comparisons] == [
        (kd, phi) for kd in (0.3, 0.9) for phi in (0.0, 90.0)
    ]
    assert {a.finding for a in judged.user_brdf.beside_theory} == {"as the theory"}
    # Where there is no substrate no light may come out of it.
    (stray,) = judge(flat, UserBrdf("own:f", always, takes_scene=True)).broken
    assert stray == "user BRDF: a body part of albedo 0.3 at n = 1, Kd = 0, where there is none"
