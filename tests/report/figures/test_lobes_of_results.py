"""Results drawn together: each with its own material, and distinguished from the others."""

from dataclasses import replace

import numpy as np
import pytest

from microsurf import report
from microsurf.errors import InputError
from microsurf.model import predict
from microsurf.report.figures import lobes, lobes_of_results
from microsurf.scene import Light, Material, Roughness, Scene

SCENE = Scene(light=Light((40.0,)))


def predicted(model="smith", kd=0.8, scene=SCENE, **material):
    """A prediction at one Kd."""
    return predict(replace(scene, material=Material(kd=(kd,), **material)), model)


def curves(figure):
    """Numbers of each curve by its label."""
    handles, labels = figure.axes[0].get_legend_handles_labels()
    assert len(set(labels)) == len(labels)
    return {k: h.get_ydata() for k, h in zip(labels, handles, strict=True)}


def expected(dataset, kd, quantity="body"):
    """What `lobes.rows` has for a result alone at its own Kd."""
    scene = replace(SCENE, material=Material(kd=(kd,)))
    rows = lobes.rows(None, {"x": dataset}, scene, kd)
    return [r["brdf_per_sr"] for r in rows if r["quantity"] == quantity]


def test_files_of_one_name_are_all_drawn_each_at_its_own_kd():
    bright, dim = predicted(kd=0.8), predicted(kd=0.2)
    drawn = curves(lobes_of_results.figure({"a/ggx.nc": bright, "b/ggx.nc": dim}))
    for kd, dataset in ((0.8, bright), (0.2, dim)):
        found = drawn[f"Smith, Kd = {kd}, order-1 body"]
        np.testing.assert_array_equal(found, expected(dataset, kd))
    ratio = np.nanmean(drawn["Smith, Kd = 0.8, order-1 body"]) / np.nanmean(
        drawn["Smith, Kd = 0.2, order-1 body"]
    )
    assert ratio > 3


def test_a_kd_that_is_given_is_that_of_all():
    results = {"a.nc": predicted(kd=0.8), "b.nc": predicted("vcavity", kd=0.2)}
    drawn = curves(lobes_of_results.figure(results, 0.5))
    assert {label.split(",")[0] for label in drawn} == {"Smith", "V-cavity"}
    np.testing.assert_array_equal(drawn["Smith, order-1 body"], expected(results["a.nc"], 0.5))


def test_labels_say_what_differs_or_else_the_file():
    steep = predicted(scene=replace(SCENE, roughness=Roughness(3.0, (0.1, 0.4))), n=1.7)
    drawn = curves(lobes_of_results.figure({"a.nc": predicted(), "b.nc": steep}))
    assert {label.rpartition(", ")[0] for label in drawn} == {
        "Smith, n = 1.5, γ = 2, σ = 0.5", "Smith, n = 1.7, γ = 3, σ = 0.1 × 0.4",
    }  # fmt: skip
    files = ("/x/one/smith.nc", "/x/two/smith.nc")
    drawn = curves(lobes_of_results.figure(dict.fromkeys(files, predicted())))
    assert {label.rpartition(", ")[0] for label in drawn} == {
        "Smith (one/smith.nc)", "Smith (two/smith.nc)",
    }  # fmt: skip


def test_lines_of_one_colour_are_not_the_same():
    results = {f"{kd}.nc": predicted(kd=kd) for kd in (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)}
    handles = lobes_of_results.figure(results).axes[0].get_legend_handles_labels()[0]
    kinds = [(line.get_color(), str(line._unscaled_dash_pattern)) for line in handles]
    assert len(set(kinds)) == len(kinds) == 16
    with pytest.raises(InputError, match="look alike"):
        lobes_of_results.figure(results | {"9.nc": predicted(kd=0.9)})


def test_another_azimuth_is_refused_and_one_that_is_not_0_is_named(tmp_path):
    turned = predicted(scene=Scene(light=Light((40.0,), (30.0,))))
    with pytest.raises(InputError, match=r"b\.nc.*30°.*0°"):
        report.plot_results({"a.nc": predicted(), "b.nc": turned}, tmp_path / "x.svg")
    assert "30°" in lobes_of_results.figure({"b.nc": turned}).axes[0].get_title()


def test_what_reflects_nothing_is_named_beside_others_and_alone():
    dark = predicted(kd=0.0, n=1.0)
    both = lobes_of_results.figure({"dark.nc": dark, "bright.nc": predicted(kd=0.0)})
    labels = both.axes[0].get_legend_handles_labels()[1]
    assert set(labels) == {
        "Smith, n = 1: reflects nothing", "Smith, n = 1.5, order-1 specular",
    }  # fmt: skip
    alone = lobes_of_results.figure({"dark.nc": dark})
    assert alone.texts[0].get_text().startswith("nothing to show: ")


def test_what_a_user_wrote_is_no_formula(tmp_path):
    files = ("_run_$1_vs_$2.nc", "_run_$\\x$.nc")
    results = dict.fromkeys(files, predicted())
    report.plot_results(results, tmp_path / "x.svg")
    labels = lobes_of_results.figure(results).axes[0].get_legend_handles_labels()[1]
    assert len(set(labels)) == 4
