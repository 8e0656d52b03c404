"""Files for other programs: read again by our readers, by Mitsuba, or as XML."""

import json
from dataclasses import replace
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from click.testing import CliRunner

from microsurf.analysis.export import check, klems, rgl, tables
from microsurf.analysis.export.source import Source, of_fit, of_scene
from microsurf.analysis.export.traced import points_of_bins
from microsurf.cli.group import cli
from microsurf.errors import InputError
from microsurf.model import direction, evaluate
from microsurf.results import detector
from microsurf.results.measured_brdf import read_brdf
from microsurf.results.measured_brdf.rgl_tensor import read_tensors, write_tensors
from microsurf.scene import Light, Material, Roughness, Scene

SCENE = Scene(
    material=Material(1.5, (0.2, 0.5, 0.8)),
    roughness=Roughness(2.0, (0.4,)),
    light=Light((0.0, 40.0), (0.0,)),
)


@pytest.fixture(scope="module")
def source():
    return of_scene(SCENE, "a paint")


@pytest.fixture
def few(monkeypatch):
    """A coarse grid, for tests of all but its errors."""
    monkeypatch.setattr(rgl, "_ISOTROPIC", rgl._Sizes(1, 5, (16, 24), 9))
    monkeypatch.setattr(rgl, "_ANISOTROPIC", rgl._Sizes(3, 4, (16, 16), 7))


def lambertian(function=None, channels=("grey",)):
    """A source without integrals; symmetric in both directions."""
    function = function or (lambda i, o: (i[:, 2] * o[:, 2])[:, None])
    return Source("made up", function, SCENE, channels)


def test_a_source_is_what_predict_evaluates(source):
    rng = np.random.default_rng(1)
    i, o = direction(np.arccos(rng.uniform(0.1, 1, (2, 60))), rng.uniform(0, 6, (2, 60)))
    one = replace(SCENE, material=Material(1.5, (0.5,)))
    expected = np.sum(evaluate(one, i, o), axis=0)
    assert np.allclose(source.evaluate(i, o)[:, 1], expected, rtol=5e-3)


@pytest.mark.usefixtures("few")
@pytest.mark.parametrize("sigma", [(0.4,), (0.4, 0.2)])
def test_our_reader_finds_the_source_in_a_bsdf(tmp_path, sigma):
    scene = replace(SCENE, roughness=Roughness(2.0, sigma), material=Material(0.2, (), 3.9))
    made = of_scene(scene, "gold")
    rgl.write(made, tmp_path / "a.bsdf")
    brdf = read_brdf(tmp_path / "a.bsdf")
    steep = np.cos(brdf.theta_o) > 0.05  # float32 of f cosθ_o
    ratio = brdf.values / np.maximum(made.in_colour(brdf.light, brdf.detector), 1e-5)
    bright = steep & (brdf.values[:, 0] > 1e-2)
    for light in np.unique(brdf.light, axis=0):
        # But for one factor, which keeps the albedo of what is interpolated.
        of_light = ratio[bright & (brdf.light == light).all(axis=1)]
        assert np.ptp(of_light) < 4e-3 * of_light.mean()


def test_the_nearest_nodes_are_moved_onto_traced_incidences():
    nodes = np.array([0.0, 0.4, 0.8, 1.2])
    assert rgl._moved(nodes, np.array([0.0, 0.5, 1.0, 1.4])).tolist() == [0.0, 0.5, 1.0, 1.2]


