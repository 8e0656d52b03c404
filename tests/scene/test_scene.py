import math
from dataclasses import fields, replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from microsurf.errors import InputError
from microsurf.scene import (
    BOUNDARIES,
    CORRELATIONS,
    LEVELS,
    MAX_CELLS,
    MAX_INDEX,
    SPACINGS,
    STRUCTURES,
    Accuracy,
    Effects,
    Light,
    Material,
    Roughness,
    Scene,
    Surface,
)
from microsurf.scene.expectation import QUANTITIES, VERDICTS, Expectation

# The machines that run the tests are busy: how long an example takes says nothing.
PATIENT = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])


def numbers(low, high, **more):
    return st.floats(low, high, allow_nan=False, allow_infinity=False, **more)


def some(values, most=4):
    return st.lists(values, min_size=1, max_size=most, unique=True).map(tuple)


# Any text TOML can hold: no surrogates.
texts = st.text(st.characters(codec="utf-8"), max_size=40)
words = some(st.sampled_from(VERDICTS), 3).map("|".join)
sigmas = numbers(1e-6, 1000)


@st.composite
def scenes(draw):
    light = Light(draw(some(numbers(0, 90, exclude_max=True))), draw(some(numbers(-360, 360))))
    verdicts = st.one_of(
        words, st.tuples(*[words] * len(light.theta)), st.lists(words, min_size=1, max_size=1)
    )
    return Scene(
        title=draw(texts),
        rationale=draw(texts),
        material=draw(
            st.one_of(
                st.builds(Material, numbers(1, MAX_INDEX), some(numbers(0, 1))),
                st.builds(
                    Material,
                    numbers(0, MAX_INDEX, exclude_min=True),
                    k=numbers(0, MAX_INDEX, exclude_min=True),
                ),
            )
        ),
        roughness=Roughness(
            draw(numbers(1.5, 1e9, exclude_min=True)),
            draw(st.one_of(st.just((0.0,)), st.tuples(sigmas), st.tuples(sigmas, sigmas))),
        ),
        surface=Surface(
            cells=draw(st.integers(2, MAX_CELLS)),
            correlation=draw(numbers(*CORRELATIONS)),
            structure=draw(st.sampled_from(STRUCTURES)),
            realisations=draw(st.integers(1, 10_000)),
            file=draw(st.none() | texts.filter(bool)),
            spacing=draw(st.none() | numbers(*SPACINGS)),
            boundary=draw(st.none() | st.sampled_from(BOUNDARIES)),
            level=draw(st.sampled_from(LEVELS)),
        ),
        light=light,
        accuracy=Accuracy(draw(st.integers(1, 10**12))),
        effects=Effects(draw(st.booleans())),
        expect=draw(
            st.dictionaries(
                st.sampled_from(QUANTITIES),
                st.builds(
                    Expectation,
                    verdicts,
                    numbers(0, 1, exclude_min=True, exclude_max=True),
                    texts,
                ),
            )
        ),
    )


@PATIENT
@given(scenes())
def test_a_scene_reads_back_the_same(scene):
    assert Scene.from_toml(scene.to_toml()) == scene


@PATIENT
@given(scenes())
def test_requirements_are_what_the_scene_has(scene):
    needs = scene.requires
    rough = scene.surface.file is not None or max(scene.roughness.sigma) > 0
    assert needs.interface == (scene.material.n != 1 or scene.material.k > 0)
    assert needs.substrate == any(kd != 0 for kd in scene.material.kd)
    assert needs.roughness == rough
    assert needs.multiple_scattering == scene.effects.multiple_scattering
    if scene.surface.file is None:
        assert needs.anisotropy == (len(set(scene.roughness.sigma)) == 2)


def test_the_scene_of_the_documentation():
    """A scene as users write it: numbers where lists may stand, whole numbers for reals."""
    scene = Scene.from_toml("""
        title = "t"
        [material]
        n = 1
        kd = [0, 0.5]
        [roughness]
        sigma = [0.1, 0.2]
        [light]
        theta = 30
        [expect.specular]
        verdict = "holds|undecided"
        margin = 0.01
        why = "because"
    """)
    assert scene.material == Material(1.0, (0.0, 0.5))
    assert (scene.roughness.sigma_x, scene.roughness.sigma_y) == (0.1, 0.2)
    assert scene.light.theta == (30.0,)
    assert scene.expect["specular"] == Expectation(("holds|undecided",), 0.01, "because")
    assert scene.surface == Surface()


