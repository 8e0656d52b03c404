"""Make the site of the documentation: a warning, a dead link, a slow notebook are errors.

``make docs``. Nothing is fetched: links to other hosts are left alone.
"""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

from sphinx.application import Sphinx

ROOT = Path(__file__).parent.parent
SITE = ROOT / "build" / "docs"
MOST_SECONDS = 60.0
"""What a notebook may take, with compiled kernels."""

WARM = "measure --gamma 2 --sigma 0.3 --theta 60 --cells 64 --realisations 2 --paths 2000"


class Page(HTMLParser):
    """What a page links to, and what may be linked to in it."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.anchors: set[str] = set()
        self.feed(text)

    def handle_starttag(self, _: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note the links and the anchors of one element."""
        for name, value in attrs:
            if name in ("href", "src") and value:
                self.links.append(value)
            elif name in ("id", "name") and value:
                self.anchors.add(value)


def main() -> None:
    """Build, then look at every link and at the notebooks' times."""
    # Where the command line is, for the notebooks.
    os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    # Kernels are compiled once for a machine: that is no notebook's time.
    subprocess.run(["microsurf", *WARM.split()], check=True, stdout=subprocess.DEVNULL)  # noqa: S603, S607
    shutil.rmtree(SITE, ignore_errors=True)
    app = Sphinx(
        ROOT / "docs", ROOT / "docs", SITE, SITE.parent / "doctrees", "html",
        freshenv=True, warningiserror=True, exception_on_warning=False, status=None,
    )  # fmt: skip
    app.build()
    faults = list(dead_links(SITE))
    env: Any = app.env  # where the notebooks' times are, put there by myst-nb
    for name, values in sorted(env.nb_metadata.items()):
        if "exec_data" in values:
            seconds = values["exec_data"]["runtime"]
            report(f"{name}: {seconds:.1f} s")
            if seconds > MOST_SECONDS:
                faults.append(f"{name} takes {seconds:.0f} s, more than {MOST_SECONDS:.0f}")
    for fault in faults:
        report(fault)
    if faults or app.statuscode:
        raise SystemExit(1)
    report(f"{SITE / 'index.html'}: {len(list(SITE.rglob('*.html')))} pages, no dead link")


def dead_links(site: Path) -> Iterator[str]:
    """Links within a site that lead to no file of it, or to no place in a page."""
    pages = {
        path.resolve(): Page(path.read_text(encoding="utf-8")) for path in site.rglob("*.html")
    }
    for path, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if target.is_dir():
                target /= "index.html"
            anchor = unquote(parts.fragment)
            found = target.exists() and (
                not anchor or target not in pages or anchor in pages[target].anchors
            )
            if not found:
                yield f"{path.relative_to(site.resolve())}: {link} leads nowhere"


def report(line: str) -> None:
    """Print a line at once."""
    print(line, flush=True)  # noqa: T201 - a script


if __name__ == "__main__":
    main()
