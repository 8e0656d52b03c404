"""The table of both engines' albedos tells engines that agree from those that don't."""

import pytest

from validation.gridwalk import engine_albedos


@pytest.fixture(scope="module")
def rows():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(engine_albedos, "CELLS", 64)
        patch.setattr(engine_albedos, "PATHS", 2**12)
        patch.setattr(engine_albedos, "WRONG", 1.8)
        patch.setattr(engine_albedos, "SURFACES", ((2.0, 0.3),))
        patch.setattr(engine_albedos, "THETAS", (60.0,))
        return engine_albedos.table()


def test_engines_agree_and_the_control_is_noticed(rows):
    """Seeds are fixed: this can't fail by chance."""
    assert engine_albedos.broken(rows) == []
    assert {row["row"] for row in rows} == {"agreement", "control"}


def test_engines_that_differ_are_named(rows):
    wrong = [{**row, "row": "agreement"} for row in rows if row["row"] == "control"]
    kept = [row for row in rows if row["row"] == "control"]
    assert any("chance passes" in words for words in engine_albedos.broken([*wrong, *kept]))


def test_a_control_that_nobody_notices_is_named(rows):
    blind = [{**row, "z": 0.0} for row in rows]
    assert engine_albedos.broken(blind) == ["the control was not noticed in every case"]
