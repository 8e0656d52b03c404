"""What `advise` says of the IL assumption, from a planted table and from the committed one."""

import json
import sys
from dataclasses import replace

import numpy as np
import pytest

from microsurf.analysis import il_assumption
from microsurf.analysis.il_assumption import Deviation, answer
from microsurf.cli import entry
from microsurf.scene import Layers, Light, Material, Roughness, Scene, Substrate, Surface

SAME = Substrate(shape="same")


def scene(gap=0.8, substrate=SAME, gamma=8.0, sigma=0.5, n=1.5, kd=(0.8,), theta=(0.0, 60.0)):
    return Scene(
        material=Material(n, kd),
        roughness=Roughness(gamma, (sigma,)),
        surface=Surface(correlation=8.0),
        light=Light(theta),
        layers=None if substrate is None else Layers(gap, substrate),
    )


def test_the_table_is_read_at_its_entries():
    """A gap of 0.8 cells at L = 8 is 0.1 L."""
    entry = il_assumption.table()[8.0, 0.5, 1.5, 1.0, 1.0, 0.1, 0.8]
    assert answer(scene()).deviation == entry["total"]
    assert answer(scene(), "lobe").deviation == entry["lobe"]
    assert answer(scene()).neighbours == 1
    assert entry["total"].low <= entry["total"].value <= entry["total"].high
    flat = answer(scene(80.0, Substrate(shape="flat")))
    assert flat.deviation == il_assumption.table()[8.0, 0.5, 1.5, 0.0, 0.0, 10.0, 0.8]["total"]


def test_between_entries_the_worst_neighbour_stands(monkeypatch):
    """Planted: one neighbour of eight is far off."""
    table = dict(il_assumption.table())
    far = Deviation(0.5, 0.4, 0.6)
    key = (8.0, 0.5, 1.33, 1.0, 1.0, 0.2, 0.8)
    table[key] = table[key] | {"total": far}
    monkeypatch.setattr(il_assumption, "table", lambda: table)
    between = answer(scene(gap=1.2, n=1.4, kd=(0.7,)))
    assert between.deviation == far
    assert between.neighbours == 8
    assert "is not good to 10 %" in between.text
    assert answer(scene(gap=1.2, n=1.5)).deviation != far


@pytest.mark.parametrize(("high", "says"), [(0.009, "1 %"), (0.03, "3 %"), (0.09, "10 %")])
def test_levels_are_of_the_upper_end(monkeypatch, high, says):
    key = (8.0, 0.5, 1.5, 1.0, 1.0, 0.1, 0.8)
    table = il_assumption.table() | {key: {"total": Deviation(0.001, 0, high)}}
    monkeypatch.setattr(il_assumption, "table", lambda: table)
    assert f"a single IL facet is good to {says} here" in answer(scene()).text


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"gamma": 1.8}, "gamma = 1.8, traced 2 … 8"),
        ({"sigma": 0.7}, "sigma = 0.7, traced 0.25 … 0.5"),
        ({"n": 2.5}, "n = 2.5"),
        ({"gap": 100.0}, "gap_over_length = 12.5, traced 0.02 … 10"),
        ({"kd": (0.8, 0.1)}, "kd = 0.1"),
        ({"theta": (85.0,)}, "θ_i above 80°"),
        ({"gap": 6.0, "substrate": Substrate(shape="flat")}, "surfaces cross"),
        ({"substrate": Substrate(4.0, (0.5,))}, "a substrate of γ = 4.0 under one of γ = 8"),
        ({"substrate": Substrate(8.0, (0.5, 0.4))}, "an anisotropic substrate"),
        ({"substrate": Substrate(8.0, (2.0,))}, "substrate_over_interface = 4"),
        ({"substrate": Substrate(file="below.npy")}, "a substrate from a file"),
        ({"n": 1.0}, "no interface or no substrate"),
    ],
)
def test_nothing_is_extrapolated(change, why):
    said = answer(scene(**change))
    assert said.deviation is None
    assert why in said.text
    assert said.text.endswith("nothing is extrapolated")


def test_absorption_and_structures_are_not_in_it():
    damp = replace(scene(), layers=Layers(0.8, SAME, absorption=0.1))
    assert "(absorption)" in answer(damp).text
    tops = replace(scene(), surface=Surface(correlation=8.0, structure="tops"))
    assert "(structure tops)" in answer(tops).text


def test_il_scenes_are_told_up_to_which_gap():
    """Of the total and of the lobe, which parts far earlier."""
    total, lobe = (answer(scene(substrate=None), q).text for q in ("albedo", "lobe"))
    table = il_assumption.table()
    for text, name in ((total, "total"), (lobe, "lobe")):
        held = None
        for gap in (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0):
            if table[8.0, 0.5, 1.5, 1.0, 1.0, gap, 0.8][name].high > 0.1:
                break
            held = gap
        assert f"10 % up to {held:g} L" in text
    assert "10 % up to 10 L" in total
    assert "10 % up to 10 L" not in lobe


def test_the_committed_table_is_whole():
    """Every pair and gap for each n and each Kd; at Kd = 1 nothing is absorbed."""
    table = il_assumption.table()
    kds = {key[-1] for key in table}
    assert all((*key[:-1], kd) in table for key in table for kd in kds)
    assert all((*key[:2], n, *key[3:]) in table for key in table for n in (1.33, 1.5, 2.0))
    white = [entry["total"].value for key, entry in table.items() if key[-1] == 1.0]
    assert np.max(white) < 2e-3


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    def command(scene, *words):
        file = tmp_path / "s.toml"
        file.write_text(scene.to_toml(), encoding="utf-8")
        monkeypatch.setattr(sys, "argv", ["microsurf", "advise", str(file), *words])
        entry.main()
        return capsys.readouterr().out

    return command


def test_advise_of_two_layers(run):
    """The keys of every advice; nothing is traced."""
    values = json.loads(run(scene(), "--tolerance", "0.03", "--json"))
    assert values.keys() >= {"rung", "error", "error_ci", "seconds", "alternatives"}
    assert values["rung"] == "IL facets"
    assert values["error"] == answer(scene()).deviation.value
    lobe = json.loads(run(scene(), "--tolerance", "0.03", "--quantity", "lobe", "--json"))
    assert lobe["rung"] is None
    assert lobe["error"] > 0.03
    assert "nothing is extrapolated" in run(scene(gap=100.0), "--tolerance", "0.03")
    with pytest.raises(SystemExit) as stopped:
        run(scene(), "--tolerance", "3")
    assert stopped.value.code == 2
