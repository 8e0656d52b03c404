"""A BRDF of one's own: what it may be, and one clear line where it is not."""

import sys

import numpy as np
import pytest

from microsurf import model
from microsurf.errors import InputError
from microsurf.model import UserBrdf, examine, load_user_brdf, predict_user_brdf
from microsurf.results import datasets
from microsurf.scene import Light, Material, Roughness, Scene

SCENE = Scene(material=Material(1.5, (0.5,)), light=Light((20.0, 60.0)))
ONE = Scene(material=SCENE.material, light=Light((60.0,)))
SMITH = model.Brdf(Scene(material=Material(1.5, (0.5,))), "approximate")


def lambert(i, o):
    return np.full(len(o), 0.5 / np.pi) + 0 * i[:, 0]


def told(scene=SCENE, function=lambert, **more):
    with pytest.raises(InputError) as caught:
        examine(UserBrdf("own:f", function, **more), scene)
    text = str(caught.value)
    assert "\n" not in text
    return text


def leaves(*_):
    raise SystemExit(0)


def raises(*_):
    raise ZeroDivisionError("nothing is left")


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (lambda *_: 0.5, "shape ()"),
        (lambda _, o: np.ones((len(o), 1)), "shape (64, 1)"),
        (lambda _, o: np.ones((2, len(o))), "shape (2, 64)"),
        (lambda *_: [[1.0], [1.0, 2.0], [3.0]], "no array of numbers"),
        (lambda _, o: np.ones(len(o), complex), "complex"),
        (lambda _, o: ["x"] * len(o), "real numbers"),
        (lambda *_: None, "object"),
        (lambda _, o: (np.ones(len(o)), 3.0), "shape ()"),
        (lambda _, o: np.where(o[:, 0] > 0, np.nan, 1.0), "f = nan"),
        (lambda _, o: np.where(o[:, 0] > 0, np.inf, 1.0), "f = inf"),
        (lambda _, o: (np.ones(len(o)), o[:, 0]), "body f = -"),
        (leaves, "SystemExit at 64 directions: 0; mend the callable"),
        (raises, "ZeroDivisionError at 64 directions: nothing is left"),
        (lambda i: np.ones(len(i)), "TypeError"),
    ],
)
def test_what_is_no_brdf_is_refused_in_one_line(function, words):
    text = told(function=function)
    assert text.startswith("--model own:f: ")
    assert words in text


def test_what_changes_from_call_to_call_is_refused():
    rng = np.random.default_rng(0)
    assert "deterministic" in told(function=lambda _, o: rng.random(len(o)))


def test_what_is_not_reciprocal_is_said_with_the_place():
    (line,) = examine(UserBrdf("own:f", lambda i, _: i[:, 2]), SCENE)
    assert line.startswith("reciprocity: all f(i, o) = ")
    assert examine(UserBrdf("own:f", lambda i, o: i[:, 2] + o[:, 2]), SCENE) == []
    assert examine(UserBrdf("own:f", SMITH.evaluate), SCENE) == []


def test_a_mirror_has_no_values():
    flat = Scene(material=Material(1.5, (0.5,)), roughness=Roughness(sigma=(0.0,)))
    assert not model.has_values(flat)
    assert "spike" in told(flat)
    assert model.has_values(Scene(material=Material(1.0), roughness=Roughness(sigma=(0.0,))))


def test_it_is_given_the_scene_if_it_asks():
    seen = []

    def f(i, o, scene):
        seen.append(scene.material.kd)
        return lambert(i, o)

    several = Scene(material=Material(1.5, (0.2, 0.8)))
    assert "knows no Kd" in told(several)
    examine(UserBrdf("own:f", f, takes_scene=True), several)
    assert set(seen) == {(0.2,), (0.8,)}


