"""The page of Mitsuba's BSDFs says what its rows say."""

import csv

import pytest

from validation.renderers import figure, run, study, text


@pytest.fixture
def rows():
    with (run.OUT / "mitsuba.csv").open(encoding="utf-8") as file:
        return [study.as_read(row) for row in csv.DictReader(file)]


def test_the_page_is_that_of_the_rows(rows):
    assert {row["bsdf"] for row in rows} == set(study.MODELS)
    assert text.page(rows) == (run.OUT / "mitsuba.md").read_text(encoding="utf-8")


def test_effects_are_those_of_the_albedos(rows):
    for row in rows:
        assert row["effect"] == pytest.approx(row["predicted"] / row["traced"] - 1, abs=2e-3)
        assert row["low"] <= row["effect"] <= row["high"]


def test_parts_add_up(rows):
    """Specular and body are the total, traced and of Mitsuba."""
    of = {(r["bsdf"], r["alpha"], r["theta_i"], r["seed"], r["part"]): r for r in rows}
    for key, row in of.items():
        if key[-1] == "total" and (*key[:-1], "body") in of:
            for column in ("traced", "predicted"):
                parts = sum(of[*key[:-1], part][column] for part in ("specular", "body"))
                assert row[column] == pytest.approx(parts, abs=2e-4)


def test_a_verdict_that_turns_is_counted(rows):
    other = [dict(row) for row in rows]
    changed = next(r for r in other if r["seed"] == 2 and r["verdict"] == "holds")
    changed["verdict"] = "departs"
    assert "; 1 turned from holds to" in text.page(other)


def test_the_figure_has_a_panel_for_each(rows):
    drawn = figure.errors_and_light([row for row in rows if row["seed"] == 1])
    assert len([a for a in drawn.axes if a.get_title()]) == len(study.MODELS) + 1
