"""What checks microsurf is run once for each version and machine, and whatever is amiss again."""

import json
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
from click.testing import CliRunner

from microsurf.analysis import remembered, self_test, stored, versions
from microsurf.cli.group import cli
from microsurf.invariants import Invariant
from microsurf.stability.case import DomainPoint
from microsurf.stability.map import Stability, Summary
from microsurf.stability.sweep import Count

HOLDS = Invariant("furnace", "energy is kept", 0.5, 1.0, "|z|", {"seen": 0.1 + 0.2})
POINT = DomainPoint("F", "facet", {"n": 1.0}, 0.5, 0.5, 1.0, 15.0, 15.0, 15.0)


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("MICROSURF_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def runs(monkeypatch):
    """Make both checks cheap; gives the list of what was run."""
    found = []

    def invariants(seed, *_, **__):
        found.append(("invariants", seed))
        return [replace(HOLDS, value=seed / 4)]

    def digits(**_):
        found.append(("digits",))
        summary = Summary("F", "facet", 1, POINT, 12.0, 0, "")
        return Stability([POINT], [summary], [Count("F", 1, 0, 0, 0)], [], 0.5)

    monkeypatch.setattr(self_test, "global_invariants", invariants)
    monkeypatch.setattr(self_test, "survey", digits)
    return found


def test_the_second_run_remembers_the_first(cache, runs):
    first = self_test.self_test(1)
    assert runs == [("invariants", 1), ("digits",)]
    assert self_test.self_test(1) == first
    assert len(runs) == 2
    assert first.invariants == [replace(HOLDS, value=0.25)]
    assert len(list(cache.iterdir())) == 2  # no temporaries


def test_it_is_run_again_for_another_seed_and_when_asked(cache, runs):
    self_test.self_test(1, digits=False)
    assert self_test.self_test(2, digits=False).invariants[0].value == 0.5
    assert self_test.self_test(1, digits=False).stability is None
    assert runs == [("invariants", 1), ("invariants", 2)]
    self_test.self_test(1, digits=False, again=True)
    assert runs[2:] == [("invariants", 1)]
    assert cache.is_dir()


@pytest.mark.usefixtures("cache")
def test_what_is_broken_is_not_remembered(runs):
    for _ in range(2):
        assert self_test.self_test(8, digits=False).invariants[0].holds is False
    assert len(runs) == 2


@pytest.mark.usefixtures("cache")
def test_another_version_or_machine_is_checked_for_itself(runs, monkeypatch):
    self_test.self_test(1, digits=False)
    monkeypatch.setattr(remembered, "state_of_the_code", lambda **_: "another")
    self_test.self_test(1, digits=False)
    assert len(runs) == 2


def test_pages_and_commands_change_no_number(tmp_path, monkeypatch):
    """A source that computes makes another key; one that shows does not, and neither is empty."""
    for name in ("report/a.py", "trace/b.py"):
        path = tmp_path / name
        path.parent.mkdir()
        path.write_text("1")
    monkeypatch.setattr(versions, "PACKAGE", tmp_path)
    monkeypatch.setattr(versions, "_STARTED", 1e12)
    state = partial(versions.state_of_the_code.__wrapped__, without=("cli", "report"))
    before = state()
    (tmp_path / "report" / "a.py").write_text("2")
    assert state() == before
    (tmp_path / "trace" / "b.py").write_text("2")
    assert state() != before


@pytest.mark.parametrize("damage", ["empty", "cut", "flipped", "folder"])
def test_a_damaged_file_is_made_again(cache, runs, damage):
    self_test.self_test(1, digits=False)
    (file,) = cache.iterdir()
    data = file.read_bytes()
    if damage == "folder":
        file.unlink()
        file.mkdir()
    else:
        middle = len(data) // 2
        flipped = data[:middle] + bytes([data[middle] ^ 1]) + data[middle + 1 :]
        file.write_bytes({"empty": b"", "cut": data[:-20], "flipped": flipped}[damage])
    assert self_test.self_test(1, digits=False).invariants == [replace(HOLDS, value=0.25)]
    assert len(runs) == 2


@pytest.mark.parametrize("place", ["file/cache", "/proc/nowhere"])
def test_without_a_place_it_runs_and_says_nothing(tmp_path, runs, monkeypatch, place):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("MICROSURF_CACHE", str(tmp_path / place))
    for _ in range(2):
        assert self_test.self_test(1, digits=False).invariants
    assert len(runs) == 2


@pytest.mark.usefixtures("cache")
def test_a_full_disk_is_no_error(runs, monkeypatch):
    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(stored.np, "savez", full)
    assert self_test.self_test(1, digits=False).invariants
    assert runs == [("invariants", 1)]


@pytest.mark.parametrize(
    ("system", "variables", "expected"),
    [
        ("linux", {"XDG_CACHE_HOME": "/x"}, "/x/microsurf"),
        ("linux", {"HOME": "/h"}, "/h/.cache/microsurf"),
        ("darwin", {"HOME": "/h"}, "/h/Library/Caches/microsurf"),
        ("win32", {"LOCALAPPDATA": "/l"}, "/l/microsurf"),
    ],
)
def test_caches_are_where_the_system_has_them(monkeypatch, system, variables, expected):
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(remembered.sys, "platform", system)
    assert remembered._usual() == Path(expected)


@pytest.mark.usefixtures("cache", "undrawn", "few_walks")
def test_the_page_says_when_it_was_checked(tmp_path, runs):
    scene = tmp_path / "s.toml"
    scene.write_text("[roughness]\nsigma = 0\n[light]\ntheta = [60]\n[accuracy]\npaths = 2000\n")
    words = ["validate", str(scene), "--out", str(tmp_path / "r"), "--json", "--seed", "1"]
    pages = []
    for more in ((), (), ("--self-test",)):
        ran = CliRunner().invoke(cli, [*words, *more])
        assert ran.exit_code == 0, ran.output
        assert json.loads(ran.stdout)["broken"] == []
        pages.append((tmp_path / "r" / "report.html").read_text())
    date = self_test.self_test(1, digits=False).date
    assert all(f"Checked on {date} UTC" in page for page in pages[2:])
    assert all("Checked on 20" in page for page in pages)
    assert runs == [("invariants", 1), ("invariants", 1)]
