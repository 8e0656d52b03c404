import math

from microsurf.report import stability_section, stability_text
from microsurf.report.figures import stability
from microsurf.stability import Stability
from microsurf.stability.case import DomainPoint
from microsurf.stability.limits import Limit
from microsurf.stability.map import Summary
from microsurf.stability.sweep import Count


def point(function, right, kept=15.0, **coordinates):
    return DomainPoint(function, "facet", coordinates, 1.0, 1.0, 10.0, right, 14.0, kept)


def found():
    points = [
        point("F", 15.0, n=1.0, theta=0.0, k=1.0),
        point("F", 11.0, 11.0, n=1.0, theta=0.0, k=2.0),
        point("F", 14.0, n=1.5, theta=0.0, k=1.0),
        point("r_e", 13.0, n=1.0),
        point("r_i", 12.5, n=1.0),
    ]
    summaries = [Summary("F", "facet", 3, points[1], 11.0, 1, ""),
                 Summary("r_e", "facet", 1, points[3], 13.0, 1, "a | reason")]  # fmt: skip
    limits = [Limit("γ → 3/2", "KS", 0.1, 0.005, "no mesh holds it")]
    return Stability(points, summaries, [Count("F", 7, 1, 0, 0)], limits, 1.0)


def test_rows_hold_the_worst_of_each_cell():
    rows = stability.rows(found())
    assert [(row["function"], row["right"]) for row in rows] == [
        ("F", 11.0), ("F", 14.0), ("r_e", 13.0), ("r_i", 12.5),
    ]  # fmt: skip
    assert rows[0]["place"] == "n = 1, θ = 0, k = 2"


def test_figure_has_a_pair_of_panels_for_each_law_and_marks_what_is_short():
    figure = stability.figure(found(), "facet")
    panels = [axes for axes in figure.axes if axes.images]
    assert [axes.get_title() for axes in panels] == [
        "F: right", "attainable", "diffuse averages: right", "attainable",
    ]  # fmt: skip
    assert panels[0].images[0].get_array().tolist() == [[11.0, 14.0]]
    assert len(panels[0].lines) == 1  # the cross
    assert not panels[2].lines
    assert panels[2].images[0].get_array().tolist() == [[13.0], [12.5]]
    assert figure.get_suptitle().count("×") == 1


def test_section_holds_all_that_was_found():
    made = stability_section.section(found(), "Checked long ago.")
    assert [table.caption.split(",")[0] for table in made.tables] == [
        "Formulas and samplers", "Borders of meshes and traces",
    ]  # fmt: skip
    assert [picture.name for picture in made.pictures] == ["stability-facet"]
    assert "1 of\n7 values" in made.text
    assert "Checked long ago." in made.paragraphs
    assert made.tables[0].rows[0]["function"] == "F"
    assert made.tables[1].rows[0]["verdict"] == "border"


def test_tables():
    text = stability_text.markdown(found())
    assert "| F | 3 | 11.0 | 11.0 | 14.0 | 1.0e+01 | n = 1, θ = 0, k = 2 | 11.0 | short |" in text
    assert "stated: a \\| reason" in text
    assert "1 in 7 values" in text
    assert "| γ → 3/2 | KS | 0.1 | 0.005 | border | no mesh holds it |" in text


def test_json_holds_numbers_and_texts():
    values = stability_text.as_json(found())
    assert values["sound"] is False
    assert values["limits"][0]["verdict"] == "border"
    assert values["functions"][1]["verdict"] == "stated"
    assert math.isclose(values["functions"][0]["condition"], 10)
