"""What `make dist` holds of its archives, without building them."""

import re
import tomllib
from pathlib import Path

from validation import packages

ROOT = Path(__file__).parents[3]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def long_description():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    text = README
    for change in project["tool"]["hatch"]["metadata"]["hooks"]["fancy-pypi-readme"][
        "substitutions"
    ]:
        text = re.sub(change["pattern"], change["replacement"], text)
    return text


def test_no_link_of_the_long_description_leads_nowhere():
    assert packages.relative_links(README)  # so that there is something to find
    assert packages.relative_links(long_description()) == []


def test_the_long_description_keeps_the_words():
    text = long_description()
    assert "| `docs/method.md` |" in text
    assert "*Left:" not in text
    pictures = re.findall(r"!\[.*\n\n\*[^*]+\*\n\n", README)
    assert len(text.splitlines()) >= len(README.splitlines()) - 6 * len(pictures)


def test_an_archive_without_data_is_refused():
    own = [p.relative_to(ROOT).as_posix() for p in (ROOT / "microsurf").rglob("*") if p.is_file()]
    assert packages.missing(own) == []
    for data in (
        "microsurf/report/report.schema.json",
        "microsurf/report/templates/report.html.jinja",
        "microsurf/scene/builtin/12-flat-lambertian.toml",
        "microsurf/py.typed",
    ):
        assert packages.missing(name for name in own if name != data) == [data]
