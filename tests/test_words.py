"""One word for one thing: the words that were given up do not come back.

Each group names what is said now. Words are looked for in code, comments, docstrings, help
texts, templates and JSON keys alike: ``user_rungs`` and ``Rung`` are uses of *rung*.
"""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
FILES = sorted(
    path
    for folder, endings in (("microsurf", ("py", "jinja", "json", "toml")), ("validation", ("py",)))
    for ending in endings
    for path in (ROOT / folder).rglob(f"*.{ending}")
)
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]

INSTEAD = {
    "ledger|lanes?|crews?": "scheduler, stream, worker pool",
    "fates?|arrivals?|meetings?|take_events|labelled": "status, intersection, to_dataset",
    "pieces?|waves?": "work item, ray batch",
    "grooves?|vgrooves?|lit": "vcavity, illuminated",
    "realised": "of the mesh, mesh slopes",
    "laws?": "function, formula, distribution, case, slope parameters; budget term model",
    "candidates?|trials?|own brdfs?": "user BRDF",
    "ladders?|rungs?": "trade-off, method, frontier",
    "freedom": "dof in code; degrees of freedom in prose",
    "books": "energy, conserved",
    "told|dear|come to|comes to|what a mesh leaves": "resolved, expensive, result",
    "--beyond": "--allow-truncated-tail",
}
"""Words that may not be used, as a pattern, and what is said instead."""

ALLOWED = {
    "degrees of freedom": "the field's term",
    "degree of freedom": "the field's term",
    "power law": "y ∝ xᵃ",
    "mirror law": "that of reflection",
    '"rung"': "a key of the JSON of tradeoff and advise and of their tables",
    '"rungs"': "the same",
    "['rung']": "the same",
    "missed_rung": "a column of a committed table of trade-offs",
    "labelled": "arrays with labels: xarray's own word",
    "one path a lane": "of a processor's vector unit",
    "as fast as lanes": "the same",
    "trial": "a step that a fit tries and may refuse",
}
"""Other meanings of these words, each with its reason."""
ONLY = {
    "labelled": ("results", "model", "report", "README.md", "CONTRIBUTING.md", "method.md"),
    "trial": ("brdf_fit",),
}
"""Where an allowed word is used, if not everywhere."""

NAMES = {
    "beyond", "books", "box", "candidate", "chance", "checks", "distance", "family", "keep",
    "ladder", "law", "laws", "lane", "ledger", "level", "meeting", "paths", "pieces", "precision",
    "rungs", "runs", "spread", "std", "survey", "told", "trend", "trial", "wave", "whole",
    "workers",
}  # fmt: skip
"""Ordinary words that no module or class is named for: each meant something of its own."""
LOCALS = {"asked", "dear", "found", "made", "own", "place", "seen", "told"}
"""Participles that say nothing of a value: no variable of the package is called so."""


def used(text, words, where=""):
    """Uses of words in a text, those of other meanings left out."""
    text = re.sub(r"\s+(# +|#: +)?", " ", text)
    for phrase in ALLOWED:
        if phrase not in ONLY or any(place in where for place in ONLY[phrase]):
            text = re.sub(re.escape(phrase), lambda m: " " * len(m[0]), text, flags=re.IGNORECASE)
    # Parts of names are words: _ and a change to capitals end one.
    text = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", text).replace("_", " ").lower()
    return re.findall(rf"(?<![\w-])(?:{words.replace('_', ' ')})(?![\w])", text)


def where(path):
    return path.relative_to(ROOT).as_posix()


@pytest.mark.parametrize("words", INSTEAD)
def test_a_word_that_was_given_up_is_not_used(words):
    found = {
        where(path): uses
        for path in [*FILES, *PAGES]
        if (uses := used(path.read_text(encoding="utf-8"), words, where(path)))
    }
    assert not found, f"say {INSTEAD[words]}"


def test_the_search_finds_what_it_looks_for():
    """Negative control, and words within others that are no uses."""
    for text in ("a rung", "user_rungs", "Rungs:", "theRung", "'rung': 1", "(rung)"):
        assert used(text, "ladders?|rungs?"), text
    for text in ('{"rung": 1}', "trunk", "wrung"):
        assert not used(text, "ladders?|rungs?"), text
    assert used("the law", "laws?")
    assert not used("a power law, flaws, lawn", "laws?")
    assert used("a trial", "trials?", "microsurf/model/brdf.py")
    assert not used("a trial", "trials?", "microsurf/analysis/brdf_fit/inside.py")
    assert used("--beyond", "--beyond")
    assert used("take_events(1)", "take_events")


def test_every_allowed_use_is_one():
    """What nobody says any more leaves the list."""
    text = " ".join(path.read_text(encoding="utf-8").lower() for path in [*FILES, *PAGES])
    text = " ".join(text.split())
    assert not [phrase for phrase in ALLOWED if phrase not in text]


@pytest.fixture(scope="module")
def nodes():
    """All of the syntax tree of each Python file, by its address."""
    return {
        path: list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
        for path in FILES
        if path.suffix == ".py"
    }


def test_a_local_is_the_noun_that_it_is(nodes):
    for path, of_file in nodes.items():
        if where(path).startswith("microsurf"):
            stored = {n.id for n in of_file if isinstance(n, ast.Name) and not _is_read(n)}
            given = {n.arg for n in of_file if isinstance(n, ast.arg)}
            assert not (stored | given) & LOCALS, path


def _is_read(name):
    return isinstance(name.ctx, ast.Load)


def test_no_module_or_class_has_an_ordinary_word_for_its_name(nodes):
    for path, of_file in nodes.items():
        classes = {node.name.lower() for node in of_file if isinstance(node, ast.ClassDef)}
        assert path.stem not in NAMES, path
        assert not classes & NAMES, path
