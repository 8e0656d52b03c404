"""Trade-offs, advice and convergence that were stopped go on where they were, to the same bits."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner
from killed_stages import KilledError, Mortal

from microsurf.analysis import stages
from microsurf.analysis.convergence.steps import ConvergenceEffort
from microsurf.analysis.convergence.study import converge
from microsurf.analysis.stages import Run, Stages
from microsurf.analysis.tradeoff import methods, recommend, study
from microsurf.analysis.tradeoff.effort import TradeoffEffort
from microsurf.cli.group import cli
from microsurf.scene import Accuracy, Light, Material, Roughness, Scene, Surface

SCENE = Scene(
    roughness=Roughness(8.0, (0.3,)),
    material=Material(1.5, (0.0,)),
    surface=Surface(cells=32, correlation=4.0, realisations=2),
    light=Light((50.0,)),
    accuracy=Accuracy(1024),
)
EFFORT = TradeoffEffort(((1000, 4),), ((0.5, 500, 4),), 1, 1, 1000, 4, 8)
STEPS = ConvergenceEffort((0.5, 1, 2), 4, 3, 1000, 32, 4, 1024)


def traded(kept):
    """Draws and errors of a trade-off, not its times."""
    found = study.tradeoff(SCENE, EFFORT, seed=3, stages=kept)
    draws = [
        (run.method, place, of.albedo.tobytes(), of.specular.tobytes(), of.lobe.tobytes())
        for run in found.runs
        for place, of in run.draws.items()
    ]
    errors = {name: [p.squared for p in points] for name, points in found.points.items()}
    return draws, repr(errors), found.reference.half_width


def advised(kept):
    """Errors and verdicts of advice: which method is cheapest depends on times."""
    found = recommend.advise(SCENE, 1e-4, "albedo", EFFORT, seed=3, stages=kept)
    tried = {one.point.name: (one.error, one.verdict) for one in found.tried}
    return tried, found.effects, found.reference.half_width


def converged(kept):
    """All rows of a study of convergence."""
    found = converge(SCENE, STEPS, seed=3, workers=1, stages=kept)
    return repr({key: value for key, value in vars(found).items() if key != "seconds"})


@pytest.fixture(autouse=True)
def _no_slow_models(monkeypatch):
    monkeypatch.delitem(methods.model.MODELS, "vcavity")


@pytest.mark.parametrize("work", [traded, advised, converged])
def test_stopped_after_every_stage_it_ends_the_same(tmp_path, work):
    whole = work(None)
    run = Run(tmp_path, resume=False)
    stops = 0
    while True:
        made = run.stages(work=work.__name__)
        mortal = Mortal(made._folder, made._key)
        try:
            found = work(mortal)
            break
        except KilledError:
            stops += 1
            assert mortal.taken_up == stops - 1
    assert stops >= 3
    assert found == whole
    again = run.stages(work=work.__name__)
    assert work(again) == whole
    assert again.taken_up == stops + 1


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize(
    ("command", "efforts"),
    [
        (("tradeoff",), EFFORT),
        (("advise", "--tolerance", "0.5"), EFFORT),
        (("convergence",), STEPS),
    ],
)
def test_commands_go_on_and_clean_up(tmp_path, monkeypatch, command, efforts):
    for module in ("tradeoff", "advise", "convergence"):
        known = __import__(f"microsurf.cli.{module}", fromlist=["EFFORTS"])
        monkeypatch.setitem(known.EFFORTS, "quick", efforts)
    scene, out = tmp_path / "s.toml", tmp_path / "out"
    scene.write_text(SCENE.to_toml())
    words = [*command, str(scene), "--out", str(out), "--json"]
    made = []
    usual = Stages.done

    def stopped(self, name, make):
        if len(made) == 2:
            raise KeyboardInterrupt
        made.append(name)
        return usual(self, name, make)

    monkeypatch.setattr(Stages, "done", stopped)
    assert CliRunner().invoke(cli, words).exit_code != 0
    assert len(list((out / stages.FOLDER).glob("*.npz"))) == 2
    taken = []

    def counted(self, name, make):
        before = self.taken_up
        value = usual(self, name, make)
        taken.extend([name] * (self.taken_up - before))
        return value

    monkeypatch.setattr(Stages, "done", counted)
    ran = CliRunner().invoke(cli, [*words, "--resume"])
    assert ran.exit_code == 0, ran.output
    assert taken == made
    assert json.loads(ran.stdout)
    assert not Path(out, stages.FOLDER).exists()


def test_advice_without_a_folder_can_not_be_resumed(tmp_path):
    (tmp_path / "s.toml").write_text(SCENE.to_toml())
    words = ["advise", str(tmp_path / "s.toml"), "--tolerance", "0.5", "--resume"]
    ran = CliRunner().invoke(cli, words)
    assert ran.exit_code != 0
    assert "--out FOLDER" in str(ran.exception)
