"""Finished work items: whole, of this run, few, and never believed without proof."""

import errno
import os
import shutil
from dataclasses import fields, replace

import numpy as np
import psutil
import pytest
from small import PATHS_PER_ITEM, many_items, same, scene

from microsurf.errors import InputError, MicrosurfError
from microsurf.scene import Accuracy
from microsurf.trace import checkpoint, measure, work_items
from microsurf.trace.checkpoint import Checkpoint
from microsurf.trace.scheduler import Scheduler


def an_item(asked=None):
    return next(Scheduler(asked or scene(), None, 0, turn=True).wanted())


@pytest.fixture
def stopped(monkeypatch, tmp_path):
    """Folder of a run that was interrupted at its twelfth work item."""
    many_items(monkeypatch)
    taken, take = [], Scheduler.take

    def interrupted(self, item, *rest):
        taken.append(item)
        if len(taken) == 12:
            raise KeyboardInterrupt
        take(self, item, *rest)

    with monkeypatch.context() as patch:
        patch.setattr(Scheduler, "take", interrupted)
        with pytest.raises(KeyboardInterrupt):
            measure(scene(), workers=1, checkpoint=tmp_path / "parts")
    return tmp_path / "parts"


def test_what_is_written_is_read(tmp_path):
    item = replace(an_item(), paths=PATHS_PER_ITEM)
    tally = work_items.run(item)
    saved = Checkpoint(tmp_path / "k", scene(), None, 0, resume=False)
    saved.save(item, tally)
    count, found = saved.load(item)
    assert count == 1
    for field in fields(tally):
        here, there = getattr(tally, field.name), getattr(found, field.name)
        assert here.dtype == there.dtype
        np.testing.assert_array_equal(here, there)
    assert saved.load(replace(item, number=1)) is None
    saved.close()


@pytest.mark.parametrize("harm", ["cut", "empty", "text", "swapped", "foreign", "nan", "bits"])
def test_a_piece_that_is_not_whole_and_ours_is_traced_again(stopped, harm):
    found = sorted(stopped.glob("0*.npz"))
    assert len(found) >= 4
    path, other = found[-2:]
    if harm == "cut":
        path.write_bytes(path.read_bytes()[:-100])
    elif harm == "empty":
        path.write_bytes(b"")
    elif harm == "text":
        path.write_text("no work item")
    elif harm == "swapped":
        shutil.copy(other, path)
    elif harm == "foreign":
        np.savez(path, heights=np.ones((3, 3)))
    else:
        with np.load(path) as item:
            arrays = dict(item)
        arrays["energy"][0] = np.nan if harm == "nan" else arrays["energy"][0] * 2
        if harm == "nan":
            arrays["energy shape"] = np.array([1, 1])
        np.savez(path, **arrays)
    resumed = measure(scene(), workers=1, checkpoint=stopped, resume=True)
    assert same(resumed, measure(scene(), workers=1))


def test_what_is_whole_and_ours_is_not_traced_again(stopped, monkeypatch):
    done = []
    run = work_items.run
    monkeypatch.setattr(work_items, "run", lambda item: (done.append(item), run(item))[1])
    measure(scene(), workers=1, checkpoint=stopped, resume=True)
    assert 30 - 14 <= len(done) <= 30 - 11  # depth 2 may have finished


@pytest.mark.parametrize(
    ("what", "names"),
    [
        ("scene", "another run"),
        ("seed", "another run"),
        ("no --resume", "add --resume"),
        ("note", "another run"),
        ("stranger", "holds letter.txt"),
        ("file", "can't be a folder"),
        ("at work", "another run is at work"),
    ],
)
def test_what_can_not_be_gone_on_with_is_refused(stopped, what, names):
    asked, seed, resume = scene(), 0, what != "no --resume"
    other = None
    if what == "scene":
        asked = scene(kd=0.5)
    elif what == "seed":
        seed = 1
    elif what == "note":
        (stopped / "run.json").write_text("[" * 100_000)
    elif what == "stranger":
        (stopped / "letter.txt").touch()
    elif what == "file":
        shutil.rmtree(stopped)
        stopped.touch()
    elif what == "at work":
        other = Checkpoint(stopped, asked, None, 0, resume=True)
    before = sorted(stopped.glob("*"))
    with pytest.raises(InputError, match=names) as refused:
        measure(asked, seed=seed, workers=1, checkpoint=stopped, resume=resume)
    assert "\n" not in str(refused.value)
    assert sorted(stopped.glob("*")) == before
    if other:
        other.close()


