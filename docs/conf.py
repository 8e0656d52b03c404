"""How Sphinx makes the site: ``make docs``."""

import os
import re
from importlib import metadata
from pathlib import Path
from typing import Any

project = "microsurf"
author = "The microsurf authors"
project_copyright = author
release = version = metadata.version("microsurf")

extensions = [
    "myst_nb",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "sphinx_click",
]
exclude_patterns = ["_build"]

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3

# A notebook runs whenever the site is made, in a folder of its own; an error ends it.
nb_execution_mode = "force"
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 60

numpydoc_show_class_members = False
autodoc_typehints = "none"  # numpydoc's text has them
add_module_names = False

html_theme = "furo"
html_title = f"microsurf {release}"
html_show_sourcelink = False
html_static_path = ["_static"]
html_css_files = ["lines.css"]
html_extra_path = ["../reports/explorer/explorer.html"]

_ROOT = Path(__file__).parent.parent
_ROOT_PAGES = {"index": "README.md", "changelog": "CHANGELOG.md", "contributing": "CONTRIBUTING.md"}
"""Pages that begin with a file beside this folder, by their names."""

_LINK = re.compile(r"\[([^\]]*)\]\(((?!https://|#)[^)#\s]+)(#[^)]*)?\)")


def _with_root_pages(_: Any, name: str, source: list[str]) -> None:
    """Put a file of the repository's root before a page, and let links lead to what the site has.

    Texts are written for the repository, where a link is a path. Here a page is a page, and any
    other file, as a table of the reports, is a download.
    """
    text, folder = source[0], (_ROOT / "docs" / name).parent
    if name in _ROOT_PAGES:
        first = (_ROOT / _ROOT_PAGES[name]).read_text(encoding="utf-8")
        text = _LINK.sub(lambda found: _relinked(found, _ROOT, folder), first) + "\n" + text
    else:
        text = _LINK.sub(lambda found: _relinked(found, folder, folder), text)
    source[0] = text


def _relinked(found: re.Match[str], base: Path, folder: Path) -> str:
    words, link, anchor = found[1], found[2], found[3] or ""
    target = (base / link).resolve()
    if target.parent == _ROOT:
        for page, file in {**_ROOT_PAGES, "citing": "CITATION.cff"}.items():
            target = _ROOT / "docs" / f"{page}.md" if file == target.name else target
    if target.suffix == ".html":  # a page that stands beside those of the site
        up = os.path.relpath(_ROOT / "docs", folder).replace(os.sep, "/")
        return f'<a href="{up}/{target.name}">{words}</a>'
    path = os.path.relpath(target, folder).replace(os.sep, "/")
    if target.suffix == ".md" and not target.is_relative_to(_ROOT / "docs"):
        return f"{{download}}`{words} <{path}>`"
    return f"[{words}]({path}{anchor})"


def setup(app: Any) -> None:
    """Sphinx calls this."""
    app.connect("source-read", _with_root_pages)
