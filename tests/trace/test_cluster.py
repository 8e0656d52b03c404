"""A real scheduler and two worker processes on loopback; one is killed in the middle."""

import json
import subprocess
import sys
import time
from pathlib import Path

import pytest

from microsurf.errors import InputError
from microsurf.results import datasets
from microsurf.scene import Accuracy, Light, Scene, Surface
from microsurf.surface import generate_surface
from microsurf.trace import cluster, measure

distributed = pytest.importorskip("distributed")

BIN = Path(sys.executable).parent
SCENE = Scene(
    surface=Surface(cells=64, realisations=30), light=Light((0.0, 60.0)), accuracy=Accuracy(20_000)
)
WORDS = ("--gamma", "2", "--sigma", "0.5", "--cells", "64", "--theta", "0,60", "--paths", "20000")


class Cluster:
    """Its processes, and its address."""

    def __init__(self, folder):
        self._folder, self.workers = folder, []
        file = folder / "scheduler.json"
        self._scheduler = self._start(
            "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard",
            "--scheduler-file", file,
        )  # fmt: skip
        end = time.monotonic() + 60
        while not file.exists() and time.monotonic() < end:
            time.sleep(0.05)
        time.sleep(0.2)  # it may be half written
        self.address = json.loads(file.read_text())["address"]

    def _start(self, *words):
        with (self._folder / f"{words[0]}.log").open("ab") as log:
            return subprocess.Popen(  # noqa: S603 - our own
                [BIN / "dask", *words], stdout=log, stderr=log, cwd=self._folder
            )

    def add_worker(self):
        """No nanny: who is killed stays dead."""
        self.workers.append(
            self._start("worker", self.address, "--nthreads", "1", "--no-nanny", "--no-dashboard")
        )

    def kill_worker(self):
        """End one as a machine ends it that loses power."""
        lost = self.workers.pop(0)
        lost.kill()
        lost.wait()

    def close(self):
        """End all."""
        for process in (*self.workers, self._scheduler):
            process.kill()
            process.wait()


@pytest.fixture(scope="module")
def two_workers(tmp_path_factory):
    made = Cluster(tmp_path_factory.mktemp("cluster"))
    try:
        made.add_worker()
        made.add_worker()
        with cluster.connected(made.address) as pool:
            end = time.monotonic() + 60
            client = pool.executor._client
            while len(client.nthreads()) < 2 and time.monotonic() < end:
                time.sleep(0.05)
        yield made
    finally:
        made.close()


def same(a, b):
    return a.drop_attrs().identical(b.drop_attrs())


def test_a_cluster_comes_to_the_same_bits_and_loses_nothing_with_a_worker(two_workers, tmp_path):
    """In Python, with surfaces that are sent along; then from the command line, one killed."""
    here = measure(SCENE, workers=1)
    made = [generate_surface(2.0, 0.5, cells=64, seed=s) for s in range(2)]
    with cluster.connected(two_workers.address) as pool:
        assert pool.workers == 2
        there = {"executor": pool.executor, "workers": pool.workers}
        assert same(measure(SCENE, made, **there), measure(SCENE, made, workers=1))
    out = tmp_path / "m.nc"
    words = [*WORDS, "--realisations", "30", "--scheduler", two_workers.address, "--out", out]
    with subprocess.Popen(  # noqa: S603 - our own
        [BIN / "microsurf", "measure", *words, "--json"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        parts = tmp_path / "m.nc.parts"
        while process.poll() is None and len(list(parts.glob("0*.npz"))) < 10:
            time.sleep(0.002)
        two_workers.kill_worker()
        printed, err = process.communicate(timeout=120)
    assert (process.returncode, err) == (0, "")
    assert json.loads(printed)["paths"] == float(here.paths.sum())
    assert same(datasets.load(out), here)
    two_workers.add_worker()


@pytest.mark.long
def test_a_scheduler_that_dies_leaves_what_is_finished(tmp_path):
    made = Cluster(tmp_path)
    try:
        made.add_worker()
        out = tmp_path / "m.nc"
        words = [*WORDS, "--realisations", "200", "--scheduler", made.address, "--out", out]
        with subprocess.Popen(  # noqa: S603 - our own
            [BIN / "microsurf", "measure", *words],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        ) as process:  # fmt: skip
            parts = tmp_path / "m.nc.parts"
            while process.poll() is None and len(list(parts.glob("0*.npz"))) < 10:
                time.sleep(0.002)
            made.close()
            _, err = process.communicate(timeout=120)
        assert process.returncode == 3
        assert err.count("\n") == 1
        assert "--resume" in err
        assert len(list(parts.glob("0*.npz"))) >= 10
    finally:
        made.close()


@pytest.mark.parametrize(
    "address",
    ["tcp://127.0.0.1:9", "foo", "tcp://", "tcp://127.0.0.1:x", "tcp://[:9", "tcp://x.invalid:1"],
)
def test_where_nobody_answers_one_line_says_so(address):
    begin = time.monotonic()
    with (
        pytest.raises(InputError, match="no scheduler answers") as refused,
        cluster.connected(address),
    ):
        pass
    assert "\n" not in str(refused.value)
    assert "dask scheduler" in str(refused.value)
    assert time.monotonic() - begin < 2 * cluster.WAIT


def test_other_software_on_a_worker_is_refused():
    here = cluster.versions()
    cluster._check_versions("a", {"w": here})
    for there in (("0.0", here[1]), (here[0], "1.0"), ModuleNotFoundError("no microsurf")):
        with pytest.raises(InputError, match="worker w does not have the same software"):
            cluster._check_versions("a", {"v": here, "w": there})


def test_without_dask_one_line_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with (
        pytest.raises(InputError, match=r'pip install "microsurf\[cluster\]"'),
        cluster.connected("tcp://127.0.0.1:9"),
    ):
        pass


def test_one_file_knows_dask():
    package = Path(cluster.__file__).parent
    knows = [p.name for p in package.rglob("*.py") if "import dask" in p.read_text("utf-8")
             or "from distributed" in p.read_text("utf-8")]  # fmt: skip
    assert knows == ["cluster.py"]
