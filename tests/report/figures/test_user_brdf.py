"""The user BRDF's figure draws the numbers it gives."""

from dataclasses import replace

import numpy as np
import pytest

from microsurf.analysis import validate, validate_user_brdf
from microsurf.model import UserBrdf
from microsurf.report.figures import user_brdf
from microsurf.results import detector
from microsurf.scene import Accuracy, Light, Material, Scene, Surface

pytestmark = pytest.mark.usefixtures("few_walks")

SCENE = Scene(
    material=Material(1.0, (0.5,)),
    surface=Surface(cells=16, realisations=2),
    light=Light((20.0, 60.0)),
    accuracy=Accuracy(2000),
)


@pytest.fixture(scope="module")
def entry():
    own = UserBrdf("own:f", lambda _, o: (np.zeros(len(o)), np.full(len(o), 0.1)))
    return validate_user_brdf.judge(validate.validate_scene("s", SCENE), own, [])


def test_numbers_are_those_of_the_lobes(entry):
    rows = user_brdf.rows(entry)
    assert {row["quantity"] for row in rows} == {"body"}
    assert len(rows) == 2 * (2 * detector.RINGS - 1)
    np.testing.assert_allclose([row["user_brdf_per_sr"] for row in rows], 0.1, rtol=1e-9)
    assert all(row["half_width_per_sr"] >= 0 < row["theory_per_sr"] for row in rows)


def test_the_figure_draws_them(entry):
    drawn = user_brdf.figure(entry)
    panels = [p for p in drawn.axes if p.get_title()]
    assert len(panels) == 2
    lines = {line.get_label(): line for line in panels[0].lines}
    assert set(lines) == {"measured, 95 % band", "theory", "user BRDF"}
    rows = [r for r in user_brdf.rows(entry) if r["theta_i_deg"] == 20]
    np.testing.assert_array_equal(
        lines["theory"].get_ydata(), [row["theory_per_sr"] for row in rows]
    )


def test_without_a_user_brdf_there_are_no_numbers(entry):
    assert user_brdf.rows(replace(entry, user_brdf=None)) == []
