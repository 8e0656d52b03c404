"""What moved since an old report: false alarms at their rate, real moves found, damage told."""

import json
from copy import deepcopy

import numpy as np
import pytest
from judge import rate
from scipy import stats

from microsurf.analysis import regression
from microsurf.errors import InputError


def row(quantity="body", theta=30.0, **over):
    return {
        "quantity": quantity, "theta_i": theta, "phi_i": 0.0, "kd": 0.5, "measured": 0.5,
        "standard_error": 0.001, "model": "smith", "predicted": 0.49, "predicted_error": 0.0,
        "basis": "8 surfaces", "verdict": "holds", **over,
    }  # fmt: skip


def report(*rows, **scenes):
    named = {"one": list(rows), **scenes} if rows else scenes
    return {
        "schema": regression.SCHEMA,
        "microsurf": "0",
        "scenes": [{"name": name, "comparisons": found} for name, found in named.items()],
    }


def test_the_same_report_has_not_moved():
    document = report(row(), row("specular", standard_error=0.0))
    found = regression.against(document, document, "old.json")
    assert found["figures"] == 4
    assert [found[key] for key in ("moved", "verdicts", "appeared", "vanished")] == [[]] * 4


def test_false_alarms_come_at_the_stated_rate(judge):
    """600 pairs of reports of 10 true figures, over 8 surfaces each, errors estimated.

    Family-wise level 1 %: 6 alarms expected. Negative control: each figure on its own at 1 %.
    """
    rng = np.random.default_rng(judge.seed(20))
    alarms = alone = 0
    for _ in range(600):
        pair, means, squares = [], [], []
        for _ in range(2):
            values = 0.5 + 0.01 * rng.standard_normal((10, 8))
            errors = values.std(axis=1, ddof=1) / np.sqrt(8)
            means.append(values.mean(axis=1))
            squares.append(errors**2)
            pair.append(
                report(
                    *(
                        row(theta=float(k), measured=m, standard_error=e)
                        for k, (m, e) in enumerate(zip(values.mean(axis=1), errors, strict=True))
                    )
                )
            )
        alarms += bool(regression.against(*pair, "old.json")["moved"])
        t = np.abs(means[0] - means[1]) / np.sqrt(squares[0] + squares[1])
        alone += bool((2 * stats.t.sf(t, 14)).min() <= regression.LEVEL)
    judge.keeps(rate(alarms, 600, regression.LEVEL))
    judge.catches(rate(alone, 600, regression.LEVEL))


def test_a_move_is_found_with_its_size():
    """Negative control of the above: 8 surfaces, 10 standard errors of the difference."""
    old, new = report(row(), row("specular")), report(row(measured=0.5142), row("specular"))
    (moved,) = regression.against(new, old, "old.json")["moved"]
    assert (moved["scene"], moved["quantity"], moved["figure"]) == ("one", "body", "measured")
    assert moved["difference"] == pytest.approx(0.0142)
    assert moved["z"] == pytest.approx(0.0142 / np.hypot(0.001, 0.001))
    # Equal variances: Welch's t has 7 + 7 degrees of freedom; Holm's first step is Bonferroni's.
    assert moved["p"] == pytest.approx(2 * stats.t.sf(moved["z"], 14))
    assert moved["p_holm"] == pytest.approx(4 * moved["p"])


def test_few_surfaces_take_more_to_move():
    for basis, count in (("2 surfaces", 0), ("50 surfaces", 1), ("rays on one surface", 1)):
        old, new = report(row(basis=basis)), report(row(basis=basis, measured=0.507))
        assert len(regression.against(new, old, "o")["moved"]) == count


@pytest.mark.parametrize(("change", "moves"), [(1e-12, False), (5e-5, False), (3e-4, True)])
def test_a_prediction_without_error_moves_beyond_its_quadrature(change, moves):
    old, new = report(row()), report(row(predicted=0.49 * (1 + change)))
    moved = regression.against(new, old, "o")["moved"]
    assert bool(moved) is moves
    assert all(m["figure"] == "predicted" and m["z"] is None for m in moved)


def test_rounding_of_what_has_no_error_is_no_move():
    exact = row(measured=1.0, standard_error=1e-17)
    found = regression.against(report({**exact, "measured": 1 - 1e-15}), report(exact), "o")
    assert found["moved"] == []


def test_a_zero_may_move():
    old, new = report(row(predicted=0.0)), report(row(predicted=0.1))
    assert len(regression.against(new, old, "o")["moved"]) == 1


def test_verdicts_that_changed_and_scenes_that_came_and_went_are_told():
    old = report(row(), row("total"), gone=[row()])
    new = report(row(verdict="departs"), row("specular"), fresh=[row()])
    found = regression.against(new, old, "o")
    (changed,) = found["verdicts"]
    assert (changed["old"], changed["new"]) == ("holds", "departs")
    assert found["appeared"] == [
        "scene fresh", "one: specular at θ_i = 30, φ_i = 0, Kd = 0.5"
    ]  # fmt: skip
    assert found["vanished"] == ["scene gone", "one: total at θ_i = 30, φ_i = 0, Kd = 0.5"]


def test_a_report_reads_back(tmp_path):
    path = tmp_path / "old.json"
    document = report(row())
    path.write_text(json.dumps(document))
    assert regression.read_report(path) == document


def damaged():
    good = report(row())
    texts = {"": "not JSON", "{": "not JSON", "[1]": "no report", "{}": "no report", "3": "no rep"}
    yield from texts.items()
    yield json.dumps({**good, "schema": 1}), "schema = 1, this microsurf reads 3"
    yield json.dumps({**good, "schema": 99}), "schema = 99"
    yield json.dumps({**good, "schema": "two"}), "schema = 'two'"
    yield json.dumps({"schema": regression.SCHEMA}), "damaged"
    yield json.dumps({**good, "scenes": 3}), "damaged"
    yield json.dumps({**good, "scenes": [3]}), "damaged"
    yield json.dumps({**good, "scenes": [{"name": "x"}]}), "damaged"
    yield json.dumps(good).replace("0.49", "NaN"), "NaN"
    yield json.dumps(good)[:-20], "not JSON"
    yield "[" * 100_000, "not JSON"
    for key, value in (("measured", "much"), ("basis", 3), ("kd", None), ("verdict", None)):
        wrong = deepcopy(good)
        wrong["scenes"][0]["comparisons"][0][key] = value
        yield json.dumps(wrong), "damaged in scene 'one'"
        del wrong["scenes"][0]["comparisons"][0][key]
        yield json.dumps(wrong), "damaged in scene 'one'"
    for key, value in (("measured", 10**400), ("measured", 1e999), ("standard_error", 1e300),
                       ("standard_error", -0.1), ("predicted", True)):  # fmt: skip
        wrong = deepcopy(good)
        wrong["scenes"][0]["comparisons"][0][key] = value
        yield json.dumps(wrong).replace("Infinity", "1e999"), "damaged in scene 'one'"


@pytest.mark.parametrize(("text", "words"), list(damaged()))
def test_damage_and_other_versions_are_one_line(tmp_path, text, words):
    path = tmp_path / "old.json"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        regression.read_report(path)
    assert words in str(caught.value)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_bytes_and_missing_files_are_one_line(tmp_path):
    (tmp_path / "b").write_bytes(b"\xff\xfe\x80")
    for name, words in (("b", "not JSON"), ("none", "no such file")):
        with pytest.raises(InputError, match=words):
            regression.read_report(tmp_path / name)