def test_a_conductor_is_n_and_k_without_kd():
    gold = Scene.from_toml("[material]\nn = 0.43\nk = 2.455")
    assert gold.material == Material(0.43, k=2.455)
    assert gold.material.kd == (0.0,)
    assert gold.requires.interface
    assert not gold.requires.substrate
    assert Material().kd == (0.8,)


WRONG = {
    "text": "'a'", "truth": "true", "list": "[]", "nested": "[[1]]", "table": "{ a = 1 }",
    "NaN": "nan", "∞": "inf", "date": "1979-05-27", "huge": "1" + 400 * "0", "texts": "['a']",
}  # fmt: skip
SECTIONS = {
    "material": Material, "roughness": Roughness, "surface": Surface, "light": Light,
    "accuracy": Accuracy, "effects": Effects, "expect.total": Expectation,
}  # fmt: skip
KEYS = [(section, field.name) for section, kind in SECTIONS.items() for field in fields(kind)]
RIGHT = {
    ("surface", "file"): ("text",),
    ("surface", "channel"): ("text",),
    ("surface", "height_unit"): ("text",),
    ("effects", "multiple_scattering"): ("truth",),
    ("expect.total", "why"): ("text",),
}


@pytest.mark.parametrize(("section", "key"), KEYS)
@pytest.mark.parametrize("kind", WRONG)
def test_wrong_types_are_refused_by_name(section, key, kind):
    text = f"[{section}]\n{key} = {WRONG[kind]}\n"
    if kind in RIGHT.get((section, key), ()):
        Scene.from_toml(text)
        return
    with pytest.raises(InputError) as refusal:
        Scene.from_toml(text)
    line = str(refusal.value)
    assert "\n" not in line
    assert len(line) < 200
    assert key in line
    assert "must be" in line


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("materiel = 1", ("'materiel'", "'material'")),
        ("[material]\nk = 3\nkd = 0.8", ("material.kd", "no substrate")),
        ("[material]\nk = 3\nn = 0", ("material.n", "> 0")),
        ("[material]\nn = 0.5", ("material.n", "1 (no interface)")),
        ("[surface]\ncell = 1", ("'cell'", "[surface]", "'cells'")),
        ("[roughness]\nGamma = 2", ("'Gamma'", "'gamma'")),
        ("[expect.speculr]\nverdict = 'holds'", ("'speculr'", "'specular'")),
        ("[light]\ntheta_i = 1", ("'theta_i'", "'theta'")),
        ("material = 1", ("material = 1", "table")),
        ("[[material]]\nn = 1", ("material", "table")),
        ("[expect]\ntotal = 1", ("expect.total", "table")),
        ("expect = 1", ("expect", "[expect.specular]")),
        ("title = 1", ("title = 1", "text")),
        ("[material", ("not a scene",)),
        ("[material]\nn = 1\nn = 2", ("not a scene",)),
        ("[expect.total]\nverdict = ['holds', 'holds']", ("2 entries", "4 light.theta")),
        ("[expect.total]\nverdict = 'hold'", ("'hold'", "holds, departs, undecided")),
        ("[expect.total]\nmargin = 1", ("margin", "between 0 and 1")),
        ("[roughness]\nsigma = [1, 2, 3]", ("one number or two",)),
        ("[roughness]\nsigma = [1, 0]", ("both",)),
        ("[light]\ntheta = [0, 90]", ("90", "0 ≤ θ < 90")),
        ("[light]\ntheta = [5, 5]", ("without repetition",)),
    ],
)
def test_bad_scenes_say_what_is_wrong(text, words):
    with pytest.raises(InputError) as refusal:
        Scene.from_toml(text)
    assert "\n" not in str(refusal.value)
    for word in words:
        assert word in str(refusal.value)


@pytest.mark.parametrize(
    ("kind", "key", "inside", "outside"),
    [
        (Material, "n", (1, 100), (math.nextafter(1, 0), math.nextafter(100, 101))),
        (Material, "k", (0, 100), (-5e-324, math.nextafter(100, 101), math.nan)),
        (Material, "kd", (0, 1), (-5e-324, math.nextafter(1, 2))),
        (Roughness, "gamma", (math.nextafter(1.5, 2), 1e300), (1.5, -2, math.nan)),
        (Roughness, "sigma", (0, 1e-6, 1000), (-1e-9, 1e-7, 1000.1, math.nan)),
        (Surface, "cells", (2, MAX_CELLS), (1, 0, -2, MAX_CELLS + 1, 100_000, 10**20, 2.0)),
        (Surface, "realisations", (1, 10_000), (0, 10_001)),
        (Light, "theta", (0, math.nextafter(90, 0)), (90, -5e-324)),
        (Light, "phi", (-360, 360), (-361, math.inf)),
        (Accuracy, "paths", (1, 10**12), (0, -1, 1e6)),
    ],
)
def test_ranges_to_their_ends(kind, key, inside, outside):
    for value in inside:
        kind(**{key: value})
    for value in outside:
        with pytest.raises(InputError, match=key):
            kind(**{key: value})


