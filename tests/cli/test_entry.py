"""The command line as a user meets it: figures, errors of one line, exit codes, no half files."""

import csv
import io
import json
import os
import resource
import signal
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import children
import forked
import numpy as np
import pytest
import xarray as xr

from microsurf.analysis.self_test import SelfTest
from microsurf.cli import entry, group
from microsurf.invariants import Invariant
from microsurf.model import all_orders, order_one
from microsurf.results import datasets
from microsurf.scene import STRUCTURES
from microsurf.surface import read_surface, write_endings

SURFACE = ("--gamma", "2", "--sigma", "0.5", "--cells", "16")
TINY = (*SURFACE, "--paths", "2000", "--realisations", "2")
pytestmark = pytest.mark.usefixtures("few_walks")

COMMANDS = ("surface", "measure", "predict", "validate", "convergence", "plot")
VALIDATE = import_module("microsurf.cli.validate")
BY_ANGLE_AND_KD = ("albedo", "albedo_se")
BY_ORDER = ("albedo_by_order", "specular_by_order", "body_by_order")
SCENE = """
title = "tiny"
[surface]
cells = 16
realisations = 2
[light]
theta = [60]
[accuracy]
paths = 2000
"""


class Ran:
    """What a run of the command line came to."""

    def __init__(self, code, out, err):
        self.code, self.out, self.err = code, out, err

    @property
    def json(self):
        """The one object on stdout; strict: no NaN, nothing else there."""
        assert self.code == 0, self.err
        assert self.out.count("\n") == 1
        return json.loads(self.out, parse_constant=lambda word: pytest.fail(f"{word} in JSON"))


