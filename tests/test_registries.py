"""One entry is enough: a toy model, reader and engine are seen everywhere, no file touched."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from microsurf import model
from microsurf.analysis import validate
from microsurf.cli.group import cli
from microsurf.model import Citation, Masking, Model
from microsurf.physics import smith
from microsurf.report import citations
from microsurf.report.figures import albedo_by_order, lobes
from microsurf.scene import Accuracy, Light, Material, Roughness, Scene, Surface

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
