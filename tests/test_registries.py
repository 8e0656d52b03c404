"""One entry is enough: a toy model, reader and engine are seen everywhere, no file touched."""

import json
from dataclasses import dataclass, replace

import numpy as np
import pytest
from click.testing import CliRunner

from microsurf import model
from microsurf.analysis import validate
from microsurf.cli.group import cli
from microsurf.errors import InputError
from microsurf.invariants import referee
from microsurf.model import Masking, Model
from microsurf.physics import smith
from microsurf.physics.fresnel import reflectance
from microsurf.report import citations
from microsurf.report.figures import albedo_by_order, lobes
from microsurf.scene import (
    ENGINES,
    Accuracy,
    Citation,
    Engine,
    Light,
    Material,
    Roughness,
    Scene,
    Surface,
)
from microsurf.surface import (
    FORMATS,
    Format,
    Heightfield,
    HeightMap,
    read_surface,
    write_surface,
)
from microsurf.trace import exact
from microsurf.trace.engine import EXACT, tracer_of

SCENE = Scene(
    material=Material(1.5, (0.0,)),
    roughness=Roughness(8.0, (0.3,)),
    surface=Surface(cells=32, correlation=4.0, realisations=2),
    light=Light((50.0,)),
    accuracy=Accuracy(2000),
)
PAPER = Citation(
    "toy2026", "misc", ("A. Toy",), "A masking of half of Smith's", "nowhere", "", 2026, "a toy"
)


@pytest.fixture(scope="module")
def toy():
    """Half of Smith's G2, cited by a paper that no list has."""
    entry = Model(
        "toy", "Toy", "half of Smith's G2", (PAPER, "cook1982"), (0, (1, 4)), "h", "green",
        Masking(lambda i, o, *std: smith.g2_height_correlated(i, o, *std) / 2), compared=True,
    )  # fmt: skip
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(model.MODELS, "toy", entry)
        yield entry


def printed(*arguments):
    """What a command prints."""
    ran = CliRunner().invoke(cli, arguments, catch_exceptions=False)
    assert ran.exit_code == 0, ran.output
    return ran.stdout


def test_a_toy_model_is_predicted(toy):
    surface = ("--gamma", "8", "--sigma", "0.3", "--kd", "0", "--theta", "50")
    found = json.loads(printed("predict", *surface, "--model", "toy", "--json"))
    smiths = model.predict(SCENE, "smith")
    assert found["model"] == toy.key
    assert found["albedo"] == pytest.approx(float(smiths.flux.sum()) / 2, rel=1e-6)
    help_ = printed("predict", "--help")
    assert "|toy]" in "".join(help_.split())
    assert toy.what in help_
    brdf = model.Brdf(SCENE, "toy")
    drawn = brdf.sample(np.array([[0.6, 0.0, 0.8]]), np.random.default_rng(1))
    assert drawn.weight.shape == (1,)


def test_a_toy_model_is_validated_drawn_and_cited(toy, monkeypatch):
    monkeypatch.setattr(validate, "WALKS", 1000)
    entry = validate.validate_scene("scene", SCENE)
    assert tuple(entry.predicted) == ("smith", "vcavity", "toy", "smith-walk")
    assert {row.model for row in entry.comparisons} == {"smith", "smith-walk"}
    results = entry.measured, entry.predicted, entry.scene, 0.0
    for figure in (lobes, albedo_by_order):
        drawn = figure.figure(figure.rows(*results))
        labels = [text.get_text() for text in drawn.legends[0].get_texts()]
        assert any(label.startswith(toy.label) for label in labels)
    cited = citations.collect([entry])
    assert cited[-1] == PAPER
    assert "cook1982" in {reference.key for reference in cited}
    monkeypatch.delitem(model.MODELS, "toy")
    assert PAPER not in citations.collect([entry])


@dataclass(frozen=True)
class ToyTile:
    """What the toy engine meets: a plane, whatever the heights."""

    plane: exact.ExactTile
    engine: str = "toy-engine"
    layered: bool = False


def plane(*_):
    return ToyTile(exact.exact_tile(np.zeros((2, 2)), np.zeros((2, 2), np.bool_)))


TOY = replace(
    EXACT, tile_of=plane, plane=plane,
    trace=lambda tile, *args, **kwargs: exact.trace(tile.plane, *args, **kwargs),
)  # fmt: skip


@pytest.fixture
def toy_engine(monkeypatch):
    """An engine to which every surface is a plane, cited by the same paper."""
    entry = Engine("toy-engine", "toy", "takes all for a plane", (PAPER,), f"{__name__}:TOY")
    monkeypatch.setitem(ENGINES, "toy-engine", entry)
    return entry


