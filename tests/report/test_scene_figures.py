"""What is drawn is what the CSV says, large enough to read, and told apart without colour."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.text import Text

from microsurf.analysis import validate
from microsurf.model import MODELS, all_orders, of_layers, order_one
from microsurf.report import scene_figures
from microsurf.report.figures import albedo_by_order, lobes, overview, surface, verdicts
from microsurf.report.figures.style import QUANTITY_STYLE, WIDTH, source_style
from microsurf.scene import Accuracy, Layers, Light, Scene, Substrate, Surface

SCENE = Scene(
    surface=Surface(cells=16, realisations=2),
    light=Light((0.0, 30.0, 60.0)),
    accuracy=Accuracy(2000),
)


@pytest.fixture(scope="module")
def entry(few_walks):  # noqa: ARG001 - for its effect
    return validate.validate_scene("tiny", SCENE)


@pytest.fixture(scope="module")
def drawn(entry):
    """Rows and figure of each kind."""
    kd = 0.8
    results = (entry.measured, entry.predicted, entry.scene, kd)
    rows = {
        "effects": verdicts.rows(entry.comparisons),
        "overview": overview.rows({"tiny": entry.comparisons}),
        "lobes": lobes.rows(*results),
        "albedos": albedo_by_order.rows(*results),
        "relief": surface.rows(entry.heightfield, entry.scene),
    }
    figures = {
        "effects": verdicts.figure(rows["effects"]),
        "overview": overview.figure(rows["overview"]),
        "lobes": lobes.figure(rows["lobes"]),
        "albedos": albedo_by_order.figure(rows["albedos"]),
        "relief": surface.figure(rows["relief"], 2.0, "cells"),
    }
    return {name: (rows[name], figures[name]) for name in rows}


KINDS = ("effects", "overview", "lobes", "albedos", "relief")
AXES = {
    "effects": ("effect_percent", "y"), "overview": ("effect_percent", "x"),
    "lobes": ("brdf_per_sr", "y"), "albedos": ("albedo", "y"), "relief": ("y", "y"),
}  # fmt: skip


def _is_curve(line):
    """Neither a line across the panel nor the caps of error bars."""
    marker = line.get_marker()
    return marker not in ("_", "|") and (len(line.get_xdata()) > 2 or marker != "None")


@pytest.mark.parametrize("kind", KINDS)
def test_every_number_of_the_table_is_drawn_and_no_other(drawn, kind):
    rows, figure = drawn[kind]
    key, axis = AXES[kind]
    lines = [line for axes in figure.axes for line in axes.lines if _is_curve(line)]
    values = np.concatenate(
        [
            line.get_ydata(orig=False) if axis == "y" else line.get_xdata(orig=False)
            for line in lines
        ]
    )
    wanted = np.array([row[key] for row in rows])
    if kind == "lobes":  # of log axes
        wanted = wanted[wanted > 0]
    values = values[np.isfinite(values)]
    np.testing.assert_array_equal(np.sort(values), np.sort(wanted))


@pytest.mark.parametrize("kind", KINDS)
def test_letters_are_at_least_8_points_at_the_width_of_a_page(drawn, kind):
    _, figure = drawn[kind]
    assert figure.get_figwidth() <= WIDTH
    figure.draw_without_rendering()
    for text in figure.findobj(Text):
        if text.get_text() and text.get_visible():
            assert text.get_fontsize() >= 8, text.get_text()


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_is_clipped_at_the_edge(drawn, kind):
    _, figure = drawn[kind]
    figure.draw_without_rendering()
    box = figure.get_tightbbox()
    assert box.x0 >= -0.02
    assert box.y0 >= -0.02
    assert box.x1 <= figure.get_figwidth() + 0.02
    assert box.y1 <= figure.get_figheight() + 0.02


@pytest.mark.parametrize("kind", KINDS)
def test_axes_have_names(drawn, kind):
    _, figure = drawn[kind]
    axes = [a for a in figure.axes if a.get_visible()]
    assert any(a.get_xlabel() for a in axes)
    if kind != "overview":  # its lines are scenes
        assert axes[0].get_ylabel()


def test_curves_differ_without_colour():
    markers = [marker for _, marker, _ in QUANTITY_STYLE.values()]
    assert len(set(markers)) == len(markers)
    for keys in ([k for k in order_one() if k != "flat"], [*all_orders(), *of_layers()]):
        lines = [source_style(key).line for key in keys]
        assert len(set(lines)) == len(lines)
    drawn_together = [source_style(key).marker for key in (*MODELS, "measured", "surface")]
    assert len(set(drawn_together)) == len(drawn_together)


def test_a_legend_says_what_bands_are_if_there_are_any(drawn):
    rows, _ = drawn["lobes"]
    predicted = [row for row in rows if row["source"] != lobes.MEASURED]
    for shown, there in ((rows, True), (predicted, False)):
        texts = lobes.figure(shown).legends[0].get_texts()
        assert ("bands: 95 %" in {text.get_text() for text in texts}) is there


def captions(entry):
    return {picture.name: picture.caption for picture in scene_figures.of_scene(entry, "tiny")}


def test_captions_name_the_theories_of_all_orders(entry):
    """Of two layers there are two, one of them of IL facets; of a scene without a walk none."""
    shown = captions(entry)
    assert shown["tiny-lobes"].endswith("single scattering, black all orders by the Smith walk.")
    layered = replace(
        entry,
        scene=replace(SCENE, layers=Layers(40.0, Substrate(2.0, (0.5,)))),
        predicted={**entry.predicted, "layered-walk": entry.predicted["smith-walk"]},
    )
    both = "the Smith walk on IL facets of the interface and the layered walk."
    shown = captions(layered)
    assert shown["tiny-lobes"].endswith(f"all orders by {both}")
    assert shown["tiny-albedos"].endswith(f"higher orders against {both}")
    shown = captions(replace(entry, predicted={"smith": entry.predicted["smith"]}))
    assert shown["tiny-lobes"].endswith("coloured single scattering.")
    assert "higher orders" not in shown["tiny-albedos"]


def test_bands_are_those_of_the_surfaces(entry):
    """Two surfaces: t of one degree of freedom times half their difference."""
    row = next(
        r for r in albedo_by_order.rows(entry.measured, {}, entry.scene, 0.8)
        if r["order"] == 1 and r["theta_i_deg"] == 30
    )  # fmt: skip
    flux = entry.measured.microsurf.albedo_by_order(n=1.5, kd=0.8).sum("kind")
    one, two = flux.sel(order=1).isel(theta_i=1, phi_i=0).values
    assert row["albedo"] == pytest.approx((one + two) / 2, rel=1e-14)
    assert row["high"] - row["albedo"] == pytest.approx(12.7062 * abs(one - two) / 2, rel=1e-5)


def test_one_surface_has_no_bars_over_others(entry):
    alone = albedo_by_order.rows(entry.measured.isel(realisation=[0]), {}, entry.scene, 0.8)
    assert all("low" not in row for row in alone)
    albedo_by_order.figure(alone)


def test_a_model_of_ones_own_is_drawn(entry):
    """A user BRDF has no style of ours."""
    other = {"mine": entry.predicted["smith"]}
    for module in (lobes, albedo_by_order):
        figure = module.figure(module.rows(entry.measured, other, entry.scene, 0.8))
        assert "mine" in " ".join(t.get_text() for t in figure.legends[0].get_texts())


def test_many_scenes_are_cut_to_what_can_be_read(entry):
    rows = overview.rows({str(k): entry.comparisons for k in range(100)})
    assert len({row["scene"] for row in rows}) == overview.MOST


def test_scenes_without_comparisons_have_none(entry):
    assert overview.rows({"a": [], "b": []}) == []
    assert verdicts.rows(replace(entry, comparisons=[]).comparisons) == []
