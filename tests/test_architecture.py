"""The house rules that can be read off the imports."""

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parent.parent / "microsurf"
MODULES = sorted(PACKAGE.rglob("*.py"))


def imports(path):
    """Names a file imports: ours as 'physics', 'trace.paths' …, others by their first word."""
    own, foreign = set(), set()
    here = path.relative_to(PACKAGE).parent.parts
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level:
            base = here[: len(here) - node.level + 1]
            stem = [*base, *(node.module.split(".") if node.module else [])]
            own |= {".".join([*stem, alias.name]) for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            foreign.add(node.module.split(".")[0])
        elif isinstance(node, ast.Import):
            foreign |= {alias.name.split(".")[0] for alias in node.names}
    return own, foreign


def users(package):
    return [path for path in MODULES if path.relative_to(PACKAGE).parts[0] == package]


@pytest.mark.parametrize(
    ("package", "forbidden"),
    [
        (
            "physics",
            ("scene", "result", "surface", "trace", "model", "verdict", "report", "errors"),
        ),
        ("trace", ("model", "commands", "verdict", "report")),
        ("model", ("trace", "surface", "verdict", "report")),
        ("surface", ("trace", "model", "verdict", "report")),
        ("verdict", ("trace", "model", "report")),
    ],
)
def test_who_may_know_whom(package, forbidden):
    assert users(package)
    for path in users(package):
        own, _ = imports(path)
        for name in own:
            first = name.split(".")[0]
            assert first not in forbidden, f"{path.name} imports {name}"


def test_one_file_knows_embreex_and_one_knows_numba():
    knows = {
        word: [p.name for p in MODULES if word in imports(p)[1]] for word in ("embreex", "numba")
    }
    assert knows["embreex"] == ["embree.py"]
    assert knows["numba"] == ["jit.py"]


@pytest.mark.parametrize("path", MODULES, ids=lambda p: p.stem)
def test_no_pickle_no_eval(path):
    text = path.read_text(encoding="utf-8")
    _, foreign = imports(path)
    assert not foreign & {"pickle", "joblib", "shelve", "marshal"}
    assert "eval(" not in text.replace("retrieval(", "")
    assert "allow_pickle=True" not in text


@pytest.mark.parametrize("path", MODULES, ids=lambda p: p.stem)
def test_one_file_counts_processors(path):
    """Those of the machine are not those this process may use: threads ask `memory.cores`."""
    text = path.read_text(encoding="utf-8")
    if path.name != "memory.py":
        assert "cpu_count" not in text
    assert "ThreadPoolExecutor()" not in text
    assert "workers=-1" not in text  # scipy counts those of the machine
