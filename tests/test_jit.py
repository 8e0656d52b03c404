"""Compiled code is that of the sources that lie there, and no file on disk ends a run."""

import os
import shutil
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import forked
import pytest
from numba.core.dispatcher import Dispatcher

import microsurf
from microsurf import jit

PACKAGE = Path(microsurf.__file__).parent
KERNELS = sorted(
    path
    for folder in ("model", "trace")
    for path in (PACKAGE / folder).rglob("*.py")
    if "jit import" in path.read_text(encoding="utf-8")
)
OF_A_FACET = """
import numpy as np
from microsurf.model.random_walk import facet_kernels
from microsurf.model.random_walk.parameters import walk_facet
from microsurf.scene import Scene

facet = walk_facet(Scene(), 0.8)._replace(survival=0.0)
state = np.arange(1, 5, dtype=np.uint64)
# A substrate that keeps all light beyond the body events that are counted exactly.
ends = [facet_kernels.scatter(0, 0, -1.0, 0, 0, 1.0, 99, facet, state)[3] for _ in range(200)]
print(min(ends))
"""


FROM_HERE = """
import sys
import numba
sys.path[:0] = sys.argv[1:]
sys.dont_write_bytecode = True
numba.config.reload_config()
"""
"""What a fresh Python does with PYTHONPATH, PYTHONDONTWRITEBYTECODE and numba's variables."""


def python(folder, code, **environment):
    """Run code on the package that lies in a folder: what it prints, and its errors."""
    ran = forked.run(
        FROM_HERE + code, folder, modules=("warm_numba",), env=os.environ | environment, cwd=folder
    )
    assert ran.returncode == 0, ran.stderr
    return ran.stdout.strip(), ran.stderr


def test_a_constant_changed_in_another_file_changes_the_answer(tmp_path):
    shutil.copytree(PACKAGE, tmp_path / "microsurf", ignore=shutil.ignore_patterns("__pycache__"))
    assert python(tmp_path, OF_A_FACET) == ("-1", "")
    assert list(
        tmp_path.glob("microsurf/model/random_walk/__pycache__/facet_kernels.scatter-*.nbc")
    )
    result = tmp_path / "microsurf" / "results" / "detector.py"
    text = result.read_text(encoding="utf-8")
    result.write_text(f"{text}\nBODY_EXACT = 1000\n", encoding="utf-8")
    assert int(python(tmp_path, OF_A_FACET)[0]) == 99


@pytest.fixture
def small(tmp_path):
    """A package of one kernel: its constant in one file, a function it calls in another."""
    package = tmp_path / "microsurf"
    package.mkdir()
    for name in ("jit.py", "files.py", "errors.py"):
        shutil.copy(PACKAGE / name, package / name)
    for name, text in {
        "__init__.py": "",
        "unit.py": "UNIT = 1\n",
        "page.py": "TITLE = 'x'\n",
        "part/__init__.py": "from .called import called\n",
        "part/called.py": (
            "from ..jit import compiled\nfrom .. import unit\n\n"
            "@compiled\ndef called(x):\n    return x * unit.UNIT\n"
        ),
        "kernel.py": (
            "from .jit import compiled\nfrom .part import called\n\n"
            "@compiled\ndef kernel(x):\n    return called(x) + 0.5\n"
        ),
    }.items():
        (package / name).parent.mkdir(exist_ok=True)
        (package / name).write_text(text, encoding="utf-8")
    return tmp_path


def answer(folder, **environment):
    """What the kernel says, how often it was compiled, and what was said besides."""
    code = (
        "from microsurf.kernel import kernel\n"
        "print(kernel(2.0), sum(kernel.stats.cache_misses.values()))\n"
    )
    out, err = python(folder, code, **environment)
    value, compiled = out.split()
    return float(value), int(compiled), err


def kept(folder):
    return sorted((folder / "microsurf").rglob("*.nbc"))


def test_only_a_source_that_a_kernel_can_see_compiles_it_again(small):
    assert answer(small) == (2.5, 1, "")
    assert answer(small) == (2.5, 0, "")
    (small / "microsurf" / "page.py").write_text("TITLE = 'y'\n", encoding="utf-8")
    assert answer(small) == (2.5, 0, "")
    (small / "microsurf" / "unit.py").write_text("UNIT = 3\n", encoding="utf-8")
    files = kept(small)
    assert answer(small) == (6.5, 1, "")
    assert answer(small) == (6.5, 0, "")
    assert kept(small) == files  # what is stale is overwritten, it does not pile up
    # Same length, same time: neither tells that it is another source.
    unit = small / "microsurf" / "unit.py"
    times = unit.stat().st_mtime_ns
    unit.write_text("UNIT = 4\n", encoding="utf-8")
    os.utime(unit, ns=(times, times))
    assert answer(small) == (8.5, 1, "")


