import errno
import os
import stat
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from microsurf.errors import InputError, MicrosurfError
from microsurf.files import check_readable, check_writable, read_once, whole_file


def test_a_whole_file_takes_its_name_at_the_end(tmp_path):
    path = tmp_path / "a.txt"
    with whole_file(path) as temporary:
        assert temporary.suffix == ".txt"
        assert temporary.parent == tmp_path
        temporary.write_text("new")
        assert not path.exists()
    assert path.read_text() == "new"
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]


def test_its_rights_are_those_of_any_new_file(tmp_path):
    mask = os.umask(0o027)
    try:
        with whole_file(tmp_path / "a"):
            pass
    finally:
        os.umask(mask)
    assert stat.S_IMODE((tmp_path / "a").stat().st_mode) == 0o640


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, OSError])
def test_a_block_that_fails_leaves_what_was_there(tmp_path, error):
    path = tmp_path / "a.txt"
    path.write_text("old")
    expected = MicrosurfError if error is OSError else error

    def fail():
        with whole_file(path) as temporary:
            temporary.write_text("half")
            raise error

    with pytest.raises(expected):
        fail()
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]


def test_a_disk_error_is_not_bad_input(tmp_path):
    with pytest.raises(MicrosurfError) as failure, whole_file(tmp_path / "a"):
        raise OSError(28, "No space left on device")
    assert failure.value.exit_code == 3
    assert "No space left on device" in str(failure.value)


def test_what_can_not_be_written_is_bad_input(tmp_path):
    (tmp_path / "file").touch()
    (tmp_path / "folder").mkdir()
    for path, why in (
        (tmp_path / "folder", "is a folder"),
        (tmp_path / "missing" / "a", "does not exist"),
        (tmp_path / "file" / "a", "does not exist"),
        (tmp_path / ("x" * 300), "can't be written"),
    ):
        with pytest.raises(InputError, match=why):
            check_writable(path)
    check_writable(tmp_path / "new")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "folder"]


def test_what_can_not_be_read_is_bad_input(tmp_path):
    for path, why in (
        (tmp_path, "is a folder"),
        (tmp_path / "missing", "no such file"),
        (tmp_path / ("x" * 300), "can't be read"),
    ):
        with pytest.raises(InputError, match=f"{why}.*; do this"):
            check_readable(path, "do this")
    (tmp_path / "file").touch()
    check_readable(tmp_path / "file", "do this")


def fsync_of_windows(handle):
    """Refuses what was opened for reading only."""
    fcntl = pytest.importorskip("fcntl")
    if fcntl.fcntl(handle, fcntl.F_GETFL) & os.O_ACCMODE == os.O_RDONLY:
        raise OSError(errno.EBADF, "Bad file descriptor")


def refuse(code):
    def refused(*_, **__):
        raise OSError(code, os.strerror(code))

    return refused


@pytest.mark.parametrize("what", ["windows", "no sync", "no rights"])
def test_what_other_systems_refuse_does_not_end_a_write(tmp_path, monkeypatch, what):
    """Windows syncs only what may be written, FUSE often nothing; CIFS refuses chmod."""
    if what == "no rights":
        monkeypatch.setattr(Path, "chmod", refuse(errno.EPERM))
        monkeypatch.setattr(os, "chmod", refuse(errno.EPERM))
        monkeypatch.setattr(os, "fchmod", refuse(errno.EPERM), raising=False)
    else:
        fsync = fsync_of_windows if what == "windows" else refuse(errno.EINVAL)
        monkeypatch.setattr(os, "fsync", fsync)
    path = tmp_path / "a.txt"
    with whole_file(path) as temporary:
        temporary.write_text("new")
    assert path.read_text() == "new"
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]


@pytest.mark.parametrize("code", [errno.EIO, errno.ENOSPC, errno.EDQUOT])
def test_a_sync_that_fails_is_told(tmp_path, monkeypatch, code):
    monkeypatch.setattr(os, "fsync", refuse(code))
    with pytest.raises(MicrosurfError, match="could not be written"), whole_file(tmp_path / "a"):
        pass
    assert list(tmp_path.iterdir()) == []


def test_what_can_not_be_cleaned_up_does_not_hide_the_error(tmp_path, monkeypatch):
    """On Windows a writer that failed may leave its file open."""

    def fail():
        with whole_file(tmp_path / "a"):
            monkeypatch.setattr(Path, "unlink", refuse(errno.EACCES))
            raise ValueError("the reason")

    with pytest.raises(ValueError, match="the reason"):
        fail()


def test_the_umask_is_never_touched(tmp_path, monkeypatch):
    """It is the whole process's: for a moment other threads' files would be open to all."""
    monkeypatch.setattr(os, "umask", lambda _: pytest.fail("umask was set"))
    with whole_file(tmp_path / "a"):
        pass


def test_a_link_stays_a_link_and_its_target_is_written_whole_or_not_at_all(tmp_path):
    (tmp_path / "elsewhere").mkdir()
    target, link = tmp_path / "elsewhere" / "b", tmp_path / "a.txt"
    link.symlink_to(Path("elsewhere") / "b")
    with whole_file(link) as temporary:  # nothing there yet
        assert temporary.parent == target.parent
        assert temporary.suffix == ".txt"
        temporary.write_text("new")
    assert link.is_symlink()
    assert not target.is_symlink()
    assert target.read_text() == "new"

    def fail():
        with whole_file(link) as temporary:
            temporary.write_text("half")
            raise ValueError("stop")

    with pytest.raises(ValueError, match="stop"):
        fail()
    assert target.read_text() == "new"
    assert [p.name for p in target.parent.iterdir()] == ["b"]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.txt", "elsewhere"]


def test_links_that_lead_nowhere_and_devices_are_not_replaced(tmp_path):
    for name, target, why in (
        ("loop", "loop", "is a link to itself"),
        ("away", "missing/a", "the folder .*missing does not exist"),
        ("null", os.devnull, "is a pipe or a device"),
        ("folder", tmp_path, "is a folder"),
    ):
        (tmp_path / name).symlink_to(target)
        with pytest.raises(InputError, match=why):
            check_writable(tmp_path / name)
        with pytest.raises(InputError, match=why), whole_file(tmp_path / name):
            pass
        assert (tmp_path / name).is_symlink()
    assert stat.S_ISCHR(Path(os.devnull).stat().st_mode)


def test_a_pipe_is_read_once_and_a_file_no_further_than_asked(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(InputError, match="is a pipe or a device; save it"):
        check_readable(pipe, "do this")
    with ThreadPoolExecutor() as pool:
        pool.submit(pipe.write_bytes, b"text")
        assert read_once(pipe, "do this", 4) == b"text"
    path = tmp_path / "file"
    path.write_bytes(b"texts")
    for wrong, why in (
        (path, "too large, more than 4"),
        (tmp_path, "is a folder"),
        (tmp_path / "missing", "no such file"),
    ):
        with pytest.raises(InputError, match=f"{why}.*; do this"):
            read_once(wrong, "do this", 4)
