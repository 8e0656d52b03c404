"""The table of albedos: a column more is one entry."""

from dataclasses import replace

import pytest

from microsurf.analysis.comparison import Comparison
from microsurf.analysis.validation import Validation
from microsurf.report import albedo_table, html
from microsurf.scene import Scene

ROW = Comparison(
    "specular", 60.0, 0.0, 0.5, 0.1, 0.001, "smith", 0.08, 0.0, 0.25, 0.2, 0.3, "surfaces", 0.05,
    "departs", "holds", "", 4,
)  # fmt: skip


def shown(scene, *rows):
    """The table of a scene with these comparisons."""
    entry = Validation.__new__(Validation)
    object.__setattr__(entry, "scene", scene)
    object.__setattr__(entry, "comparisons", rows)
    module = html.environment().get_template("albedo_table.html.jinja").module
    return str(module.albedo_table(entry))


def test_a_row_says_what_was_compared():
    text = shown(Scene(), ROW)
    cells = ("order-1 specular albedo", "60", "0.10000", "0.08000", "+25.00", "+20.00 … +30.00")
    for cell in (*cells, "±5", '<span class="departs">✗ departs</span>', "holds"):
        assert f">{cell}<" in text or cell in text
    assert text.count("<tr") == 2
    assert 'class="unexpected"' in text
    assert 'class="unexpected"' not in shown(Scene(), replace(ROW, expected="departs"))


@pytest.mark.parametrize("phi", [(0,), (0, 90)])
def test_azimuths_have_a_column_where_there_are_several(phi):
    text = shown(Scene.of(gamma=2, sigma=0.5, phi=phi), ROW)
    assert ("φ_i (°)" in text) == (len(phi) > 1)
    assert text.count('<th scope="col"') == text.count("<td") + text.count('<th scope="row"')


def test_a_column_more_is_one_entry(monkeypatch):
    more = albedo_table.Column("<surfaces>", lambda row: f"{row.surfaces} & all")
    monkeypatch.setattr(albedo_table, "COLUMNS", (*albedo_table.COLUMNS, more))
    text = shown(Scene(), ROW)
    assert "&lt;surfaces&gt;" in text
    assert "4 &amp; all" in text