def test_it_may_work_in_place_and_print_without_harm(capsys):
    def f(i, o):
        print("hello")  # noqa: T201
        o *= 0.0
        return np.full(len(i), 0.1)

    assert examine(UserBrdf("own:f", f), SCENE) == []
    bins = predict_user_brdf(UserBrdf("own:f", f), SCENE).flux.sum(("theta_o", "phi_o"))
    np.testing.assert_allclose(bins[0, :, 0, 0, 0], 0.1 * np.pi, rtol=1e-10)
    assert capsys.readouterr().out == ""


@pytest.fixture
def package(tmp_path, monkeypatch):
    (tmp_path / "own_thing.py").write_text(
        "import numpy as np\nNUMBER = 3\nclass Kind: pass\n"
        "def f(i, o, scene): return np.ones(len(i))\nclass A:\n    b = staticmethod(f)\n"
    )
    (tmp_path / "own_broken.py").write_text("1/0\n")
    (tmp_path / "own_leaving.py").write_text("raise SystemExit(0)\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    yield
    for name in ("own_thing", "own_broken", "own_leaving"):
        sys.modules.pop(name, None)


@pytest.mark.usefixtures("package")
def test_callables_are_found_from_here():
    found = load_user_brdf("own_thing:f")
    assert found.takes_scene
    assert found.table is None
    assert load_user_brdf("own_thing:A.b").function is found.function


@pytest.mark.usefixtures("package")
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("smith", "package.module:callable"),
        ("own_thing:", "package.module:callable"),
        (":f", "package.module:callable"),
        ("nowhere.at.all:f", "ModuleNotFoundError"),
        ("own_broken:f", "ZeroDivisionError"),
        ("own_leaving:f", "SystemExit"),
        ("own_thing:g", "no attribute 'g'"),
        ("own_thing:NUMBER", "is a int"),
        ("own_thing:Kind", "is a type"),
        ("missing.csv", "no such file"),
        ("..:f", "can't be imported"),
    ],
)
def test_what_is_not_found_is_one_line(name, words):
    with pytest.raises(InputError) as caught:
        load_user_brdf(name)
    assert words in str(caught.value)
    assert name in str(caught.value)


def test_a_pair_is_order_1_like_every_prediction():
    """A model of ours put in as a user BRDF gives its own bins; body at unit weight."""
    own = predict_user_brdf(UserBrdf("own:f", SMITH.evaluate), ONE)
    ours = model.predict(ONE, "approximate")
    assert own.flux.dims == ours.flux.dims
    assert own.attrs["orders"] == "1"
    for k in (0, 1):
        theirs = ours.flux[0, 0, 0, 0, k]
        gap = float(np.abs(own.flux[0, 0, 0, 0, k] - theirs).sum() / theirs.sum())
        # Of the body the series of `body_bins` is good to 1e−5 of its ring, here 1e−4.
        assert gap < 2e-4
    assert list(own.part.values) == ["specular", "body"]
    assert float(own.relative_error.max()) < 1e-3


def test_one_array_is_all_orders():
    own = predict_user_brdf(UserBrdf("own:f", lambert), SCENE)
    assert own.attrs["orders"] == "all"
    np.testing.assert_allclose(datasets.hemispherical(own.flux).sum("body_events"), 0.5, rtol=1e-10)


def test_what_no_sum_holds_is_refused():
    """Values without any rule, as of a hash of the directions."""

    def noise(i, o):
        return np.modf(np.abs(np.sin(o @ [12.9898, 78.233, 37.719] + i[:, 2]) * 43758.5453))[0] ** 8

    with pytest.raises(InputError, match="can't be integrated"):
        predict_user_brdf(UserBrdf("own:f", noise), ONE)


def test_a_body_part_without_a_substrate_is_told():
    black = Scene(material=Material(1.5, (0.0,)), light=Light((20.0,)))
    own = predict_user_brdf(UserBrdf("own:f", lambda i, o: (lambert(i, o), lambert(i, o))), black)
    assert own.attrs["stray_body"] > 0.1