def test_a_run_killed_before_its_first_piece_leaves_nothing_to_resume(tmp_path, monkeypatch):
    many_items(monkeypatch)
    folder = tmp_path / "parts"
    folder.mkdir()
    (folder / "lock").touch()
    (folder / ".abc.json").write_text("{")
    measure(scene(), workers=1, checkpoint=folder)


def test_no_pieces_no_folder(tmp_path, monkeypatch):
    monkeypatch.setattr(work_items, "run", lambda _: (_ for _ in ()).throw(ValueError("no")))
    with pytest.raises(MicrosurfError, match=r"failed \(ValueError: no\)"):
        measure(scene(), workers=1, checkpoint=tmp_path / "parts")
    assert not (tmp_path / "parts").exists()


def test_files_stay_few(tmp_path, monkeypatch):
    """One file a finished stream; in others TOGETHER and those under way."""
    many_items(monkeypatch)
    monkeypatch.setattr(checkpoint, "TOGETHER", 4)
    asked = replace(scene(realisations=2), accuracy=Accuracy(30 * PATHS_PER_ITEM))
    most, save = [], Checkpoint.save

    def counted(self, *rest):
        save(self, *rest)
        most.append(len(list(tmp_path.glob("parts/0*.npz"))))

    monkeypatch.setattr(Checkpoint, "save", counted)
    measured = measure(asked, workers=2, checkpoint=tmp_path / "parts")
    assert len(most) == 120
    assert max(most) <= 4 * (1 + 4) + 4
    left = sorted(tmp_path.glob("parts/0*.npz"))
    assert [path.name[:11] for path in left] == [f"0000{r}-0000{a}" for r in (0, 1) for a in (0, 1)]
    # All there is to do is to read them.
    monkeypatch.setattr(work_items, "run", lambda _: pytest.fail("traced again"))
    assert same(measure(asked, workers=1, checkpoint=tmp_path / "parts", resume=True), measured)
    checkpoint.clear(tmp_path / "parts")
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_keeps_what_is_finished(tmp_path, monkeypatch):
    many_items(monkeypatch)
    write, written = Checkpoint._write, []

    def full(self, path, *rest):
        written.append(path)
        if len(written) > 7:
            raise MicrosurfError(f"{path}: could not be written (No space left on device)")
        write(self, path, *rest)

    with monkeypatch.context() as patch:
        patch.setattr(Checkpoint, "_write", full)
        with pytest.raises(MicrosurfError, match="No space") as error:
            measure(scene(), workers=2, checkpoint=tmp_path / "parts")
    assert error.value.exit_code == 3
    assert len(list(tmp_path.glob("parts/0*.npz"))) >= 3
    resumed = measure(scene(), workers=2, checkpoint=tmp_path / "parts", resume=True)
    assert same(resumed, measure(scene(), workers=1))


def test_a_folder_that_vanishes_is_one_line(tmp_path, monkeypatch):
    many_items(monkeypatch)
    save = Checkpoint.save

    def gone(self, *rest):
        shutil.rmtree(tmp_path / "parts")
        save(self, *rest)

    monkeypatch.setattr(Checkpoint, "save", gone)
    with pytest.raises(MicrosurfError) as error:
        measure(scene(), workers=1, checkpoint=tmp_path / "parts")
    assert error.value.exit_code == 3


@pytest.mark.parametrize("code", [errno.ENOSYS, errno.ENOLCK, errno.EOPNOTSUPP])
def test_without_locks_a_run_goes_on_with_one_line(tmp_path, monkeypatch, caplog, code):
    """As on Lustre and NFS. What a killed run leaves behind bars nobody."""
    fcntl = pytest.importorskip("fcntl")

    def no_locks(*_):
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr(fcntl, "flock", no_locks)
    many_items(monkeypatch)
    measured = measure(scene(), workers=1, checkpoint=tmp_path / "parts")
    (said,) = caplog.messages
    assert "has no locks" in said
    assert "\n" not in said
    assert same(measure(scene(), workers=1, checkpoint=tmp_path / "parts", resume=True), measured)


def test_a_folder_is_removed_only_once_nothing_in_it_is_open(tmp_path, monkeypatch):
    """Windows refuses to remove an open file."""
    remove, opened = shutil.rmtree, []

    def watched(path):
        opened.extend(f.path for f in psutil.Process().open_files() if str(path) in f.path)
        remove(path)

    monkeypatch.setattr(shutil, "rmtree", watched)
    monkeypatch.setattr(work_items, "run", lambda _: (_ for _ in ()).throw(ValueError("no")))
    with pytest.raises(MicrosurfError, match=r"failed \(ValueError: no\)"):
        measure(scene(), workers=1, checkpoint=tmp_path / "parts")
    assert not (tmp_path / "parts").exists()
    assert opened == []
