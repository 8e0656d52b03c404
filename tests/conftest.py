"""What all tests share."""

import os

import mpmath
import pytest
from hypothesis import settings

# As the command line has it: matrices are small, and two threads wait for each other's core.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read where numpy is loaded, as `judge` does
import quick
from judge import KEY, Ledger, fresh, judge, new_seed, verdict

__all__ = ["judge", "new_seed"]  # fixtures

# As the command line has it: matplotlib refuses to be imported with a notebook's backend, or
# with a matplotlibrc that is not in UTF-8.
os.environ.pop("MPLBACKEND", None)
os.environ["MATPLOTLIBRC"] = os.devnull
# A test's children write as it reads them.
os.environ.pop("PYTHONIOENCODING", None)

# The machine is busy: how long one example takes says nothing about the law.
settings.register_profile("microsurf", deadline=None)
settings.load_profile("microsurf")


def pytest_addoption(parser):
    parser.addoption(
        "--fresh-seed", nargs="?", const="1", default=os.environ.get("MICROSURF_FRESH_SEED", ""),
        help="new seeds for tests with a false-alarm rate, or those of a number again",
    )  # fmt: skip


def pytest_configure(config):
    # With pytest-xdist each worker has a ledger, with the seeds of the run it belongs to.
    own = getattr(config, "workerinput", None)
    seeds = fresh(config.getoption("--fresh-seed")) if own is None else own["seeds"]
    config.stash[KEY] = Ledger(seeds)


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node):
    node.workerinput["seeds"] = node.config.stash[KEY].offset


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node):
    node.config.stash[KEY].add(getattr(node, "workeroutput", {}).get("spent", {}))


def pytest_sessionfinish(session, exitstatus):
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["spent"] = session.config.stash[KEY].spent
    _, kept = verdict(session.config.stash[KEY])
    if not kept and exitstatus == pytest.ExitCode.OK:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter, config):
    if config.stash[KEY].spent:
        terminalreporter.write_line(verdict(config.stash[KEY])[0])


@pytest.fixture(autouse=True)
def _own_cache(tmp_path_factory, monkeypatch):
    """What microsurf remembers is that of this run of the tests, in its children too."""
    monkeypatch.setenv("MICROSURF_CACHE", str(tmp_path_factory.getbasetemp() / "cache"))


@pytest.fixture
def undrawn(monkeypatch):
    quick.without_figures(monkeypatch)


@pytest.fixture(scope="module")
def few_walks():
    with pytest.MonkeyPatch.context() as patch:
        quick.with_few_walks(patch)
        yield


@pytest.fixture(autouse=True)
def _sixty_digits():
    """mpmath's precision is global: what one test sets must not reach the next."""
    with mpmath.workdps(60):
        yield
