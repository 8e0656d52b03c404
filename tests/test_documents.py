"""README, docs and CONTRIBUTING: short enough, and no link that leads nowhere."""

import importlib
import re
from pathlib import Path

import pytest

import microsurf

ROOT = Path(__file__).parent.parent
SITE = ROOT / "docs"
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(SITE.rglob("*.md"))]
SITE_ALONE = {"index", "quickstart", "api", "command-line", "citing", "changelog", "contributing"}
"""Pages that only the site has; its front page is the README."""


def test_readme_is_read_in_five_minutes():
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= 120


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    for link in re.findall(r"\]\(([^)#]+)\)", page.read_text(encoding="utf-8")):
        assert link.startswith("https://") or (page.parent / link).exists(), link


def test_every_page_is_linked_from_the_readme():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    for page in PAGES[1:]:
        if page.stem in SITE_ALONE or page.parent.name == "notebooks":
            continue
        assert f"]({page.relative_to(ROOT).as_posix()})" in text, page.name


def test_modules_named_in_contributing_exist():
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    for name in re.findall(r"`([a-z_/]+(?:\.py|/))`", text):
        assert (ROOT / name).exists() or (ROOT / "microsurf" / name).exists(), name


def listed():
    """Pages in the tables of contents of the site's front page."""
    text = (SITE / "index.md").read_text(encoding="utf-8")
    trees = re.findall(r"```\{toctree\}\n(.*?)```", text, flags=re.DOTALL)
    return [line for tree in trees for line in tree.splitlines() if line and line[0] != ":"]


def test_every_page_is_in_one_table_of_contents():
    pages = {p.relative_to(SITE).with_suffix("").as_posix() for p in SITE.rglob("*.md")} - {"index"}
    assert sorted(listed()) == sorted(pages)


def test_the_page_of_the_python_interface_has_the_public_names_and_only_such():
    text = (SITE / "api.md").read_text(encoding="utf-8")
    found, module = {}, ""
    for directive, name in re.findall(r"\.\. (\w+):: ([\w.]+)", text):
        if directive == "currentmodule":
            module = name
        elif directive != "automodule":
            found.setdefault(module, []).append(name)
    own = [name for name in microsurf.__all__ if name != "__version__"]
    assert sorted(found.pop("microsurf")) == sorted(own)
    for module, names in found.items():
        public = importlib.import_module(module).__all__
        assert not set(names) - set(public), module
