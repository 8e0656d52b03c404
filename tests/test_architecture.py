"""The house rules that can be read off the imports."""

import ast
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "microsurf"
MODULES = sorted(PACKAGE.rglob("*.py"))
SCRIPTS = sorted((ROOT / "validation").rglob("*.py"))

LAYERS = (
    {"microsurf"},
    {"errors"},
    {"files"},
    {"memory", "seeds", "jit"},
    {"physics", "stats"},
    {"scene"},
    {"results"},
    {"surface"},
    {"model", "trace"},
    {"mitsuba"},
    {"stability", "invariants"},
    {"analysis"},
    {"report"},
    {"cli"},
    {"__main__"},
)
"""A package or loose module imports only what stands left of it, nothing beside or right of it."""


def module_name(path):
    """Dotted name of a file, from the root of the checkout."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


NAMES = {module_name(path): path for path in (*MODULES, *SCRIPTS)}


@cache
def text_of(path):
    """Source of a file."""
    return path.read_text(encoding="utf-8")


@cache
def nodes(path):
    """All of a file's syntax tree."""
    return list(ast.walk(ast.parse(text_of(path))))


@cache
def imports(path):
    """Modules of ours that a file imports, by their full names, and first words of others."""
    own, foreign = set(), set()
    here = path.relative_to(ROOT).parent.parts
    for node in nodes(path):
        if isinstance(node, ast.ImportFrom):
            base = here[: len(here) - node.level + 1] if node.level else ()
            stem = ".".join([*base, *(node.module.split(".") if node.module else [])])
            if stem not in NAMES:
                foreign.add(stem.split(".")[0])
                continue
            for alias in node.names:
                full = f"{stem}.{alias.name}"
                own.add(full if full in NAMES else stem)
        elif isinstance(node, ast.Import):
            own |= {alias.name for alias in node.names if alias.name in NAMES}
            foreign |= {alias.name.split(".")[0] for alias in node.names} - {"microsurf"}
    return own, foreign


def room(name):
    """Package or loose module of ``microsurf`` that a module belongs to."""
    return name.split(".")[1] if "." in name else name


def layer(name):
    return next((k for k, rooms in enumerate(LAYERS) if room(name) in rooms), None)


def test_a_module_imports_only_what_stands_left_of_it():
    for path in MODULES:
        name = module_name(path)
        assert layer(name) is not None, f"{name} is in no layer"
        for other in imports(path)[0]:
            left = room(other) == room(name) or layer(other) < layer(name)
            assert left, f"{name} imports {other}"


def test_no_circle():
    graph = {name: imports(path)[0] for name, path in NAMES.items()}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" → ".join(error.args[1]))


def test_few_rooms():
    packages = [p for p in PACKAGE.iterdir() if (p / "__init__.py").exists()]
    loose = [p for p in PACKAGE.glob("*.py") if p.stem != "__init__"]
    assert len(packages) <= 12
    assert len(loose) <= 7


def test_every_script_has_a_make_target():
    targets = (ROOT / "Makefile").read_text(encoding="utf-8")
    scripts = [p for p in SCRIPTS if '__name__ == "__main__"' in text_of(p)]
    assert len(scripts) > 10
    assert not [name for name in map(module_name, scripts) if f"-m {name}\n" not in targets]


@pytest.mark.parametrize("folder", ["validation", "tests"])
def test_modules_are_found_by_their_names(folder):
    """Nothing is put into sys.path to be found; pytest's own list is in pyproject.toml."""
    hack = "sys.path" + ".insert", "sys.path" + ".append"
    for path in (ROOT / folder).rglob("*.py"):
        assert not [word for word in hack if word in path.read_text(encoding="utf-8")], path


def test_files_are_short():
    """A longer file has two subjects."""
    long = {
        path.relative_to(PACKAGE).as_posix()
        for path in MODULES
        if path.read_text(encoding="utf-8").count("\n") > 300
    }
    assert not long


def test_only_the_command_line_prints():
    for path in MODULES:
        if room(module_name(path)) != "cli":
            assert "click" not in imports(path)[1], path
            assert "sys.stdout" not in text_of(path), path
            assert not calls(path, {"print"}), path


def calls(path, names):
    """Calls of functions by these names in a file."""
    return [
        node
        for node in nodes(path)
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") in names
    ]


def test_one_file_knows_embreex_and_one_knows_numba():
    knows = {
        word: [p.name for p in MODULES if word in imports(p)[1]] for word in ("embreex", "numba")
    }
    assert knows["embreex"] == ["embree.py"]
    assert knows["numba"] == ["jit.py"]


QUANTILES = {
    "stats.t", "stats.norm", "special.stdtrit", "special.ndtri", "special.ndtri_exp"
}  # fmt: skip
BY_HAND = {1.96, 1.645, 2.576}


def test_one_file_has_the_quantiles_of_student_and_of_the_normal_distribution():
    for path in (*MODULES, *SCRIPTS):
        used = {ast.unparse(node) for node in nodes(path) if isinstance(node, ast.Attribute)}
        if module_name(path) == "microsurf.stats.intervals":
            assert used & QUANTILES  # the negative control
            continue
        assert not used & QUANTILES, path
        by_hand = {n.value for n in nodes(path) if isinstance(n, ast.Constant)} & BY_HAND
        assert not by_hand or path.name == "parameters.py", path  # the largest η of a fit


def test_no_pickle_no_eval():
    for path in MODULES:
        assert not imports(path)[1] & {"pickle", "joblib", "shelve", "marshal"}, path
        assert not calls(path, {"eval", "exec"}), path
        assert "allow_pickle=True" not in text_of(path), path


def test_one_file_counts_processors():
    """Those of the machine are not those this process may use: threads ask `memory.cores`."""
    for path in MODULES:
        assert path.name == "memory.py" or "cpu_count" not in text_of(path), path
        assert "ThreadPoolExecutor()" not in text_of(path), path
        assert "workers=-1" not in text_of(path), path  # scipy counts those of the machine


def test_only_one_function_writes_figures():
    """What a matplotlibrc asks for reaches no figure: where one is made, ours is the style."""
    for path in (*MODULES, *SCRIPTS):
        asked = [n for n in nodes(path) if isinstance(n, ast.Attribute) and n.attr == "savefig"]
        assert bool(asked) == (path == PACKAGE / "report" / "figures" / "figure.py"), path
        drawn = path in SCRIPTS and " Figure(" in text_of(path)
        assert not drawn or "@own_style()" in text_of(path), path


def test_matplotlib_is_loaded_to_draw():
    for path in MODULES:
        tree = ast.parse(text_of(path))
        loaded = [n.module or "" for n in tree.body if isinstance(n, ast.ImportFrom)]
        loaded += [a.name for n in tree.body if isinstance(n, ast.Import) for a in n.names]
        assert not [name for name in loaded if name.split(".")[0] == "matplotlib"], path