def test_a_toy_engine_traces(toy_engine):
    for command in ("measure", "validate"):
        said = "".join(printed(command, "--help").split())
        assert f"{toy_engine.key}, which {toy_engine.what}".replace(" ", "") in said
    surface = ("--gamma", "8", "--sigma", "0.3", "--kd", "0", "--theta", "50", "--paths", "500")
    mesh = ("--cells", "32", "--correlation", "4", "--realisations", "2")
    found = json.loads(printed("measure", *surface, *mesh, "--engine", "toy-engine", "--json"))
    assert found["engine"] == "toy-engine"
    assert found["albedo"] == pytest.approx(float(reflectance(np.cos(np.radians(50)), 1.5)))


def test_a_toy_engine_is_validated_and_cited(toy_engine, monkeypatch):
    monkeypatch.setattr(validate, "WALKS", 1000)
    scene = replace(SCENE, accuracy=Accuracy(2000, engine=toy_engine.key))
    entry = validate.validate_scene("scene", scene)
    assert entry.measured.attrs["engine"] == toy_engine.key
    keys = {work.key for work in citations.collect([entry])}
    assert {PAPER.key, "wald2014"} <= keys  # its referee is Embree, which sees no plane
    assert [line.partition(":")[0] for line in entry.broken] == [referee.NAME]
    assert Scene.from_toml(scene.to_toml()) == scene


def test_an_engine_that_is_not_in_the_list_is_refused_in_one_line(toy_engine, monkeypatch):
    monkeypatch.delitem(ENGINES, toy_engine.key)
    with pytest.raises(InputError, match=r"must be auto, exact, embree$"):
        Accuracy(engine=toy_engine.key)
    with pytest.raises(InputError, match="this process knows exact, embree;"):
        tracer_of(toy_engine.key)


def read_toy(path, declared):
    """Numbers between blanks, in nanometres, two micrometres apart."""
    if declared.channel not in (None, "toys"):
        raise InputError(f"channel {declared.channel!r}: must be toys")
    return HeightMap(np.loadtxt(path), (2000.0, 2000.0), "nm", "toy 1.0", "toy", "toys", ("toys",))


def write_toy(h, path):
    np.savetxt(path, 1000 * h.heights)


@pytest.fixture
def toy_format(monkeypatch):
    """A format that is read as an instrument's, and written."""
    entry = Format(
        "toy", "numbers between blanks, which keep heights in nm", (".toy",), read_toy, write_toy,
        ("channel",), "toybox",
    )  # fmt: skip
    monkeypatch.setitem(FORMATS, "toy", entry)
    return entry


def test_a_toy_format_is_written_and_traced(toy_format, tmp_path):
    for command in ("measure", "surface"):
        said = "".join(printed(command, "--help").split())
        assert toy_format.label.replace(" ", "") in said
    file = tmp_path / "s.toy"
    made = ("--gamma", "8", "--sigma", "0.1", "--cells", "16", "--spacing", "2")
    printed("surface", *made, "--out", str(file))
    read = read_surface(file)
    assert read.pixel == (2.0, 2.0)
    assert read.provenance["reader"] == "toy 1.0"
    assert read.provenance["channel"] == "toys"
    traced = ("--surface", str(file), "--kd", "0", "--theta", "0", "--paths", "500", "--json")
    found = json.loads(printed("measure", *traced, "--channel", "toys"))
    assert 0 < found["albedo"] < 0.1
    with pytest.raises(InputError, match=r"s.toy: channel 'ducks': must be toys"):
        read_surface(file, channel="ducks")


def test_endings_that_are_refused_list_the_toys(toy_format, tmp_path, monkeypatch):
    path = tmp_path / "s.ducks"
    path.write_bytes(b"x")
    flat = Heightfield(np.zeros((2, 2)), 2.0, "periodic")
    for refused in (lambda: read_surface(path), lambda: write_surface(flat, path)):
        with pytest.raises(InputError, match=r"s.ducks: unknown ending.*\.toy"):
            refused()
    toys = tmp_path / "s.toy"
    toys.write_bytes(b"x")
    monkeypatch.setitem(FORMATS, "toy", replace(toy_format, read=missing, write=missing))
    for refused in (lambda: read_surface(toys), lambda: write_surface(flat, toys)):
        with pytest.raises(InputError, match=r"needs toys, which is not installed; .*'toybox'"):
            refused()


def missing(*_):
    raise ImportError(name="toys")