@pytest.fixture
def run(monkeypatch, capsys, tmp_path):
    """Run the command line inside this process and an empty folder."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["microsurf", *map(str, arguments)])
        capsys.readouterr()
        code = 0
        try:
            entry.main()
        except SystemExit as end:
            code = end.code or 0
        out, err = capsys.readouterr()
        return Ran(code, out, err)

    return call


@pytest.fixture
def refused(run, tmp_path):
    """Run what must be refused: code 2, one line that names the culprit, nothing left behind."""

    def call(*arguments, names, code=2):
        before = sorted(tmp_path.rglob("*"))
        ran = run(*arguments)
        assert ran.code == code, (arguments, ran.out, ran.err)
        assert ran.out == ""
        assert ran.err.startswith("microsurf: ")
        assert ran.err.endswith("\n")
        assert ran.err.count("\n") == 1
        assert "Traceback" not in ran.err
        for word in [names] if isinstance(names, str) else names:
            assert word in ran.err, (word, ran.err)
        assert sorted(tmp_path.rglob("*")) == before
        return ran.err

    return call


# What the commands give


def shape(value):
    """How lists are nested."""
    return (len(value), *shape(value[0])) if isinstance(value, list) else ()


def test_surface_says_what_it_made(run):
    made = run("surface", *SURFACE, "--seed", "7", "--out", "s.npz", "--json").json
    wanted = {
        "gamma": 2.0, "sigma_x": 0.5, "sigma_y": 0.5, "cells": 16, "correlation": 8.0,
        "structure": "independent", "seed": 7, "file": "s.npz",
    }  # fmt: skip
    assert {key: made[key] for key in wanted} == wanted
    assert isinstance(made["iterations"], int)
    assert set(made["tail"]) >= {"max_slope", "area_beyond"}
    assert {float(q) for q in made["quantiles"]} == {0.5, 0.9, 0.99, 0.999}
    assert set(made["height_slope"]) == {"height", "distance"}
    assert all(isinstance(made[k], float) for k in ("ks", "Sq", "Sa", "Sdq", "Sdr", "seconds"))


def test_structure_is_made_measured_and_kept(run):
    rough = (*SURFACE, "--cells", "64", "--correlation", "4", "--seed", "3")
    made = {
        name: run("surface", *rough, "--structure", name, "--out", f"{name}.npz", "--json").json
        for name in STRUCTURES
    }
    assert [made[name]["structure"] for name in STRUCTURES] == list(STRUCTURES)
    assert made["tops"]["height_slope"]["height"] > 0.3
    assert made["extremes"]["height_slope"]["distance"] > 0.3
    assert read_surface(Path("middle.npz")).recipe["structure"] == "middle"
    # Independent and steep at the tops: other light, of the same seed and rays.
    traced = [
        run("measure", *rough, "--realisations", "1", "--paths", "2000", "--theta", "60",
            "--structure", name, "--json").json["albedo"]
        for name in ("independent", "tops")
    ]  # fmt: skip
    assert traced[0] != traced[1]


@pytest.mark.parametrize("ending", write_endings())
def test_every_format_is_written_and_traced(run, ending):
    made = run("surface", *SURFACE, "--sigma-y", "0.3", "--out", f"s{ending}", "--json").json
    assert (made["sigma_x"], made["sigma_y"]) == (0.5, 0.3)
    traced = run("measure", "--surface", f"s{ending}", "--paths", "500", "--theta", "30", "--json")
    assert 0 < traced.json["albedo"] < 1


@pytest.mark.parametrize(
    ("angles", "kd", "nesting", "directions"),
    [
        (("--theta", "60"), "0.8", (), 1),
        (("--theta", "0,60"), "0.8", (2,), 2),
        (("--theta", "60"), "0.2,0.5,0.8", (3,), 1),
        (("--theta", "0,60"), "0.2,0.5,0.8", (2, 3), 2),
        (("--theta", "0,60", "--phi", "0,45,90"), "0.8", (6,), 6),
    ],
)
def test_figures_are_lists_over_angles_and_then_over_kd(run, angles, kd, nesting, directions):
    measured = run("measure", *TINY, *angles, "--kd", kd, "--json").json
    predicted = run("predict", *SURFACE[:4], *angles, "--kd", kd, "--json").json
    for found in (measured, predicted):
        for key in BY_ANGLE_AND_KD:
            assert shape(found[key]) == nesting, key
        for key in BY_ORDER:
            assert shape(found[key]) == (*nesting, 4), key
    assert shape(measured["lost"]) == ((directions,) if directions > 1 else ())
    assert measured["paths"] == 2 * 2000 * directions  # realisations × paths × angles
    assert set(measured["lost_by_cause"]) == {"below", "behind", "wrapped"}
    assert all(isinstance(n, int) for n in measured["lost_by_cause"].values())
    assert measured["rays"] >= measured["paths"]
    assert measured["seconds"] > 0
    assert measured["paths_per_second"] == pytest.approx(measured["paths"] / measured["seconds"])
    assert predicted["model"] == "smith"
    assert predicted["lost"] == 0
    assert not np.any(predicted["albedo_se"])


def test_orders_and_kinds_add_up_to_the_albedo(run):
    found = run("measure", *TINY, "--theta", "0,60", "--kd", "0.2,0.8", "--json").json
    specular, body, both = (
        np.array(found[f"{k}_by_order"]) for k in ("specular", "body", "albedo")
    )
    np.testing.assert_allclose(specular + body, both, rtol=1e-12)
    np.testing.assert_allclose(both.sum(-1), found["albedo"], rtol=1e-12)
    # One trace for both: what does not enter the substrate is the same.
    np.testing.assert_array_equal(specular[:, 0], specular[:, 1])
    assert (body[:, 1] > body[:, 0]).all()


def test_the_table_for_people_has_the_same_keys(run):
    arguments = ("measure", *TINY, "--theta", "30,60")
    keys = list(run(*arguments, "--json").json)
    ran = run(*arguments)
    assert [line.split()[0] for line in ran.out.splitlines()] == keys
    assert ran.err == ""


def test_a_black_surface_has_a_table_too(run):
    ran = run("measure", "--sigma", "0", "--n", "1", "--kd", "0", "--paths", "100", "--theta", "10")
    assert "nothing is reflected" in ran.out


def test_options_override_the_scene(run):
    Path("scene.toml").write_text(SCENE + '[expect.total]\nverdict = ["holds"]\n')
    plain = run("measure", "scene.toml", "--json").json
    assert plain["paths"] == 4000
    wanted = ("--theta", "10,20,30", "--paths", "100", "--realisations", "1", "--cells", "8")
    other = run("measure", "scene.toml", *wanted, "--gamma", "9", "--kd", "0", "--json").json
    assert other["paths"] == 300
    assert shape(other["albedo"]) == (3,)
    assert not np.any(other["body_by_order"])
    rough, anisotropic = (
        run("predict", "scene.toml", "--kd", "0", *more, "--json").json["albedo"]
        for more in ((), ("--sigma-y", "0.1"))
    )
    assert rough != anisotropic


@pytest.mark.parametrize("name", [*order_one(), *all_orders()])
def test_directions_come_back_as_rows(run, name):
    rows = [(30, 0, 10, 180), (30, 0, 10, 90), (75.5, -20, 0, 0)]
    text = "theta_i,phi_i,theta_o,phi_o\n" + "\n".join(",".join(map(str, r)) for r in rows)
    Path("d.csv").write_text(text)
    ran = run("predict", *SURFACE[:4], "--model", name, "--directions", "d.csv")
    assert ran.code == 0
    found = list(csv.reader(io.StringIO(ran.out)))
    assert found[0] == ["theta_i", "phi_i", "theta_o", "phi_o", "f_specular", "f_body", "f"]
    values = np.array(found[1:], dtype=float)
    np.testing.assert_array_equal(values[:, :4], rows)
    np.testing.assert_allclose(values[:, 4] + values[:, 5], values[:, 6], rtol=1e-15)
    assert (values[:, 5] > 0).all()


def test_csv_of_a_spreadsheet_is_read(run):
    """With a byte-order mark, spaces, quotes, other columns and Windows line ends."""
    Path("d.csv").write_bytes(
        '\ufeffname, theta_i, phi_i, theta_o, phi_o\r\na, "30", 0, 10, 180\r\n'.encode()
    )
    ran = run("predict", *SURFACE[:4], "--directions", "d.csv")
    assert ran.code == 0
    assert ran.out.splitlines()[1].startswith("30.0,0.0,10.0,180.0,")
    Path("d.csv").write_text(
        "theta_i ,phi_i , theta_o,\tphi_o,,\n ,\n 30 ,0 ,10, 180 ,,\n,,,,,\n\n", encoding="utf-8"
    )
    assert run("predict", *SURFACE[:4], "--directions", "d.csv").out == ran.out


def piped(text, *arguments, name="-"):
    """What the command prints of this on its standard input."""
    ran = forked.run(forked.MAIN, *(name if a is None else str(a) for a in arguments), content=text)
    assert ran.returncode == 0, ran.stderr
    return ran.stdout


@pytest.mark.skipif(not Path("/dev/stdin").exists(), reason="needs /dev/stdin")
@pytest.mark.parametrize("name", ["-", "/dev/stdin"])
def test_what_is_piped_in_is_read_as_a_file_is(run, name):
    text = CSV + "30,0,10,180\n"
    Path("d.csv").write_text(text)
    asked = ("predict", *SURFACE[:4], "--directions")
    assert piped(text.encode(), *asked, None, name=name) == run(*asked, "d.csv").out
    Path("scene.toml").write_text(SCENE)
    asked = ("predict", None, "--theta", "30")
    values = run("predict", "scene.toml", "--theta", "30", "--json").json
    found = json.loads(piped(SCENE.encode(), *asked, "--json", name=name))
    assert {**found, "seconds": 0} == {**values, "seconds": 0}


@pytest.mark.skipif(not Path("/dev/stdin").exists(), reason="needs /dev/stdin")
def test_a_piped_scene_keeps_its_mesh_and_finds_its_surface(run):
    """The file is asked twice: for the scene, and whether it names a mesh."""
    assert run("surface", *SURFACE, "--out", "s.npz").code == 0
    text = '[surface]\nfile = "s.npz"\n[accuracy]\npaths = 100\n'
    assert json.loads(piped(text.encode(), "measure", None, "--json"))["paths"] == 400
    text = "[surface]\ncells = 8\nrealisations = 2\n[accuracy]\nstandard_error = 0.1\n"
    dry = json.loads(piped(text.encode(), "measure", None, "--dry-run", "--json"))
    assert dry["cells"] == 8


def test_a_result_through_a_link_lies_where_the_link_leads(run):
    Path("elsewhere").mkdir()
    for name, command in (
        ("m.nc", ("measure", *TINY, "--theta", "60")),
        ("p.nc", ("predict", *SURFACE[:4], "--theta", "60")),
        ("s.npz", ("surface", *SURFACE)),
    ):
        Path(name).symlink_to(Path("elsewhere") / name)
        assert run(*command, "--out", name).code == 0
        assert Path(name).is_symlink()
        assert Path("elsewhere", name).is_file()
    assert len(list(Path("elsewhere").iterdir())) == 3
    piped(Path("m.nc").read_bytes(), "plot", None, "--out", "l.png")


def test_results_are_written_and_plotted(run):
    written = run("measure", *TINY, "--theta", "60", "--out", "m.nc", "--json").json
    assert written["file"] == "m.nc"
    assert run("predict", *SURFACE[:4], "--theta", "60", "--out", "p.nc").code == 0
    saved = datasets.load(Path("m.nc"))
    assert saved.attrs["source"] == "measurement"
    assert saved.sizes["realisation"] == 2
    for ending, magic in ((".png", b"\x89PNG"), (".pdf", b"%PDF"), (".svg", b"<?xml")):
        assert run("plot", "m.nc", "p.nc", "--out", f"l{ending}", "--json").json == {
            "file": f"l{ending}"
        }
        assert Path(f"l{ending}").read_bytes().startswith(magic)


def test_seeds_of_any_size_are_kept(run):
    """netCDF-4 has no whole numbers beyond 64 bits."""
    for seed in (2**31, 2**63, 10**30):
        options = (*TINY, "--theta", "60", "--seed", seed, "--out", "m.nc")
        assert run("measure", *options).code == 0
        assert int(datasets.load(Path("m.nc")).attrs["seed"]) == seed


def test_same_seed_same_figures_whatever_the_workers(run):
    one, two, other = (
        run("measure", *TINY, "--theta", "60", *more, "--json").json["albedo"]
        for more in (("--workers", "1"), ("--workers", "3"), ("--seed", "1"))
    )
    assert one == two != other


@pytest.mark.parametrize("command", COMMANDS)
def test_help_has_an_example_that_parses(run, command):
    text = run(command, "--help").out
    example = next(line for line in text.splitlines() if line.strip().startswith("Example:"))
    words = example.split()
    assert words[1:3] == ["microsurf", command]
    options = [word for word in words if word.startswith("--")]
    assert all(option in text.replace("Example", "", 1) for option in options)


def test_without_arguments_there_is_help(run):
    ran = run()
    assert ran.code == 0
    listed = [line.split()[0] for line in ran.out.partition("Commands:")[2].splitlines()[1:]]
    assert listed == sorted(group.COMMANDS)


def test_every_file_of_a_command_is_one_that_help_lists():
    files = Path(group.__file__).parent.glob("*.py")
    commands = {path.stem for path in files if "@click.command(" in path.read_text("utf-8")}
    assert commands == {*group.COMMANDS}
    assert all(group.cli.commands[name].name == name for name in commands)
    assert group.cli.commands.get("group") is None  # negative control


# Bad input

NUMBERS = [
    ("--gamma", "1.5", "> 1.5"),
    ("--gamma", "nan", "finite"),
    ("--gamma", "inf", "finite"),
    ("--gamma", "two", "'two'"),
    ("--sigma", "-0.1", "0 (flat)"),
    ("--sigma", "nan", "finite"),
    ("--sigma", "1e-300", "1e-6"),
    ("--sigma", "1001", "1000"),
    ("--sigma-y", "nan", "finite"),
    ("--sigma-y", "-1", "0 (flat)"),
    ("--sigma-y", "0", "both"),
    ("--n", "0.99", "1 (no interface) … 100"),
    ("--n", "nan", "finite"),
    ("--n", "1e300", "100"),
    ("--k", "-1", "0 (a dielectric) … 100"),
    ("--k", "101", "100"),
    ("--k", "nan", "finite"),
    ("--kd", "-0.01", "0 … 1"),
    ("--kd", "1.01", "0 … 1"),
    ("--kd", "nan", "finite"),
    ("--kd", "0.2,,0.3", "'0.2,,0.3'"),
    ("--kd", "0.2,nan", "finite"),
    ("--theta", "90", "0 ≤ θ < 90"),
    ("--theta", "-1", "0 ≤ θ < 90"),
    ("--theta", "nan", "finite"),
    ("--theta", "0,30,0", "without repetition"),
    ("--theta", "", "''"),
    ("--phi", "nan", "finite"),
    ("--phi", "1e300", "−360 … 360"),
    ("--phi", "0,0", "without repetition"),
    ("--paths", "0", "1 … 1000000000000"),
    ("--paths", "-1", "1 … 1000000000000"),
    ("--paths", "nan", "'nan'"),
    ("--realisations", "0", "1 … 10000"),
    ("--seed", "-1", "x>=0"),
    ("--workers", "0", "1<=x<="),
    ("--workers", "1000000", "1<=x<="),
    ("--cells", "0", "2 … 16384"),
    ("--cells", "1", "2 … 16384"),
    ("--cells", "nan", "'nan'"),
    ("--correlation", "0", "0.5"),
    ("--correlation", "nan", "finite"),
    ("--spacing", "0", "1e-30"),
    ("--spacing", "nan", "finite"),
    ("--structure", "fractal", "independent"),
    ("--boundary", "open", "periodic"),
    ("--boundary", "mirror", "surface.file"),
    ("--level", "cubic", "quadratic"),
    ("--level", "plane", "surface.file"),
]


@pytest.mark.parametrize(("option", "value", "allowed"), NUMBERS)
def test_bad_options_are_refused(refused, option, value, allowed):
    name = option[2:].split("-")[0]
    refused("measure", *TINY, option, value, "--out", "m.nc", names=(name, allowed))
    if option in ("--gamma", "--sigma", "--sigma-y", "--cells", "--correlation", "--seed"):
        refused("surface", *SURFACE, option, value, "--out", "s.npz", names=(name, allowed))
    if option in ("--gamma", "--sigma", "--sigma-y", "--n", "--k", "--kd", "--theta", "--phi"):
        refused("predict", *SURFACE[:4], option, value, "--out", "p.nc", names=(name, allowed))


def test_memory_is_said_beforehand(refused):
    """100000² cells at 120 bytes are 1118 GiB, 16384² 30 GiB; 1e5 lobes are 2 TB."""
    for command in ("surface", "measure"):
        out = ("--out", "s.npz") if command == "surface" else ()
        refused(
            command, *SURFACE, "--cells", "100000", *out,
            names=("100000", "1117.6 GiB", "16384", "30.0 GiB"),
        )  # fmt: skip
    many = ",".join(f"{k * 9e-4:.6f}" for k in range(100_000))
    refused("measure", *SURFACE, "--theta", many, names=("100000 angles", "GiB", "take fewer"))


def test_memory_that_is_not_free_is_not_taken(refused, monkeypatch):
    monkeypatch.setattr("microsurf.memory.available", lambda: 2.0**30)
    for command in ("surface", "measure"):
        out = ("--out", "s.npz") if command == "surface" else ()
        refused(command, *SURFACE, "--cells", "8192", *out, names=("GiB", "1.0 GiB are free"))


@pytest.mark.parametrize(
    ("arguments", "names"),
    [
        (("measure",), "--gamma and --sigma"),
        (("measure", "--gamma", "2"), "--gamma and --sigma"),
        (("measure", "--sigma-y", "0.3", "--gamma", "2"), "--gamma and --sigma"),
        (("predict", "--sigma", "0.3"), "--gamma and --sigma"),
        (("surface", "--gamma", "2", "--out", "s.npz"), "--sigma"),
        (("surface", *SURFACE), "--out"),
        (("predict", *SURFACE[:4], "--model", "guess"), ("guess", "smith")),
        (("measure", "--gamm", "2"), ("--gamm", "--gamma")),
        (("mesure",), "mesure"),
        (("measure", "a.toml", "b.toml"), "b.toml"),
        (("measure", "missing.toml"), ("missing.toml", "no such file")),
        (("predict", "."), "is a folder"),
        (("validate", "missing.toml", "--out", "."), ("missing.toml", "no such file")),
        (("measure", "x" * 300), "can't be read"),
        (("measure", "--surface", "missing.npy"), ("missing.npy", "no such file")),
        (("measure", "--surface", "."), "is a folder"),
        (("plot", "--out", "l.png"), "FILE.nc"),
        (("plot", "missing.nc", "--out", "l.png"), ("missing.nc", "no such file")),
    ],
)
def test_what_is_missing_or_unknown_is_named(refused, arguments, names):
    refused(*arguments, names=names)


def test_a_flat_scene_needs_no_gamma_and_a_flat_model_no_roughness(run):
    traced = run("measure", "--sigma", "0", "--paths", "500", "--theta", "60", "--json").json
    flat = run("predict", "--theta", "60", "--model", "flat", "--json").json
    assert traced["albedo"] == pytest.approx(flat["albedo"], rel=1e-12)


@pytest.mark.parametrize(
    "option",
    [
        ("--gamma", "2"), ("--sigma", "0.5"), ("--sigma-y", "0.5"), ("--cells", "8"),
        ("--correlation", "4"), ("--structure", "independent"), ("--realisations", "2"),
    ],
)  # fmt: skip
def test_a_surface_from_a_file_takes_no_recipe(refused, option):
    np.save("h.npy", np.zeros((4, 4)))
    Path("scene.toml").write_text('[surface]\nfile = "h.npy"\n')
    refused("measure", "--surface", "h.npy", *option, names=(option[0], "h.npy", "leave it out"))
    refused("measure", "scene.toml", *option, names=(option[0], "h.npy", "leave it out"))


def test_what_a_file_leaves_open_is_said(run):
    """On stderr before tracing, also with --json, where it is `notes` too."""
    made = ("surface", "--gamma", "2", "--sigma", "0.5", "--cells", "64", "--seed", "3")
    ran = run(*made, "--spacing", "0.1", "--out", "h.npy")
    assert "h.npy: bare heights, their spacing is not in the file" in ran.err
    assert run(*made, "--spacing", "0.1", "--out", "h.npz").err == ""
    traced = ("measure", "--paths", "500", "--theta", "30", "--json", "--surface")
    ran = run(*traced, "h.npy")
    assert ran.code == 0
    assert "taken as spacing 1 in the unit of its heights and periodic" in ran.err
    assert f"microsurf: note: {json.loads(ran.out)['notes'][0]}\n" in ran.err
    ran = run(*traced, "h.npz")
    assert "taken as" not in ran.err


def test_heights_in_another_unit_are_refused(run, refused):
    run("surface", "--gamma", "2", "--sigma", "0.5", "--cells", "16", "--out", "h.npy")
    np.save("h.npy", np.load("h.npy") * 1e-8)
    names = ("h.npy", "median slope", "5e-07 … 2000", "same unit")
    refused("measure", "--surface", "h.npy", names=names)
    Path("scene.toml").write_text('[surface]\nfile = "h.npy"\n')
    refused("validate", "scene.toml", names=names)
    refused("convergence", "scene.toml", names=names)


def test_the_roughness_of_a_file_is_not_guessed(run, refused):
    np.save("h.npy", np.zeros((4, 4)))
    Path("scene.toml").write_text('[surface]\nfile = "h.npy"\n[light]\ntheta = [60]\n')
    refused("predict", "scene.toml", names=("h.npy", "--gamma and --sigma", "validate"))
    assert run("predict", "scene.toml", "--gamma", "2", "--sigma", "0.3").code == 0
    stated = Path("scene.toml").read_text() + "[roughness]\ngamma = 2.0\n"
    Path("scene.toml").write_text(stated)
    refused("predict", "scene.toml", names=("h.npy", "of unknown roughness"))


def test_the_slopes_that_a_fit_wrote_into_a_scene_are_predicted(run):
    text = '[surface]\nfile = "h.npy"\n[light]\ntheta = [60]\n[roughness]\ngamma = 2.5\nsigma = '
    for sigma, options, said in (
        ("0.3", ("--sigma", "0.3"), False),
        ("[0.3, 0.2]", ("--sigma", "0.3", "--sigma-y", "0.2"), True),
    ):
        Path("scene.toml").write_text(text + sigma)
        ran = run("predict", "scene.toml", "--json")
        assert ran.code == 0
        assert ("turns them to the axes of the lay" in ran.err) is said
        asked = run("predict", "--gamma", "2.5", *options, "--theta", "60", "--json")
        assert json.loads(ran.out)["albedo"] == json.loads(asked.out)["albedo"]


HEIGHTS = {
    "one ∞": (np.array([[0, np.inf], [0, 0]]), "1 of 4 are infinite"),
    "all NaN": (np.full((2, 2), np.nan), "voids"),
    "1 × 1": (np.zeros((1, 1)), "(1, 1)"),
    "one row": (np.zeros((1, 5)), "(1, 5)"),
    "empty": (np.zeros((0, 4)), "(0, 4)"),
    "3-D": (np.zeros((3, 3, 3)), "two dimensions"),
    "1-D": (np.zeros(9), "two dimensions"),
    "object": (np.array([[None, 1], [2, 3]], dtype=object), "real numbers"),
    "complex": (np.zeros((4, 4), complex), "real numbers"),
    "text": (np.array([["a", "b"], ["c", "d"]]), "real numbers"),
    "too steep": (np.array([[1e308, -1e308], [0, 0]]), "finite"),
}


@pytest.mark.parametrize("case", HEIGHTS)
def test_bad_heights_are_refused(refused, case):
    heights, names = HEIGHTS[case]
    np.save("h.npy", heights, allow_pickle=True)
    refused("measure", "--surface", "h.npy", "--out", "m.nc", names=("h.npy", names))


def test_what_was_not_measured_is_filled_aloud_or_refused(run, refused):
    np.save("h.npy", np.where(np.eye(4)[:, ::-1] > 0, np.nan, 0.0)[:, :2])
    asked = ("measure", "--surface", "h.npy", "--paths", "100")
    refused(*asked, "--voids", "refuse", names=("h.npy", "2 of 8 points"))
    ran = run(*asked)
    assert ran.code == 0
    assert "not measured: filled" in ran.err


@pytest.mark.parametrize("ending", write_endings())
@pytest.mark.parametrize("part", [0.0, 0.01, 0.5, 0.98])
def test_truncated_surfaces_are_refused(run, refused, ending, part):
    assert run("surface", *SURFACE, "--out", f"s{ending}").code == 0
    whole = Path(f"s{ending}").read_bytes()
    Path(f"t{ending}").write_bytes(whole[: int(part * len(whole))])
    refused("measure", "--surface", f"t{ending}", "--out", "m.nc", names=f"t{ending}")


@pytest.mark.parametrize("part", [0.0, 0.001, 0.5, 0.999])
def test_truncated_results_and_scenes_are_refused(run, refused, part):
    assert run("measure", *TINY, "--theta", "60", "--out", "m.nc").code == 0
    whole = Path("m.nc").read_bytes()
    Path("t.nc").write_bytes(whole[: int(part * len(whole))])
    refused("plot", "t.nc", "--out", "l.png", names=("t.nc", "measure it again"))
    Path("t.toml").write_text('title = "cut off')
    refused("measure", "t.toml", names=("t.toml", "not a scene"))


def test_foreign_files_are_refused(run, refused):
    Path("h.bin").write_bytes(b"0 0 0")
    refused("measure", "--surface", "h.bin", names=("'.bin'", ".npz"))
    Path("t.toml").write_bytes(b"\xff\xfe\x00")
    refused("measure", "t.toml", names=("t.toml", "UTF-8"))
    Path("t.toml").write_text("a" * 1_000_001)
    refused("measure", "t.toml", names="too large")
    Path("t.toml").write_text("x = " + "[" * 3000)
    refused("measure", "t.toml", names="nested too deeply")
    xr.Dataset({"x": 1}).to_netcdf("f.nc", engine="h5netcdf")
    refused("plot", "f.nc", "--out", "l.png", names=("f.nc", "not a result"))
    assert run("measure", *TINY, "--theta", "60", "--out", "m.nc").code == 0
    refused("plot", "m.nc", "--out", "l.png", "--kd", "nan", names="material.kd")
    refused("plot", "m.nc", "--out", "l.png", "--kd", "2", names=("material.kd", "0 … 1"))


CSV = "theta_i,phi_i,theta_o,phi_o\n"


@pytest.mark.parametrize(
    ("text", "names"),
    [
        (CSV + "30,0,10,0\n30,0,nan,0\n", ("direction 2", "theta_o = 'nan'", "0 ≤ θ < 90")),
        (CSV + "90,0,10,0\n", ("direction 1", "theta_i = '90'")),
        (CSV + "-1,0,10,0\n", "theta_i = '-1'"),
        (CSV + "1,inf,10,0\n", ("phi_i = 'inf'", "−360 … 360")),
        (CSV + "1,2\n", "theta_o"),
        (CSV + "a,2,3,4\n", "theta_i = 'a'"),
        (CSV, "holds no directions"),
        ("", "no column theta_i"),
        ("30,0,10,0\n", "no column theta_i"),
        ("theta_i;phi_i;theta_o;phi_o\n1;2;3;4\n", "no column theta_i"),
        ("theta_i,phi_i,theta_o\n1,2,3\n", "no column phi_o"),
        (CSV + "30,0,10,0\n\n30,5,0,10,0\n", ("row 2 has 5 cells", "names 4", "a point")),
        ("theta_i,phi_i,theta_o,phi_o, theta_i\n1,2,3,4,5\n", "two columns theta_i"),
    ],
)
def test_bad_directions_are_refused(refused, text, names):
    Path("d.csv").write_text(text)
    refused("predict", *SURFACE[:4], "--directions", "d.csv", names=names)


@pytest.mark.parametrize(
    "more", [("--json",), ("--out", "p.nc"), ("--theta", "30"), ("--phi", "0"), ("--kd", "0.1,0.2")]
)
def test_directions_stand_alone(refused, more):
    Path("d.csv").write_text(CSV + "30,0,10,0\n")
    refused(
        "predict", *SURFACE[:4], "--directions", "d.csv", *more, names=("--directions", more[0])
    )


# Where it can't write, or not finish


@pytest.mark.parametrize(
    ("folder", "names"),
    [
        ("missing/", "does not exist"),
        ("/proc/", "can't be written"),
        ("file/", "does not exist"),
        ("x" * 300, "can't be written"),
    ],
)
@pytest.mark.skipif(not Path("/proc/self").exists(), reason="needs /proc, where nobody can write")
def test_unwritable_outputs_are_refused_before_the_work(refused, monkeypatch, folder, names):
    monkeypatch.setattr("microsurf.cli.measure.measure", lambda *_, **__: pytest.fail("ran"))
    Path("file").touch()
    refused("measure", *TINY, "--out", f"{folder}m.nc", names=names)
    refused("surface", *SURFACE, "--out", f"{folder}s.npz", names=names)
    refused("predict", *SURFACE[:4], "--out", f"{folder}p.nc", names=names)


def test_an_output_with_another_ending_or_a_folder_is_refused(refused, tmp_path):
    (tmp_path / "folder.nc").mkdir()
    for out, names in (("m.txt", ("m.txt", ".nc")), ("m", ".nc"), ("folder.nc", "is a folder")):
        refused("measure", *TINY, "--out", out, names=names)
    refused("surface", *SURFACE, "--out", "s.xyz", names=write_endings())
    Path("scene.toml").write_text(SCENE)
    refused("validate", "scene.toml", "--out", "scene.toml", names="can't be made a folder")
    refused("validate", "scene.toml", "scene.toml", "--out", "r", names="same name")


@pytest.mark.parametrize("ending", write_endings())
def test_a_full_disk_ends_with_3_and_leaves_nothing(refused, ending):
    """The process may write no more than 1000 bytes a file: for it the disk is full."""
    usual = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, usual[1]))
    try:
        refused("surface", *SURFACE, "--out", f"s{ending}", names="could not be written", code=3)
        if ending == ".npz":
            refused("measure", *TINY, "--out", "m.nc", names="could not be written", code=3)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, usual)


def test_a_failed_write_keeps_what_was_there(run, tmp_path, monkeypatch):
    Path("s.npz").write_bytes(b"before")

    def full(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    ran = run("surface", *SURFACE, "--out", "s.npz")
    assert (ran.code, ran.err.count("\n")) == (3, 1)
    assert "No space left on device" in ran.err
    assert [p.name for p in tmp_path.iterdir()] == ["s.npz"]
    assert Path("s.npz").read_bytes() == b"before"


@pytest.fixture
def checked(monkeypatch, undrawn):  # noqa: ARG001 - as it is for its effect
    """What microsurf itself comes to takes a minute: here it came to the invariants given."""

    def give(*invariants):
        found = SelfTest(list(invariants), None, "2020-01-01 00:00")
        monkeypatch.setattr(VALIDATE, "self_test", lambda *_, **__: found)

    give()
    return give


@pytest.mark.usefixtures("checked")
def test_an_unexpected_verdict_is_1(run):
    """A flat surface is a flat surface, so a margin of 50 % holds."""
    for verdict, code in (("departs", 1), ("holds", 0)):
        expected = f'[expect.total]\nverdict = "{verdict}"\nmargin = 0.5\n'
        text = SCENE + "[roughness]\nsigma = 0\n" + expected
        Path("scene.toml").write_text(text)
        ran = run("validate", "scene.toml", "--out", "r", "--json")
        found = json.loads(ran.out)
        assert ran.code == code
        assert found["unexpected"] == len(found["findings"]) == code
        assert ran.err.count("unexpected: scene: total albedo, θ_i = 60°") == code
        assert found["scenes"] == ["scene"]
        assert set(found["verdicts"]) == {"holds", "departs", "undecided"}
        assert sum(found["verdicts"].values()) == 3
        assert found["out"] == "r"
        assert found["seconds"] > 0
        assert found["broken"] == []


def test_a_broken_invariant_is_1(run, checked):
    checked(Invariant("reciprocity", "f(i, o) = f(o, i)", 6.0, 5.0, "|z|"))
    Path("scene.toml").write_text(SCENE + "[roughness]\nsigma = 0\n")
    ran = run("validate", "scene.toml", "--out", "r", "--json")
    found = json.loads(ran.out)
    assert ran.code == 1
    assert found["unexpected"] == 1
    assert found["broken"] == ["reciprocity: 6, must be ≤ 5 (f(i, o) = f(o, i))"]


OWN = """import numpy as np
def lambert(i, o): return np.full(len(o), 0.5 / np.pi)
def dark(i, o): return np.full(len(o), 0.25 / np.pi)
def bad(i, o): return -lambert(i, o)
def huge(i, o): return np.full(len(o), 1.7e308)
"""
LAMBERT = "[material]\nn = 1.0\nkd = 0.5\n[roughness]\nsigma = 0\n[light]\ntheta = [60]\n"


@pytest.mark.usefixtures("checked")
def test_a_user_brdf_stands_in_the_models_place(run, refused, monkeypatch):
    """n = 1 and σ = 0 is Lambert's, so that a callable of one line is right or wrong."""
    monkeypatch.setattr(sys, "path", list(sys.path))
    Path("own_lambert.py").write_text(OWN)
    Path("scene.toml").write_text(LAMBERT + "[accuracy]\npaths = 2000\n")
    options = ("validate", "scene.toml", "--out", "r", "--json", "--model")
    found = run(*options, "own_lambert:lambert").json
    assert found["verdicts"] == {"holds": 1, "departs": 0, "undecided": 0}
    ran = run(*options, "own_lambert:dark")
    assert ran.code == 1
    findings = json.loads(ran.out)["findings"]
    assert "user BRDF -50.00 % from flat: the user BRDF's own" in findings[0]
    assert "total albedo, θ_i = 60°" in findings[0]
    assert {p.name for p in Path("r").iterdir()} >= {
        "report.html", "report.json", "report.md", "junit.xml"
    }  # fmt: skip
    for name, words in (
        ("own_lambert:bad", "must be from 0 to 1e+30"),
        ("own_lambert:huge", "must be from 0 to 1e+30"),
        ("own_lambert:none", "no attribute 'none'"),
        ("nowhere:f", "can't be imported"),
        ("smith", "package.module:callable"),
        ("t.csv", "no such file"),
    ):
        refused("validate", "scene.toml", "--out", "q", "--model", name, names=(name, words))
    sys.modules.pop("own_lambert")


