"""[layers] of a scene: read back the same, and every bad input refused in one line."""

from dataclasses import replace

import pytest

from microsurf import model
from microsurf.analysis.convergence.study import converge
from microsurf.analysis.tradeoff.study import tradeoff
from microsurf.errors import InputError
from microsurf.scene import (
    Accuracy,
    Effects,
    Layers,
    Material,
    Scene,
    Substrate,
    Surface,
    tail_limit,
)

GOOD = (
    "gamma = 8.0\nsigma = 0.5\ncorrelation_with_interface = 0.7",
    "gamma = 2.0\nsigma = [0.5, 0.3]",
    'shape = "same"',
    'shape = "same"\nsigma = 0.25',
    'shape = "flat"',
    'file = "below.npy"',
)


def text(substrate, layers="gap = 4.0", rest=""):
    return f"{rest}\n[layers]\n{layers}\n[layers.substrate]\n{substrate}\n"


@pytest.mark.parametrize("substrate", GOOD)
def test_a_scene_reads_back_the_same(substrate):
    scene = Scene.from_toml(text(substrate, "gap = 4\nabsorption = 0.01"))
    assert Scene.from_toml(scene.to_toml()) == scene
    assert (scene.layers.gap, scene.layers.absorption) == (4.0, 0.01)


def test_without_layers_nothing_is_said_of_them():
    assert "layers" not in Scene().to_toml()
    assert not Scene(material=Material(1.0)).requires.interface


def test_a_file_lies_beside_its_scene(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(text('file = "below.npy"'), encoding="utf-8")
    scene = Scene.read(path)
    assert scene.layers.substrate.file == str(tmp_path / "below.npy")
    scene.write(tmp_path / "again.toml")
    assert Scene.read(tmp_path / "again.toml") == scene


@pytest.mark.parametrize(
    ("substrate", "layers", "rest", "words"),
    [
        ('shape = "same"', "gap = -1.0", "", "layers.gap"),
        ('shape = "same"', "gap = 0.0", "", "layers.gap"),
        ('shape = "same"', "gap = nan", "", "finite"),
        ('shape = "same"', "gap = true", "", "a number"),
        ('shape = "same"', 'gap = "thin"', "", "a number"),
        ('shape = "same"', "gap = 1e9", "", "1e-06 … 1e+06"),
        ('shape = "same"', "absorption = 1.0", "", "without a gap"),
        ('shape = "same"', "gap = 1.0\nabsorption = -0.1", "", "layers.absorption"),
        ('shape = "same"', "gap = 1.0\nabsorbtion = 0.1", "", "did you mean 'absorption'"),
        ('shape = "round"', "gap = 1.0", "", "same, flat"),
        ("", "gap = 1.0", "", "give gamma and sigma"),
        ("gamma = 8.0", "gap = 1.0", "", "give both"),
        ("sigma = 0.5", "gap = 1.0", "", "give gamma and sigma"),
        ('shape = "flat"\nsigma = 0.5', "gap = 1.0", "", "neither with a shape"),
        ('shape = "same"\ngamma = 2.0', "gap = 1.0", "", "give gamma and sigma"),
        ('shape = "same"\nsigma = [0.5, 0.3]', "gap = 1.0", "", "one number"),
        ("gamma = 1.4\nsigma = 0.5", "gap = 1.0", "", "> 1.5"),
        ("gamma = 2.0\nsigma = [0.5, 0.0]", "gap = 1.0", "", "both zero"),
        ("gamma = 2.0\nsigma = -0.5", "gap = 1.0", "", "1e-6 … 1000"),
        (
            "gamma = 2.0\nsigma = 0.5\ncorrelation_with_interface = 1.1",
            "gap = 1.0", "", "−1 … 1",
        ),
        (
            'shape = "same"\ncorrelation_with_interface = 1.0',
            "gap = 1.0", "", "leave it out",
        ),
        ('shape = "same"', "gap = 1.0", "[material]\nn = 0.9", "material.n"),
        ('shape = "same"', "gap = 1.0", "[material]\nn = 0.2\nk = 3.0", "material.k"),
        ('shape = "same"', "gap = 1.0", "[accuracy]\nstandard_error = 1e-3", "accuracy.paths"),
        (
            'shape = "same"', "gap = 1.0", "[effects]\nmultiple_scattering = false",
            "multiple_scattering",
        ),
        (
            "gamma = 2.0\nsigma = 0.5\ncorrelation_with_interface = 0.5",
            "gap = 1.0", '[surface]\nfile = "a.npy"', "no generating field",
        ),
        (
            'shape = "same"\nsigma = 0.5', "gap = 1.0", '[surface]\nfile = "a.npy"',
            "is not scaled",
        ),
    ],
)  # fmt: skip
def test_bad_input_is_refused_in_one_line(substrate, layers, rest, words):
    with pytest.raises(InputError) as refused:
        Scene.from_toml(text(substrate, layers, rest))
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


def test_tables_that_are_missing_are_named():
    with pytest.raises(InputError, match=r"without \[layers.substrate\]"):
        Scene.from_toml("[layers]\ngap = 1.0\n")
    with pytest.raises(InputError, match="must be a table"):
        Scene.from_toml("layers = 3\n")
    with pytest.raises(InputError, match="must be a table"):
        Scene.from_toml("[layers]\ngap = 1.0\nsubstrate = 3\n")


LAYERED = Scene(
    surface=Surface(cells=32, realisations=1),
    accuracy=Accuracy(1000),
    layers=Layers(1.0, Substrate(shape="same")),
)


@pytest.mark.parametrize(
    "ask",
    [
        model.predict,
        lambda scene: model.walk(scene, "smith-walk", walks=10),
        tradeoff,
        converge,
    ],
)
def test_what_knows_one_surface_only_refuses_two(ask):
    with pytest.raises(InputError, match=r"\[layers\]: .* knows one surface") as refused:
        ask(LAYERED)
    assert "\n" not in str(refused.value)


def test_what_two_layers_require():
    flat = replace(LAYERED, roughness=replace(LAYERED.roughness, sigma=(0.0,)))
    assert flat.requires.roughness
    assert not flat.requires.azimuth
    oblique = Layers(1.0, Substrate(gamma=2.0, sigma=(0.5, 0.2)))
    assert replace(LAYERED, layers=oblique).requires.azimuth
    assert Effects().multiple_scattering


def test_a_substrate_whose_tail_no_mesh_holds_is_told():
    heavy = replace(LAYERED, layers=Layers(1.0, Substrate(1.55, (0.5,))))
    assert "layers.substrate.gamma = 1.55" in tail_limit.tail_left_out(heavy)
    assert tail_limit.tail_left_out(LAYERED) is None
