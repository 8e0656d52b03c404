"""`measure` and `validate` killed, interrupted, or out of room: resumed, the same bits come."""

import json
import os
import random
import signal
import time

import forked
import pytest
import xarray as xr
from children import start, timeless
from click.testing import CliRunner

from microsurf.cli.group import cli
from microsurf.results import datasets

SURFACE = ("--gamma", "2", "--sigma", "0.5", "--cells", "64", "--theta", "0,20,40,60")


def command(paths, realisations, out, *more):
    asked = ("--paths", str(paths), "--realisations", str(realisations))
    return ["measure", *SURFACE, *asked, "--out", out, *more]


def finished(*words):
    """Standard output of a run that succeeds."""
    with start(*words) as process:
        out, err = process.communicate(timeout=120)
    assert process.returncode == 0, err
    return out


def done_here(*words):
    """Standard output of a run that succeeds in this process, which has its imports behind it."""
    ran = CliRunner().invoke(cli, list(map(str, words)), catch_exceptions=False)
    assert ran.exit_code == 0, ran.output
    return ran.stdout


def pieces(out):
    return sorted(out.with_name(f"{out.name}.parts").glob("0*.npz"))


def wait_for_pieces(process, out, count):
    while process.poll() is None and len(pieces(out)) < count:
        time.sleep(0.002)


def assert_same(out, unbroken):
    xr.testing.assert_equal(datasets.load(out), datasets.load(unbroken))
    assert not out.with_name(f"{out.name}.parts").exists()


def test_killed_and_resumed_has_the_same_bits(tmp_path):
    out, unbroken = tmp_path / "m.nc", tmp_path / "unbroken.nc"
    words = command(20_000, 12, out)
    with start(*words) as process:
        wait_for_pieces(process, out, 4)
        process.kill()
    assert not out.exists()
    assert len(pieces(out)) >= 4
    with start(*words) as process:  # says what to do
        _, err = process.communicate(timeout=60)
    assert process.returncode == 2
    assert err.count("\n") == 1
    assert "add --resume" in err
    found = json.loads(done_here(*words, "--resume", "--json"))
    assert found["file"] == str(out)
    done_here(*command(20_000, 12, unbroken))
    assert_same(out, unbroken)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["m.nc", "unbroken.nc"]


@pytest.mark.long
def test_killed_at_random_moments_of_run_and_resumption(tmp_path):
    """Ten times each, over all of a run: while it loads, traces, writes, or when it is through."""
    rng = random.Random(4)  # noqa: S311 - moments
    unbroken = tmp_path / "unbroken.nc"
    finished(*command(100_000, 6, unbroken))
    begin = time.monotonic()
    finished(*command(100_000, 6, unbroken))
    duration = time.monotonic() - begin
    landed = []
    for k in range(10):
        out = tmp_path / f"{k}.nc"
        words = command(100_000, 6, out)
        for more in ((), ("--resume",)):
            with start(*words, *more) as process:
                time.sleep(rng.uniform(0.2, 1.05) * duration)
                process.kill()
            landed.append(len(pieces(out)))
        finished(*words, "--resume")
        assert_same(out, unbroken)
    assert max(landed) > 0  # some came in the middle


@pytest.mark.long
def test_validate_killed_ten_times_in_a_row_has_the_same_report(tmp_path):
    """At random moments of a run, each after the last: the report is that of an unbroken one."""
    rng = random.Random(5)  # noqa: S311 - moments
    scene = tmp_path / "scene.toml"
    scene.write_text("[surface]\ncells = 128\nrealisations = 2\n[light]\ntheta = [0, 60]\n")
    words = ["validate", scene, "--seed", "3", "--paths", "100000", "--out"]
    finished(*words, tmp_path / "unbroken")
    begin = time.monotonic()
    finished(*words, tmp_path / "unbroken")
    duration = time.monotonic() - begin
    killed = []
    for _ in range(10):
        more = ["--resume"] if (tmp_path / "killed" / "unfinished").exists() else []
        with start(*words, tmp_path / "killed", *more) as process:
            time.sleep(rng.uniform(0.2, 0.95) * duration)
            killed.append(process.poll() is None)
            process.kill()
    finished(*words, tmp_path / "killed", "--resume")
    assert sum(killed) > 0
    first, second = (timeless(tmp_path / name / "report.json") for name in ("unbroken", "killed"))
    assert first == second


def test_interrupted_keeps_its_pieces(tmp_path):
    out = tmp_path / "m.nc"
    with start(*command(100_000, 100, out)) as process:
        wait_for_pieces(process, out, 4)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (130, "microsurf: interrupted\n")
    assert len(pieces(out)) >= 4
    assert not out.exists()


def test_no_room_for_the_result_keeps_its_pieces(tmp_path):
    """The process may write no more than 1 MB a file: work items have room, the whole has not."""
    out = tmp_path / "m.nc"
    words = command(20_000, 2, out)
    limit = (
        "import resource\n_, most = resource.getrlimit(resource.RLIMIT_FSIZE)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (1_000_000, most))\n"
    )
    ran = forked.run(limit + forked.MAIN, *words)
    assert ran.returncode == 3
    assert ran.stderr.count("\n") == 1
    assert "could not be written" in ran.stderr
    assert len(pieces(out)) == 8
    assert [path.name for path in tmp_path.iterdir()] == ["m.nc.parts"]
    done_here(*words, "--resume")
    unbroken = tmp_path / "unbroken.nc"
    done_here(*command(20_000, 2, unbroken))
    assert_same(out, unbroken)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_without_permission_is_refused(tmp_path):
    folder = tmp_path / "locked"
    folder.mkdir(mode=0o500)
    with start(*command(20_000, 2, folder / "m.nc")) as process:
        _, err = process.communicate(timeout=60)
    assert process.returncode == 2
    assert "can't be written" in err