@pytest.mark.usefixtures("checked")
def test_what_moved_is_told_and_does_not_change_the_exit_code(run, refused):
    scene = LAMBERT + "[accuracy]\npaths = 2000\n"
    Path("scene.toml").write_text(scene)
    run("validate", "scene.toml", "--out", "r")
    again = ("validate", "scene.toml", "--out", "r", "--baseline", "r/report.json")
    assert run(*again, "--json").json["moved"] == []
    old = json.loads(Path("r/report.json").read_text())
    old["scenes"][0]["comparisons"][0]["measured"] = 0.4
    Path("old.json").write_text(json.dumps(old))
    options = ("validate", "scene.toml", "--out", "r", "--baseline", "old.json")
    moved = run(*options, "--json").json["moved"]
    assert {m["figure"] for m in moved} == {"measured"}
    ran = run(*options)
    assert ran.code == 0
    assert "moved: scene: order-1 body albedo, θ_i = 60°" in ran.out
    old["schema"] = 1
    Path("old.json").write_text(json.dumps(old))
    refused(*options, names=("--baseline old.json", "schema = 1"))
    refused(*options[:-1], "none.json", names=("none.json", "no such file"))


# As processes of their own

MICROSURF = Path(sys.executable).with_name("microsurf")


def test_interrupted_is_130_with_one_line_and_no_half_file(run, tmp_path):
    assert run("measure", *TINY, "--theta", "60").code == 0  # what has to be compiled, now is
    options = ("--theta", "60", "--paths", "100000000", "--out", str(tmp_path / "m.nc"))
    with children.start("measure", *SURFACE, *options) as process:
        try:
            children.wait_for_work(process, 2)  # reading what is compiled takes less
            process.send_signal(signal.SIGINT)
            _, err = process.communicate(timeout=30)
        finally:
            process.kill()
    assert process.returncode == 130
    assert err == "microsurf: interrupted\n"
    assert [path.name for path in tmp_path.iterdir()] == ["m.nc.parts"]  # see test_survival


