"""A run that was stopped goes on where it was, to the same bits."""

import json
from dataclasses import replace

import numpy as np
import pytest
from killed_stages import KilledError, Mortal

from microsurf.analysis import stages, validate, validation, versions
from microsurf.analysis.stages import Run
from microsurf.errors import InputError, MicrosurfError
from microsurf.scene import Accuracy, Effects, Light, Material, Roughness, Scene, Surface

TINY = Scene(
    material=Material(1.5, (0.5,)),
    surface=Surface(cells=32, realisations=3),
    light=Light((30.0, 60.0)),
    accuracy=Accuracy(2000),
)
ONE_ANGLE = replace(TINY, light=Light((60.0,)))


pytestmark = pytest.mark.usefixtures("few_walks")


def figures(entry):
    """All of report.json but times."""
    found = json.loads(json.dumps(validation.as_json(entry), default=lambda value: value.tolist()))
    del found["seconds"], found["measured"]["tracing_seconds"], found["measured"]["embree_ratio"]
    return found


def validated(made, scene=TINY, refined=True):
    return validate.validate_scene("tiny", scene, seed=3, refined=refined, stages=made)


def test_a_scene_stopped_after_every_stage_ends_the_same(tmp_path):
    whole = validated(None, ONE_ANGLE)
    run = Run(tmp_path, resume=False)
    stops = 0
    while True:
        made = run.stages(scene="tiny")
        mortal = Mortal(made._folder, made._key)
        try:
            entry = validated(mortal, ONE_ANGLE)
            break
        except KilledError:
            stops += 1
            assert mortal.taken_up == stops - 1
    assert stops == len(list((tmp_path / stages.FOLDER).glob("*.npz"))) - 1 >= 8
    assert figures(entry) == figures(whole)
    assert entry.measured.equals(whole.measured)
    assert entry.heightfield.heights.tobytes() == whole.heightfield.heights.tobytes()
    again = validated(run.stages(scene="tiny"), ONE_ANGLE)
    assert figures(again) == figures(whole)
    assert again.seconds == entry.seconds
    assert repr(again.frontier.points) == repr(entry.frontier.points)


@pytest.mark.parametrize(
    "scene",
    [
        replace(TINY, roughness=Roughness(2.0, (0.0,))),
        replace(ONE_ANGLE, effects=Effects(multiple_scattering=False)),
        replace(
            ONE_ANGLE, roughness=Roughness(2.0, (0.3, 0.5)), material=Material(1.5, (0.2, 0.8))
        ),
    ],
)
def test_all_kinds_of_scenes_are_taken_up(tmp_path, scene, monkeypatch):
    run = Run(tmp_path, resume=False)
    whole = validated(run.stages(scene="tiny"), scene)
    for name in ("measure", "all_surfaces_of", "masking_by_slope", "refine"):
        monkeypatch.setattr(validate, name, lambda *_, **__: pytest.fail("done again"))
    assert figures(validated(run.stages(scene="tiny"), scene)) == figures(whole)


def test_stages_of_other_work_are_not_found(tmp_path, monkeypatch):
    run = Run(tmp_path, resume=False)
    run.stages(seed=1).done("a", lambda: 1)
    run.stages(seed=1).done("b", lambda: 2)
    assert run.stages(seed=1).done("a", lambda: 3) == 1
    assert run.stages(seed=2).done("a", lambda: 3) == 3
    monkeypatch.setattr(stages, "state_of_the_code", lambda: "another")
    assert run.stages(seed=1).done("a", lambda: 4) == 4


def test_without_resume_all_is_done_again(tmp_path):
    run = Run(tmp_path, resume=False)
    run.stages(seed=1).done("a", lambda: 1)
    with pytest.raises(InputError, match="another run is at work"):
        Run(tmp_path, resume=True)
    del run
    assert Run(tmp_path, resume=True).stages(seed=1).done("a", lambda: 2) == 1
    assert Run(tmp_path, resume=False).stages(seed=1).done("a", lambda: 3) == 3


def test_a_finished_run_leaves_nothing_of_its_own(tmp_path):
    run = Run(tmp_path, resume=False)
    run.stages(seed=1).done("a", lambda: 1)
    run.finish()
    run.finish()
    assert list(tmp_path.iterdir()) == []
    run = Run(tmp_path, resume=True)
    run.stages(seed=1).done("a", lambda: 1)
    (tmp_path / stages.FOLDER / "mine.txt").write_text("x")
    run.finish()
    assert [path.name for path in tmp_path.rglob("*.*")] == ["mine.txt"]
    run = Run(tmp_path, resume=True)
    made = run.stages(seed=1)
    made.done("a", lambda: 2)
    assert made.taken_up == 0


def test_a_folder_that_can_not_be_made(tmp_path):
    (tmp_path / stages.FOLDER).write_text("x")
    with pytest.raises(InputError, match="can't be a folder for finished stages"):
        Run(tmp_path, resume=True)


def test_a_full_disk_is_not_the_users_fault(tmp_path, monkeypatch):
    made = Run(tmp_path, resume=False).stages(seed=1)

    def full(*_):
        raise InputError("no room")

    monkeypatch.setattr(stages, "save", full)
    with pytest.raises(MicrosurfError, match="no room") as found:
        made.done("a", lambda: 1)
    assert not isinstance(found.value, InputError)


def test_the_state_of_the_code_knows_sources_and_versions(monkeypatch, tmp_path):
    versions.state_of_the_code.cache_clear()
    before = versions.state_of_the_code()
    versions.state_of_the_code.cache_clear()
    assert versions.state_of_the_code() == before
    (tmp_path / "a.py").write_text("x = 1")
    monkeypatch.setattr(versions, "PACKAGE", tmp_path)
    monkeypatch.setattr(versions, "_STARTED", np.inf)
    found = set()
    for text in ("x = 1", "x = 2"):
        (tmp_path / "a.py").write_text(text)
        versions.state_of_the_code.cache_clear()
        found.add(versions.state_of_the_code())
    monkeypatch.setattr(versions, "_COMPUTING", ())
    versions.state_of_the_code.cache_clear()
    found.add(versions.state_of_the_code())
    assert len(found | {before}) == 4
    monkeypatch.setattr(versions, "_STARTED", 0.0)  # newer than what was imported
    for _ in range(2):
        versions.state_of_the_code.cache_clear()
        found.add(versions.state_of_the_code())
    assert len(found) == 5
    monkeypatch.undo()
    versions.state_of_the_code.cache_clear()