AT_ONCE = """
import os, sys, time
from microsurf.kernel import kernel
from numba.core import event

class Slow(event.Listener):  # the other process comes while this one compiles
    def on_start(self, event):
        time.sleep(2)

    def on_end(self, event):
        pass

event.register("numba:compile", Slow())
open(sys.argv[1], "w").close()
while len([name for name in os.listdir(".") if name.endswith(".begun")]) < 2:
    time.sleep(0.01)
kernel(2.0)
print(sum(kernel.stats.cache_misses.values()), sum(kernel.stats.cache_hits.values()))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="without locks of files' parts")
def test_processes_that_need_a_kernel_at_once_compile_it_once(small):
    children = [
        subprocess.Popen(  # noqa: S603 - our own
            [sys.executable, "-c", AT_ONCE, f"{k}.begun"], cwd=small,
            env=os.environ | {"PYTHONPATH": str(small)}, stdout=subprocess.PIPE, text=True,
        )
        for k in range(2)
    ]  # fmt: skip
    counts = sorted(child.communicate(timeout=300)[0].split() for child in children)
    # One compiled, and the other read; without locks each compiles.
    assert counts == [["0", "1"], ["1", "0"]]


@pytest.mark.parametrize("harm", ["cut", "empty", "text", "bit", "folder"])
def test_a_damaged_file_is_made_anew(small, harm):
    answer(small)
    files = kept(small)
    assert len(files) == 2
    for path in files:
        data = bytearray(path.read_bytes())
        if harm == "bit":
            data[-len(data) // 3] ^= 1
        path.write_bytes({"cut": data[:-100], "bit": data, "text": b"no code"}.get(harm, b""))
        if harm == "folder":
            path.unlink()
            path.mkdir()
    found = answer(small)
    assert found[:2] == (2.5, 1)
    if harm == "folder":  # can't be removed by writing: said, and gone on
        assert "is not kept" in found[2]
        assert found[2].count("\n") == 1
    else:
        assert found[2] == ""
        assert answer(small) == (2.5, 0, "")


def test_nowhere_to_write_is_one_line_and_no_error(small):
    """As root permissions do not hold: a file lies where the folder would be."""
    for folder in ("", "part"):
        (small / "microsurf" / folder / "__pycache__").write_text("")
    home = small / "home"
    home.write_text("")
    where = {"HOME": str(home), "XDG_CACHE_HOME": str(home), "LOCALAPPDATA": str(home)}
    assert python(small, "import microsurf.kernel", **where) == ("", "")
    value, compiled, err = answer(small, **where)
    assert (value, compiled) == (2.5, 1)
    assert err.count("\n") == 1
    assert "is not kept" in err
    assert "NUMBA_CACHE_DIR" in err
    other = small / "other"
    assert answer(small, **where, NUMBA_CACHE_DIR=str(other)) == (2.5, 1, "")
    assert answer(small, **where, NUMBA_CACHE_DIR=str(other)) == (2.5, 0, "")
    shutil.rmtree(other)
    other.write_text("")
    assert answer(small, **where, NUMBA_CACHE_DIR=str(other))[0] == 2.5


def test_a_source_changed_while_a_run_began_is_not_taken_for_what_was_imported(small):
    unit = small / "microsurf" / "unit.py"
    code = (
        "from pathlib import Path\nfrom microsurf.kernel import kernel\n"
        f"path = Path({str(unit)!r})\npath.write_text('UNIT = 7\\n')\nprint(kernel(2.0))\n"
    )
    out, err = python(small, code)
    assert out == "2.5"
    assert "newer than this run" in err
    assert answer(small) == (14.5, 1, "")


def test_without_compilation_kernels_are_functions(small):
    code = "from microsurf.kernel import kernel\nprint(kernel(2.0))\n"
    assert python(small, code, NUMBA_DISABLE_JIT="1") == ("2.5", "")


@pytest.mark.parametrize("path", KERNELS, ids=lambda p: p.stem)
def test_what_a_kernel_freezes_comes_from_a_source_it_is_keyed_on(path):
    """Independent of how imports are read: by what its functions find when they are compiled."""
    name = ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts)
    module = import_module(name)
    sources = jit.sources_of(path)
    kernels = [value for value in vars(module).values() if isinstance(value, Dispatcher)]
    assert kernels
    for kernel in kernels:
        assert isinstance(kernel._cache, jit.KernelCache | jit._Nowhere)  # a home is not asked for
        for used in kernel.py_func.__code__.co_names:
            value = vars(module).get(used)
            owner = (
                value.__name__ if hasattr(value, "__file__") else getattr(value, "__module__", "")
            )
            if isinstance(owner, str) and owner.startswith("microsurf"):
                assert Path(sys.modules[owner].__file__) in sources, f"{kernel}: {used}"