LAYERED = """[layers]
gap = 5.0
[layers.substrate]
gamma = 8.0
sigma = 0.5
"""


def test_layers_from_the_command_line(run):
    Path("layered.toml").write_text(LAYERED)
    Path("d.csv").write_text("theta_i,phi_i,theta_o,phi_o\n30,0,10,90\n")
    walk = ("predict", "layered.toml", "--model", "layered-walk", "--paths", "2000")
    found = json.loads(run(*walk, "--kd", "1", "--theta", "60", "--json").out)
    assert found["albedo"] == pytest.approx(1, abs=1e-12)
    assert found["lost"] == 0
    ran = run(*walk, "--directions", "d.csv")
    assert ran.code == 0
    assert float(ran.out.splitlines()[1].split(",")[-1]) == pytest.approx(0.2, abs=0.1)
    for refused in (
        run("predict", *SURFACE[:4], "--model", "layered-walk"),
        run("predict", "layered.toml", "--model", "smith-walk"),
        run("predict", "layered.toml", "--directions", "d.csv"),
        run("validate", "layered.toml", "--model", "no.such:brdf"),
        run("export", "layered.toml", "--out", "material.bsdf"),
        run("tradeoff", "layered.toml", "--out", "folder"),
        run("convergence", "layered.toml", "--out", "folder"),
    ):
        assert refused.code == 2
        assert refused.err.count("\n") == 1
        assert "[layers]" in refused.err
    assert sorted(path.name for path in Path().iterdir()) == ["d.csv", "layered.toml"]


