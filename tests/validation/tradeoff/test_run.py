"""Frontiers twice: what both runs tell is counted, and an order that turns round is found."""

import csv
from types import SimpleNamespace

import numpy as np
import pytest

from microsurf.analysis.tradeoff import pareto
from microsurf.analysis.tradeoff.effort import EFFORTS, TradeoffEffort
from microsurf.analysis.tradeoff.pareto import MethodPoint
from microsurf.report.figures import pareto_all
from microsurf.scene import Light, Material, Roughness, Scene
from validation.tradeoff import run as frontiers

TINY = TradeoffEffort(((1000, 4),), ((0.5, 500, 4),), 1, 1, 2000, 4, 8)
FLAT = Scene(material=Material(1.5, (0.5,)), roughness=Roughness(2.0, (0.0,)))


def separated_pairs(values, costs):
    """What a run says of methods with these answers to a truth of 1, known to 0.1 %."""
    points = [
        MethodPoint(
            name, cost, cost / 1.1, cost * 1.1,
            pareto.squared([(np.array([[values[name]]]), REFERENCE)]),
        )
        for name, cost in costs.items()
    ]  # fmt: skip
    rows = [{"quantity": "albedo", "rung": name} for name in values]
    found = SimpleNamespace(points={"albedo": points})
    return {"rows": rows, "separated": frontiers.separated_pairs(found)}


REFERENCE = np.array([[0.998], [0.999], [1.0], [1.001], [1.002]])
COSTS = {"a": 1.0, "b": 10.0, "c": 10.5}
VALUES = {"a": 1.2, "b": 1.05, "c": 1.0502}


def test_what_repeats_is_no_reversal():
    one = separated_pairs(VALUES, COSTS)
    error, cost = frontiers.repeated("s", one, separated_pairs({**VALUES, "a": 1.21}, COSTS))
    assert error["pairs"] == cost["pairs"] == 3
    # b and c cost the same within their ranges.
    assert (cost["separated_in_both"], cost["ties"], cost["reversed"]) == (2, 1, 0)
    assert error["separated_in_both"] >= 2
    assert error["reversed"] == 0


@pytest.mark.parametrize(
    ("values", "costs", "error", "cost"),
    [
        ({**VALUES, "a": 1.01}, COSTS, 2, 0),  # a is now better than b and c
        (VALUES, {**COSTS, "a": 100.0}, 0, 2),
        (VALUES, {**COSTS, "a": 10.2}, 0, 0),  # a tie in one run turns nothing round
    ],
)
def test_a_planted_reversal_is_counted(values, costs, error, cost):
    of_error, of_cost = frontiers.repeated(
        "s", separated_pairs(VALUES, COSTS), separated_pairs(values, costs)
    )
    assert (of_error["reversed"], of_cost["reversed"]) == (error, cost)
    for row in (of_error, of_cost):
        counted = ("separated_in_both", "separated_in_one", "ties", "reversed")
        assert sum(row[key] for key in counted) == row["pairs"]
        assert min(row[key] for key in counted) >= 0
    assert (of_error["quantity"], of_cost["quantity"]) == ("albedo", "every")
    assert ("a > b" in of_error["which"]) == bool(error)
    line = next(
        x for x in frontiers.page([of_error, of_cost]).splitlines() if "opposite order" in x
    )
    assert line.endswith(f"| {error} | {cost} |")


def test_cost_is_counted_once_for_all_quantities():
    run = separated_pairs(VALUES, COSTS)
    several = {
        "rows": [row | {"quantity": q} for q in ("albedo", "peak") for row in run["rows"]],
        "separated": dict.fromkeys(("albedo", "peak"), run["separated"]["albedo"]),
    }
    table = frontiers.repeated("s", several, several)
    assert [row["of"] for row in table] == ["error", "cost", "error"]


def test_two_angles_of_any_scene():
    def angles(*theta):
        return frontiers.at_two_angles(Scene(light=Light(theta))).light.theta

    assert angles(0.0, 30.0, 60.0, 80.0) == (30.0, 60.0)
    assert angles(0.0, 20.0, 40.0, 60.0) == (20.0, 40.0)
    assert angles(0.0) == (0.0,)


def test_the_script_writes_goes_on_and_says_what_turned_round(tmp_path, monkeypatch):
    monkeypatch.setattr(frontiers, "KEPT", tmp_path / "kept")
    monkeypatch.setitem(EFFORTS, "quick", TINY)
    file = tmp_path / "flat.toml"
    file.write_text(FLAT.to_toml(), encoding="utf-8")
    words = [str(file), "--out", str(tmp_path / "out")]
    assert frontiers.main(words) == 0
    names = {p.name for p in (tmp_path / "out").iterdir()}
    assert names == {"flat.csv", "frontiers.png", "over_all.png", "repeat.csv", "repeat.md"}
    monkeypatch.setattr(frontiers, "tradeoff", None)  # nothing is run again
    assert frontiers.main(words) == 0
    turned = [separated_pairs(VALUES, COSTS), separated_pairs({**VALUES, "a": 1.01}, COSTS)]
    kept = frontiers.kept_run

    def made_up(path, run):
        found = kept(path, run)
        rows = [row | {"rung": name} for row in found["rows"] for name in VALUES]
        return found | {"rows": rows, "separated": turned[run]["separated"]}

    monkeypatch.setattr(frontiers, "kept_run", made_up)
    assert frontiers.main(words) == 1
    with (tmp_path / "out" / "repeat.csv").open(encoding="utf-8") as lines:
        assert sum(int(row["reversed"]) for row in csv.DictReader(lines)) == 2


def method(name, seconds, error, quantity="albedo"):
    return {"quantity": quantity, "rung": name, "model": name, "seconds": seconds, "error": error}


def test_medians_are_relative_to_each_scene_s_cheapest():
    tables = {
        "one": [method("flat", 1.0, 0.5), method("smith", 10.0, 0.1)],
        "other": [method("flat", 2.0, 0.3), method("smith", 60.0, 0.2)],
        "alone": [method("flat", 5.0, 0.0)],  # nothing to compare it with
    }
    flat, smith = pareto_all.medians(tables)
    assert (flat["cost"], flat["scenes"]) == (1.0, 2)
    assert [flat[f"error{end}"] for end in ("_low", "", "_high")] == pytest.approx(
        [0.35, 0.4, 0.45]
    )
    assert [smith[f"cost{end}"] for end in ("_low", "", "_high")] == pytest.approx(
        [15.0, 20.0, 25.0]
    )
    panels = pareto_all.over_all([flat, smith]).axes
    assert [p.get_xscale() for p in panels] == ["log"]
