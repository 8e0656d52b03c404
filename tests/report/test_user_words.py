"""What a user wrote is words in every medium: no formula, no markup, no lost label."""

import csv
import io
import os
import sys
import tomllib

import pytest

from microsurf.errors import InputError
from microsurf.files import check_readable
from microsurf.report.figures import overview, pareto, pareto_all
from microsurf.report.figures.figure import as_csv, write
from microsurf.report.figures.style import LONGEST, as_text, clean, new_figure, own_style
from microsurf.scene import Scene

WORDS = ("run_$1_vs_$2", "$x_{", r"\$\frac$", "_hidden", "a\nb\x00", "=1+2", "\udcff", "^_^ $$ σ")
VERDICT = {
    "quantity": "total", "effect_percent": 1.0, "low_percent": 0.0, "high_percent": 2.0,
    "margin_percent": 5.0, "verdict": "holds", "theta_i_deg": 0.0, "phi_i_deg": 0.0, "kd": 0.8,
}  # fmt: skip
COST = {
    "quantity": "albedo", "rung": "smith", "model": "smith", "seconds": 1.0, "seconds_low": 0.9,
    "seconds_high": 1.1, "error": 0.01, "error_low": 0.005, "error_high": 0.02,
    "dominated_by": None,
}  # fmt: skip


@own_style()
def labelled(words):
    """A figure with the words in a title, a label and a legend, beside formulas of ours."""
    figure = new_figure(2)
    axes = figure.subplots()
    axes.plot([0, 1], [0, 1], label=as_text(words))
    axes.set_title(as_text(words) + r" at $\theta_i$ = 3°")
    axes.legend()
    clean(axes)
    return figure


@pytest.mark.parametrize("words", WORDS)
def test_no_words_break_or_leave_a_figure(tmp_path, words):
    write(labelled(words), tmp_path / "x.svg")
    assert labelled(words).axes[0].get_legend_handles_labels()[1] == [as_text(words)]
    rows = [{"scene": words} | VERDICT]
    write(overview.figure(rows), tmp_path / "o.svg")
    write(pareto.figure([COST], words), tmp_path / "p.svg")
    write(pareto_all.scenes({words: [COST]}), tmp_path / "s.svg")


def test_long_words_are_cut_in_their_middle():
    assert len(as_text("x" * 1000)) == LONGEST + 1


@pytest.mark.parametrize("words", ["=1+2", "+cmd|' /C calc'!A0", "-2+3", "@SUM(A1)", " =1", "\t=1"])
def test_no_cell_of_text_is_a_formula(words):
    (row,) = csv.DictReader(io.StringIO(as_csv([{"scene": words, "n": 1}])))
    assert row == {"scene": f"'{words}", "n": "1"}


@pytest.mark.parametrize("number", [-1.5, "-1.5e-3", "+2", "-inf", -3, "", "−", "1=2"])
def test_numbers_and_other_texts_stay_as_they_are(number):
    (row,) = csv.DictReader(io.StringIO(as_csv([{"x": number, "y": 1}])))
    assert row["x"] == str(number)


@pytest.mark.parametrize("words", [words for words in WORDS if words.isascii()])
def test_a_scene_file_holds_any_words(words):
    scene = Scene(title=words, rationale=f"\"\"\"{words}'''\\")
    assert Scene.from_toml(scene.to_toml()) == scene
    assert tomllib.loads(scene.to_toml())["title"] == words


@pytest.mark.skipif(sys.platform in ("win32", "darwin"), reason="names are Unicode there")
def test_a_name_that_no_report_could_hold_is_refused_before_any_work(tmp_path):
    name = os.fsdecode(b"scene-\xff.toml")
    (tmp_path / name).write_text(Scene().to_toml(), encoding="utf-8")
    with pytest.raises(InputError, match="rename it"):
        check_readable(tmp_path / name, "give another")