@pytest.mark.parametrize("command", ["measure", "validate"])
def test_what_two_layers_take_is_said_before(run, command):
    """And surfaces that cross are refused."""
    small = ("--paths", "2000", "--realisations", "2", "--dry-run")
    text = LAYERED.replace("5.0", "9.0") + "[surface]\ncells = 32\ncorrelation = 4.0\n"
    Path("layered.toml").write_text(text)
    ran = run(command, "layered.toml", *small, "--json")
    assert ran.code == 0, ran.err
    said = json.loads(ran.out)
    plan = said if command == "measure" else said["scenes"]["layered"]
    assert plan["paths"] == 2000
    assert plan["mesh_error"] is None
    assert "of one surface only" in plan["notes"][0]
    Path("layered.toml").write_text(text.replace("9.0", "0.01"))
    ran = run(command, "layered.toml", *small)
    assert (ran.code, ran.err.count("\n")) == (2, 1)
    assert "cross" in ran.err


def test_conductors_from_the_command_line(run):
    rough = ("--gamma", "2", "--sigma", "0.3", "--theta", "60", "--n", "0.43", "--k", "2.455")
    for name in (*order_one(), *all_orders()):
        ran = run("predict", *rough, "--model", name, "--json", "--paths", "20000")
        assert ran.code == 0, ran.err
        found = json.loads(ran.out)
        assert 0.5 < found["albedo"] < 1
        assert max(found["body_by_order"]) == 0
    ran = run("measure", *rough, "--cells", "32", "--paths", "20000", "--json")
    assert 0.5 < json.loads(ran.out)["albedo"] < 1