def test_a_surface_file_is_looked_for_beside_its_scene(tmp_path):
    (tmp_path / "s.toml").write_text('[surface]\nfile = "heights.npy"\n')
    assert Scene.read(tmp_path / "s.toml").surface.file == str(tmp_path / "heights.npy")
    (tmp_path / "s.toml").write_text('[surface]\nfile = "/elsewhere/heights.npy"\n')
    assert Scene.read(tmp_path / "s.toml").surface.file == "/elsewhere/heights.npy"


@PATIENT
@given(scenes())
def test_a_scene_file_reads_back_the_same(tmp_path_factory, scene):
    path = tmp_path_factory.mktemp("scenes") / "s.toml"
    scene = replace(scene, surface=replace(scene.surface, file=None))
    scene.write(path)
    assert Scene.read(path) == scene


def test_a_scene_file_marks_what_it_could_leave_out(tmp_path):
    path = tmp_path / "s.toml"
    Scene.of(gamma=3, theta=(0, 30, 60, 80)).write(path)
    lines = path.read_text(encoding="utf-8").splitlines()
    assert "gamma = 3" in [line.removesuffix(".0") for line in lines]
    assert {"realisations = 4  # default", "theta = [  # default"} <= set(lines)
    kept = [line for line in lines if not line.endswith("# default")]
    assert not [line for line in kept if line.startswith(("cells", "paths", "n ="))]


@pytest.mark.parametrize("file", ["s.npy", "in/s.npy", "{folder}/s.npy"])
def test_a_surface_file_is_found_from_wherever_the_scene_is_written(tmp_path, monkeypatch, file):
    """Also behind a link, where a folder's parent is another one than its name says."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "far" / "away").mkdir(parents=True)
    (tmp_path / "in").symlink_to(tmp_path / "far" / "away")
    scene = Scene(surface=Surface(file=file.format(folder=tmp_path)))
    Path(scene.surface.file).write_bytes(b"")
    for folder in (".", "in", "far"):
        path = Path(folder) / "scene.toml"
        scene.write(path)
        again = Scene.read(path)
        assert Path(again.surface.file).samefile(scene.surface.file)
    scene.write("scene.toml")
    assert Scene.read("scene.toml") == scene


def test_a_scene_is_written_whole_or_not_at_all(tmp_path):
    with pytest.raises(InputError, match=r"scene\.toml"):
        Scene().write(tmp_path / "none" / "scene.toml")
    path = tmp_path / "scene.toml"
    path.write_text("n = 1", encoding="utf-8")
    with pytest.raises(InputError, match=f"{path}: unknown key 'n'"):
        Scene.read(path)


def test_a_file_that_is_no_scene_is_named_once(tmp_path):
    """Absent, a folder, or no text."""
    (tmp_path / "latin.toml").write_bytes("title = 'é'".encode("latin-1"))
    (tmp_path / "folder.toml").mkdir()
    for name in ("absent.toml", "folder.toml", "latin.toml"):
        with pytest.raises(InputError) as refusal:
            Scene.read(tmp_path / name)
        assert str(refusal.value).count(name) == 1


def test_any_title_reads_back():
    text = Scene(title='"quotes" \\ and\nlines').to_toml()
    assert Scene.from_toml(text).title == '"quotes" \\ and\nlines'


def test_the_short_constructor_is_the_long_one():
    short = Scene.of(gamma=3, sigma=(0.5, 0.2), n=1.33, kd=(0.1, 0.9), theta=(0, 60), phi=30)
    assert short == Scene(
        material=Material(1.33, (0.1, 0.9)),
        roughness=Roughness(3.0, (0.5, 0.2)),
        light=Light((0.0, 60.0), (30.0,)),
    )
    assert Scene.of(theta=Light().theta) == Scene()
    assert Scene.of(n=0.43, k=2.455).material.kd == (0.0,)
    with pytest.raises(InputError, match=r"roughness\.gamma"):
        Scene.of(gamma=1)


def test_a_scene_shows_itself_in_a_notebook_and_its_title_holds_no_markup():
    shown = replace(Scene.of(theta=(0, 60)), title="<script>alert(1)</script>")._repr_html_()
    assert "<script>" not in shown
    assert "&lt;script&gt;" in shown
    assert "<td>theta = 0.0, 60.0, phi = 0.0</td>" in shown
