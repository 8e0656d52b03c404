"""The explorer in a real browser: its lobes are those of `microsurf predict`, its keys work."""

import base64
import json
import re

import numpy as np
import pytest
from browser import Browser, installed

from microsurf.model import Brdf, direction, predict
from microsurf.results import datasets
from microsurf.scene import Light, Material, Roughness, Scene
from microsurf.stats import intervals
from validation.explorer import page, traced

PAGE = traced.OUT / "explorer.html"
RIGHT, LEFT, END = ("ArrowRight", 39), ("ArrowLeft", 37), ("End", 35)

in_browser = pytest.mark.skipif(installed() is None, reason="no Chromium or Chrome on the path")


@pytest.fixture(scope="module")
def opened():
    with Browser() as browser:
        browser.open(PAGE)
        yield browser
        assert not browser.faults


def scene(settings):
    return Scene(
        material=Material(settings["n"], (settings["kd"],)),
        roughness=Roughness(settings["gamma"], (settings["sigma"],)),
        light=Light((settings["theta"],)),
    )


def random_settings(rng):
    return {
        "gamma": 1.5 + float(np.exp(rng.uniform(np.log(0.15), np.log(98.5)))),
        "sigma": float(rng.uniform(0.05, 1.2)),
        "n": float(rng.choice([1.0, rng.uniform(1, 2.5)])),
        "kd": float(rng.uniform(0, 1)),
        "theta": float(rng.uniform(0, 85)),
        "masking": str(rng.choice(page.MASKINGS)),
    }


TILE = re.compile(r'"data": "([^"]*)"')


def test_the_committed_page_is_that_of_its_sources():
    """Heights may differ by a step of their 16 bits: transforms round as the machine does."""
    new, old = page.page(), PAGE.read_text(encoding="utf-8")
    assert TILE.sub("", new) == TILE.sub("", old)
    for tiles in zip(TILE.findall(new), TILE.findall(old), strict=True):
        heights = [np.frombuffer(base64.b64decode(t), "<i2").astype(int) for t in tiles]
        np.testing.assert_allclose(*heights, atol=1)
    assert PAGE.stat().st_size < 5e6


def test_the_page_asks_no_server():
    text = PAGE.read_text(encoding="utf-8")
    for asks in ("http:", "https:", "src=", "import(", "fetch(", "<link", "@import", "url("):
        assert asks not in text.replace("url(#inside)", ""), asks


@in_browser
def test_lobes_are_those_of_the_model_at_200_settings(opened):
    """Specular and body, each within 1e−4 of the peak."""
    rng = np.random.default_rng(1)
    errors = []
    for _ in range(200):
        settings = random_settings(rng)
        angles = np.append(rng.uniform(-89, 89, 16), settings["theta"])
        lobes = opened.run(f"theory.lobes({json.dumps(settings)}, {angles.tolist()})")
        o = direction(np.radians(np.abs(angles)), np.where(angles > 0, np.pi, 0.0))
        i = np.broadcast_to(direction(np.radians(settings["theta"]), 0.0), o.shape)
        specular, body = Brdf(scene(settings), settings["masking"]).evaluate(i, o)
        peak = np.max(specular + body)
        errors.append(
            max(
                np.max(np.abs(np.array(lobes[key]) - exact)) / peak
                for key, exact in (("specular", specular), ("body", body))
            )
        )
    assert max(errors) < 1e-4, (int(np.argmax(errors)), max(errors))


@in_browser
def test_a_wrong_index_is_noticed(opened):
    """Negative control: n off by 2 % is more than the tolerance."""
    settings = {**page.START, "n": 1.53}
    o = direction(np.radians(60.0), np.pi)[None]
    right = sum(Brdf(scene(page.START), "smith").evaluate(direction(np.radians(60.0), 0)[None], o))
    wrong = opened.run(f"theory.lobes({json.dumps(settings)}, [60]).total[0]")
    assert abs(wrong / right[0] - 1) > 1e-2


@in_browser
@pytest.mark.parametrize(("gamma", "sigma", "theta"), [(2.0, 0.3, 75.0), (8.0, 0.3, 30.0)])
def test_what_is_drawn_is_the_mean_over_bins(opened, gamma, sigma, theta):
    settings = {**page.START, "gamma": gamma, "sigma": sigma, "theta": theta}
    opened.run(f"explorer.set({json.dumps(settings)})")
    drawn = opened.run("explorer.shown().lobes")
    theory = predict(scene(settings))
    flux = datasets.by_kind(theory.flux, settings["n"], settings["kd"])
    density = datasets.in_plane(datasets.brdf(flux).isel(theta_i=0, phi_i=0))
    exact = density.sel(order=1).isel(realisation=0)
    for kind in ("specular", "body"):
        error = np.array(drawn[kind]) - exact.sel(kind=kind).values
        assert np.max(np.abs(error)) < 0.01 * max(drawn["total"]), kind


