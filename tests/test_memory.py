"""What a process may use: the least that the machine, its cgroups and its shell leave."""

import os
import subprocess
import sys
from types import SimpleNamespace

import pytest

from microsurf import memory

GIB = 2**30


@pytest.fixture
def machine(monkeypatch, tmp_path):
    """A machine of 64 GiB and 64 processors, whose control groups are written by hand."""

    def make(cgroup, **files):
        (tmp_path / "proc" / "self").mkdir(parents=True)
        (tmp_path / "proc" / "self" / "cgroup").write_text(cgroup)
        for name, text in files.items():
            path = tmp_path / "cgroup" / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)

    monkeypatch.setattr(memory, "_PROC", tmp_path / "proc")
    monkeypatch.setattr(memory, "_CGROUP", tmp_path / "cgroup")
    host = SimpleNamespace(available=64 * GIB)
    monkeypatch.setattr(memory.psutil, "virtual_memory", lambda: host)
    # Whatever `ulimit` the tests run under.
    monkeypatch.setattr(memory.psutil.Process, "rlimit", lambda *_: (-1, -1), raising=False)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(64)), raising=False)
    monkeypatch.setattr(memory.sys, "platform", "linux")
    return make


def stat(active, inactive):
    return f"anon 12345\nactive_file {active}\ninactive_file {inactive}\nworkingset_refault 0\n"


@pytest.mark.parametrize(
    ("cgroup", "files", "left", "cores"),
    [
        pytest.param("", {}, 64 * GIB, 64, id="none"),
        pytest.param("0::/\n", {}, 64 * GIB, 64, id="host"),
        pytest.param(
            "0::/\n",
            {"memory.max": f"{3 * GIB // 2}\n", "memory.current": f"{GIB}\n",
             "memory.stat": stat(GIB // 8, GIB // 8), "cpu.max": "150000 100000\n"},
            GIB * 0.75, 2, id="container of version 2",
        ),
        pytest.param(
            "0::/job/step\n",
            {"memory.max": "max\n", "job/memory.max": f"{8 * GIB}\n",
             "job/memory.current": f"{6 * GIB}\n", "job/step/memory.max": "max\n",
             "job/step/memory.current": f"{GIB}\n", "job/cpu.max": "400000 100000\n",
             "job/step/cpu.max": "max 100000\n"},
            2 * GIB, 4, id="the limit is further up",
        ),
        pytest.param(
            "0::/job\n",
            {"job/memory.max": f"{8 * GIB}\n", "job/memory.high": f"{4 * GIB}\n",
             "job/memory.current": f"{GIB}\n"},
            3 * GIB, 64, id="slowed down before it is killed",
        ),
        pytest.param(
            "5:memory:/docker/abc\n4:cpu,cpuacct:/docker/abc\n1:name=systemd:/docker/abc\n0::/\n",
            {"memory/memory.limit_in_bytes": f"{2 * GIB}\n",
             "memory/memory.usage_in_bytes": f"{GIB}\n",
             "memory/memory.stat": f"total_active_file 0\ntotal_inactive_file {GIB // 2}\n",
             "cpu,cpuacct/cpu.cfs_quota_us": "50000\n",
             "cpu,cpuacct/cpu.cfs_period_us": "100000\n"},
            GIB * 1.5, 1, id="container of version 1, its path is the host's",
        ),
        pytest.param(
            "5:memory:/a\n",
            {"memory/a/memory.limit_in_bytes": "9223372036854771712\n",
             "memory/a/memory.usage_in_bytes": f"{GIB}\n", "cpu/cpu.cfs_quota_us": "-1\n"},
            64 * GIB, 64, id="version 1 without a limit",
        ),
        pytest.param(
            "0::/\n", {"memory.max": f"{GIB}\n", "memory.current": f"{2 * GIB}\n"},
            0, 64, id="more is used than allowed",
        ),
        pytest.param(
            "0::/\n", {"memory.max": "?\n", "memory.current": "", "cpu.max": "\n"},
            64 * GIB, 64, id="nonsense",
        ),
    ],
)  # fmt: skip
def test_the_least_that_any_limit_leaves(machine, cgroup, files, left, cores):
    machine(cgroup, **files)
    assert memory.available() == left
    assert memory.cores() == cores


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="this system has no affinity")
def test_threads_are_as_many_as_the_affinity_allows():
    code = (
        "import os; os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})\n"
        "from microsurf import memory; print(memory.cores())"
    )
    ran = subprocess.run(  # noqa: S603 - our own
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=300, check=True
    )
    assert ran.stdout == "1\n"


@pytest.mark.skipif(sys.platform != "linux", reason="needs a limit of address space")
def test_a_shells_limit_of_memory_is_one_line():
    """As ``ulimit -v`` sets it; 6000² cells take 10 GiB."""
    code = (
        "import resource, sys; resource.setrlimit(resource.RLIMIT_AS, (6 * 2**30,) * 2)\n"
        "sys.argv = 'microsurf surface --gamma 2 --sigma .5 --cells 6000 --out s.npz'.split()\n"
        "from microsurf.cli.entry import main; main()"
    )
    ran = subprocess.run(  # noqa: S603 - our own
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=300, check=False
    )
    assert ran.returncode == 2, ran.stderr
    assert ran.stderr.count("\n") == 1
    assert "are free; take fewer cells" in ran.stderr