def test_a_reader_that_leaves_is_no_error(tmp_path):
    table = tmp_path / "d.csv"
    table.write_text(CSV + "".join(f"30,0,{k * 0.02:.2f},180\n" for k in range(4000)))
    with subprocess.Popen(  # noqa: S603 - our own command
        [MICROSURF, "predict", *SURFACE[:4], "--model", "flat", "--directions", str(table)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        assert process.stdout.readline().startswith("theta_i")
        process.stdout.close()
        assert process.stderr.read() == ""
    assert process.returncode == 0


@pytest.mark.skipif(os.name == "nt", reason="needs a shell that closes stderr")
def test_closed_stderr_is_no_error():
    ran = subprocess.run(  # noqa: S603 - our own command
        ["/bin/sh", "-c", 'exec "$0" "$@" 2>&-', str(MICROSURF), "measure", *TINY, "--json"],
        stdout=subprocess.PIPE, check=False,
    )  # fmt: skip
    assert ran.returncode == 0
    assert "albedo" in json.loads(ran.stdout)


@pytest.mark.parametrize("name", all_orders())
def test_walks_answer_with_all_orders_and_an_error(run, name):
    roughness = ("--gamma", "2", "--sigma", "0.5", "--theta", "60")
    ran = run("predict", *roughness, "--model", name, "--paths", "20000", "--json")
    assert ran.code == 0
    found = json.loads(ran.out)
    assert found["model"] == name
    assert found["lost"] == 0
    assert found["albedo_se"] > 0
    assert abs(sum(found["albedo_by_order"]) - found["albedo"]) < 1e-12
    assert found["albedo_by_order"][1] > 0.01
    first = json.loads(
        run("predict", *roughness, "--model", name.removesuffix("-walk"), "--json").out
    )
    assert abs(found["albedo_by_order"][0] - first["albedo"]) < 0.02


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="threads are counted by Linux")
@pytest.mark.parametrize(("given", "alone"), [({}, True), ({"OPENBLAS_NUM_THREADS": "2"}, False)])
def test_numpy_multiplies_in_one_thread_but_for_a_user_who_says_otherwise(given, alone):
    """A second one of numpy's own waits for cores that rays keep busy."""
    code = (
        "import os, sys; sys.argv[1:] = ['--version']; from microsurf.cli import main\n"
        "try: main()\nexcept SystemExit: pass\n"
        "import numpy; numpy.ones((500, 500)) @ numpy.ones((500, 500))\n"
        "print(len(os.listdir('/proc/self/task')))"
    )
    if len(os.sched_getaffinity(0)) < 2:
        pytest.skip("one core has one thread")
    environment = {k: v for k, v in os.environ.items() if k != "OPENBLAS_NUM_THREADS"} | given
    ran = subprocess.run(  # noqa: S603 - our own
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    assert (int(ran.stdout.split()[-1]) == 1) == alone