@in_browser
def test_points_and_bands_are_those_of_the_surfaces(opened):
    opened.run(f"explorer.set({json.dumps(page.START)})")
    drawn = opened.run("explorer.shown().traced")
    content = json.loads((traced.OUT / "traced.json").read_text(encoding="utf-8"))
    start = {key: page.START[key] for key in ("gamma", "sigma", "n", "theta")}
    (one,) = (s for s in content["sets"] if start.items() <= s.items())
    for key, values in (
        ("all", one["all_orders"]),
        ("body", [[[], s[1]] for s in one["order_one"]]),
    ):
        weights = datasets.body_weights(len(values[0]), 1.5, page.START["kd"])
        curves = np.array(
            [sum(w * np.array(f) for w, f in zip(weights, s, strict=True) if f) for s in values]
        )
        np.testing.assert_allclose(drawn[key]["mean"], curves.mean(axis=0), rtol=1e-5)
        np.testing.assert_allclose(
            drawn[key]["band"], intervals.half_width_of_mean(curves), rtol=1e-4
        )


@in_browser
def test_the_page_is_used_by_keys_alone(opened):
    opened.run(f"explorer.set({json.dumps(page.START)})")
    order = []
    opened.run("document.activeElement.blur()")
    for _ in range(12):
        opened.press("Tab", 9)
        order.append(opened.run("document.activeElement.id || document.activeElement.tagName"))
    controls = ["gamma", "sigma", "n", "kd", "theta", "masking", "preset", "cursor", "scale"]
    assert [name for name in order if name in controls] == controls
    before = opened.run("explorer.shown().lobes.total")
    for name, key, expected in (
        ("gamma", RIGHT, 2.25), ("sigma", LEFT, 0.49), ("kd", END, 1), ("theta", RIGHT, 61),
        ("masking", ("ArrowDown", 40), "smith-separable"),
    ):  # fmt: skip
        opened.run(f"document.getElementById('{name}').focus()")
        opened.press(*key)
        assert opened.run(f"explorer.settings().{name}") == expected, name
    assert opened.run("explorer.shown().lobes.total") != before
    assert opened.run("explorer.shown().traced") is None
    assert "No surface was traced" in opened.run(
        "document.getElementById('has-traced').textContent"
    )
    assert opened.run("location.hash").startswith("#gamma=2.25&sigma=0.49&n=1.5&kd=1&theta=61")


@in_browser
def test_every_control_has_a_name_and_says_its_value(opened):
    tree = opened.send("Accessibility.getFullAXTree")["nodes"]
    used = [n for n in tree if n.get("role", {}).get("value") in ("slider", "combobox", "image")]
    assert len(used) >= 11
    assert all(node["name"]["value"] for node in used)
    opened.run("explorer.set({gamma: 2, theta: 30})")
    assert (
        opened.run("document.getElementById('gamma').getAttribute('aria-valuetext')") == "2 (GGX)"
    )


@in_browser
@pytest.mark.parametrize("width", [320, 390, 1400])
def test_nothing_sticks_out_of_the_window(opened, width):
    opened.open(PAGE, width, 800)
    assert opened.run("document.documentElement.scrollWidth") <= width


@in_browser
def test_the_plot_is_in_sight_while_a_slider_is_moved_on_a_phone(opened):
    opened.open(PAGE, 390, 800)
    box = "document.getElementById('{}').getBoundingClientRect()"
    for name in ("cursor", "theta", "sigma", "gamma"):
        opened.run(f"document.getElementById('{name}').focus()")
        top, bottom = opened.run(f"[{box.format('plot')}.top, {box.format('plot')}.bottom]")
        slider = opened.run(f"[{box.format(name)}.top, {box.format(name)}.bottom]")
        assert 0 <= top < bottom <= slider[0] < slider[1] <= 800, name


@in_browser
def test_lines_differ_in_their_dashes(opened):
    dashes = opened.run(
        "Array.from(document.querySelectorAll('[data-line]'),"
        " (line) => line.getAttribute('stroke-dasharray'))"
    )
    assert len(set(dashes)) == 3