def test_a_coarse_file_keeps_the_albedo_of_its_incidences(tmp_path, monkeypatch):
    """Negative control: values that were not scaled, of which 1.4 % are lost between points."""
    pytest.importorskip("mitsuba")
    monkeypatch.setattr(rgl, "_ISOTROPIC", rgl._Sizes(1, 5, (32, 48), 24))
    made = of_scene(replace(SCENE, material=Material(0.2, (), 3.9)), "gold")
    rgl.write(made, tmp_path / "a.bsdf")
    theta = float(rgl.tensors(made)["theta_i"][3])
    theta_o, turn = points_of_bins()
    o = direction(theta_o.ravel(), turn.ravel())
    i = np.broadcast_to(direction(theta, 0.0), o.shape)

    def albedo(f):
        bins = f.reshape(*theta_o.shape, -1).mean(axis=2)[..., 0]
        return float((bins * detector.projected_solid_angles()).sum())

    wanted = albedo(made.evaluate(i, o))
    there = albedo(check.in_mitsuba(tmp_path / "a.bsdf", (), i, o) / o[:, 2:])
    assert there == pytest.approx(wanted, rel=3e-3)
    brdf = read_brdf(tmp_path / "a.bsdf")
    near = np.isclose(brdf.light[:, 2], np.cos(theta), atol=1e-5) & (brdf.values[:, 0] > 0.1)
    factor = np.median(brdf.values[near] / made.in_colour(brdf.light, brdf.detector)[near])
    assert there / factor != pytest.approx(wanted, rel=1e-2)


@pytest.mark.usefixtures("few")
def test_a_spectral_bsdf_has_its_wavelengths(tmp_path, source):
    made = replace(source, wavelengths=(450.0, 550.0, 650.0))
    rgl.write(made, tmp_path / "a.bsdf")
    assert read_brdf(tmp_path / "a.bsdf").wavelengths == (450, 550, 650)


def test_tensors_come_back(tmp_path):
    fields = {"a": np.arange(6, dtype="f4").reshape(2, 3), "text": np.frombuffer(b"hi", "u1")}
    write_tensors(tmp_path / "t", fields)
    again = read_tensors(tmp_path / "t")
    assert again.keys() == fields.keys()
    assert all(np.array_equal(again[name], fields[name]) for name in fields)


def test_mitsuba_reads_it_within_half_a_per_cent(tmp_path, source):
    pytest.importorskip("mitsuba")
    rgl.write(source, tmp_path / "a.bsdf")
    found = check.check(source, tmp_path / "a.bsdf", 4000)
    assert found["error"] < 0.005
    assert found["albedo_error"] < 0.003
    # A negative control: the same file is not that of a surface 3 % rougher.
    other = of_scene(replace(SCENE, roughness=Roughness(2.0, (0.412,))), "another")
    assert check.check(other, tmp_path / "a.bsdf", 4000)["error"] > 0.005


def test_merl_comes_back(tmp_path):
    made = lambertian(lambda i, o: np.stack([k * i[:, 2] * o[:, 2] for k in (1, 2, 3)], axis=1))
    tables.write_merl(replace(made, channels=("R", "G", "B")), tmp_path / "a.binary")
    brdf = read_brdf(tmp_path / "a.binary")
    cosines = np.cos(brdf.theta_i) * np.cos(brdf.theta_o)
    assert np.allclose(brdf.values, cosines[:, None] * [1, 2, 3], rtol=1e-9, atol=1e-12)
    assert brdf.pairs > 5e5


def test_csv_comes_back(tmp_path, source):
    tables.write_pairs(source, tmp_path / "a.csv")
    brdf = read_brdf(tmp_path / "a.csv")
    assert brdf.channels == ("R", "G", "B")
    assert brdf.pairs == 2 * (1 + 45 * 36)
    assert np.allclose(brdf.values, source.evaluate(brdf.light, brdf.detector), rtol=1e-9)


def test_klems_keeps_energy_and_puts_the_mirror_on_the_diagonal(tmp_path):
    klems.write(lambertian(lambda i, _: np.full((len(i), 1), 0.5 / np.pi)), tmp_path / "a.xml")
    root = ET.parse(tmp_path / "a.xml").getroot()  # noqa: S314 - ours
    data = [node.text for node in root.iter("{http://windows.lbl.gov}ScatteringData")]
    assert len(data) == 2
    values = np.array([float(w) for w in data[0].split(",") if w.strip()]).reshape(145, 145)
    assert np.allclose(klems.projected_solid_angles() @ values, 0.5, rtol=1e-6)
    assert klems.projected_solid_angles().sum() == pytest.approx(np.pi)
    lobe = lambertian(lambda i, o: np.exp(-400 * ((i + o)[:, :2] ** 2).sum(axis=1))[:, None])
    assert np.array_equal(klems.matrix(lobe).argmax(axis=0), np.arange(145))


@pytest.mark.parametrize(
    ("scene", "wavelengths", "words"),
    [
        (Scene(roughness=Roughness(sigma=(0.0,))), (), "mirrors into one direction"),
        (Scene(material=Material(1.5, (0.1, 0.2))), (), "--wavelengths"),
        (Scene(material=Material(1.5, (0.1, 0.2))), (500, 400), "ascending"),
        (Scene(material=Material(1.5, (0.1,))), (400, 500), "one for each Kd"),
    ],
)
def test_what_no_format_holds_is_refused(scene, wavelengths, words):
    with pytest.raises(InputError, match=words):
        of_scene(scene, "s.toml", wavelengths)


def test_formats_refuse_what_they_do_not_hold(tmp_path):
    two = replace(lambertian(), channels=("400 nm", "500 nm"), wavelengths=(400, 500))
    with pytest.raises(InputError, match="red, green"):
        tables.write_merl(two, tmp_path / "a.binary")
    with pytest.raises(InputError, match="give one Kd"):
        klems.write(two, tmp_path / "a.xml")
    lay = replace(lambertian(), scene=Scene(roughness=Roughness(2.0, (0.4, 0.2))))
    with pytest.raises(InputError, match="isotropic"):
        tables.write_merl(lay, tmp_path / "a.binary")


FIT = {
    "kind": "brdf", "material": "conductor", "gamma": 2.5, "sigma": 0.3, "n": [0.2, 0.4],
    "k": [3.0, 2.0], "wavelengths": [450.0, 600.0], "verdict": "border", "reason": "γ → 1.5",
    "orders": "all",
}  # fmt: skip


def test_a_fit_becomes_its_material(tmp_path):
    path = tmp_path / "fit.json"
    path.write_text(json.dumps(FIT), encoding="utf-8")
    made = of_fit(path)
    assert made.wavelengths == (450.0, 600.0)
    assert "border" in made.notes[0]
    i = o = direction(np.array([0.3]), np.array([0.1]))
    rough = Roughness(2.5, (0.3,))
    one = evaluate(Scene(material=Material(0.4, (), 2.0), roughness=rough), i, o)
    assert made.evaluate(i, o)[0, 1] == pytest.approx(float(np.sum(one)))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"gamma": None}, "no material follows"),
        ({"kind": "surface"}, "not what"),
        ({"material": "lambertian+conductor"}, "not exported"),
    ],
)
def test_what_is_no_fit_of_a_material_is_refused(tmp_path, change, words):
    path = tmp_path / "fit.json"
    path.write_text(json.dumps({**FIT, **change}), encoding="utf-8")
    with pytest.raises(InputError, match=words):
        of_fit(path)


def test_the_command_writes_whole_files_or_none(tmp_path):
    scene = tmp_path / "s.toml"
    scene.write_text("[material]\nn = 1.0\nkd = 0.5\n[light]\ntheta = [30]\n", encoding="utf-8")
    run = CliRunner().invoke(
        cli, ["export", str(scene), "--out", str(tmp_path / "a.csv"), "--json"]
    )
    assert run.exit_code == 0
    assert json.loads(run.stdout).keys() >= {"file", "error"}
    assert read_brdf(tmp_path / "a.csv").pairs == 1 + 45 * 36
    for words, out in ((["--check"], "b.csv"), ([], "b.png"), (["--wavelengths", "1,2"], "b.csv")):
        with pytest.raises(InputError):
            CliRunner().invoke(
                cli, ["export", str(scene), "--out", str(tmp_path / out), *words],
                catch_exceptions=False,
            )  # fmt: skip
        assert not (tmp_path / out).exists()
