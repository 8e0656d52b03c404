"""Tables of f: read, interpolated, their error stated, or refused in one line."""

import itertools

import numpy as np
import pytest

from microsurf import model
from microsurf.errors import InputError
from microsurf.model import load_user_brdf, predict_user_brdf
from microsurf.scene import Light, Material, Roughness, Scene

HEAD = "theta_i,phi_i,theta_o,phi_o,f"
THETA_O = [0, 15, 30, 45, 60, 75, 90]
PHI_O = list(range(0, 360, 30))


def rows(theta_i=(20, 60), phi_i=(0,), theta_o=THETA_O, phi_o=PHI_O, f=lambda *_: 0.1):
    grid = itertools.product(theta_i, phi_i, theta_o, phi_o)
    return [f"{t},{p},{u},{q},{f(t, p, u, q)}" for t, p, u, q in grid]


def write(path, lines, head=HEAD):
    path.write_text("\n".join([head, *lines]) + "\n")
    return load_user_brdf(str(path))


@pytest.fixture
def file(tmp_path):
    return tmp_path / "own.csv"


def test_the_rows_come_back_whatever_their_order(file):
    def f(t, p, u, q):
        return 0.1 + t / 1e3 + p / 1e5 + u / 1e4 + np.cos(np.radians(q)) / 20

    lines = rows(phi_i=(0, 90), f=f)
    table = write(file, np.random.default_rng(0).permutation(lines)).table
    angles = np.array([[float(v) for v in line.split(",")] for line in lines])
    angles = angles[angles[:, 2] < 90]
    t, p, u, q = np.radians(angles[:, :4].T)
    np.testing.assert_allclose(
        table(model.direction(t, p), model.direction(np.maximum(u, 1e-9), q)), angles[:, 4],
        rtol=1e-7,
    )  # fmt: skip


def test_half_a_circle_is_mirrored_and_azimuths_count_from_the_light(file):
    def f(*angles):
        q = angles[-1]
        return 0.2 + 0.1 * np.cos(np.radians(q))

    table = write(file, rows(phi_o=range(0, 181, 30), f=f)).table
    i = model.direction(np.radians([20, 20, 20]), np.radians([0, 0, 100]))
    o = model.direction(np.radians(40), np.radians([60, -60, 160]))
    np.testing.assert_allclose(table(i, o), 0.25, rtol=1e-12)


def test_a_table_of_a_lobe_is_that_lobe_within_its_stated_error(file):
    """σ = 0.5 on a grid of 5°: albedo within what leaving out every second row changes."""
    scene = Scene(material=Material(1.5, (0.0,)), light=Light((20.0,)), roughness=Roughness())
    brdf = model.Brdf(scene, "smith")
    theta = [*range(0, 90, 5), 89.9]
    grid = np.array(list(itertools.product([20.0], [0.0], theta, range(0, 181, 5))))
    t, p, u, q = np.radians(grid.T)
    f, _ = brdf.evaluate(model.direction(t, p), model.direction(u, q))
    lines = [",".join(map(repr, map(float, (*row, v, 0)))) for row, v in zip(grid, f, strict=True)]
    own = write(file, lines, "theta_i,phi_i,theta_o,phi_o,f_specular,f_body")
    predicted = predict_user_brdf(own, scene)
    albedo = float(predicted.flux[0, 0, 0, 0, 0].sum())
    exact = float(model.predict(scene, "smith").flux.sum())
    stated = float(predicted.relative_error[0, 0, 0])
    assert abs(albedo / exact - 1) < stated < 0.05
    assert predicted.attrs["orders"] == "1"


@pytest.mark.parametrize(
    ("lines", "head", "words"),
    [
        (rows(), "theta_i,phi_i,theta_o,f", "no column phi_o"),
        (rows(), "theta_i,phi_i,theta_o,phi_o,g", "no column f_specular"),
        ([], HEAD, "holds no rows"),
        (rows()[:-1], HEAD, "full grid"),
        ([*rows(), rows()[0]], HEAD, "full grid"),
        ([*rows()[:-1], "20,0,x,0,1"], HEAD, "must be numbers"),
        ([*rows()[:-1], "20,0"], HEAD, "must be numbers"),
        ([*rows()[:-1], "60,0,90,330,0,1"], HEAD, "has 6 cells, its first line names 5; decimals"),
        (rows(), HEAD + ",f", "two columns f"),
        (rows(f=lambda *_: "nan"), HEAD, "row 1, f = nan"),
        (rows(f=lambda *_: -1), HEAD, "row 1, f = -1"),
        (rows(theta_i=(20, 95)), HEAD, "theta_i = 95"),
        (rows(theta_o=[0, 30, 60, 80]), HEAD, "theta_o from 0 to 89"),
        (rows(theta_o=[5, 30, 60, 90]), HEAD, "theta_o from 0"),
        (rows(phi_o=range(0, 151, 30)), HEAD, "all around"),
        (rows(phi_i=(0, 90), phi_o=range(0, 181, 30)), HEAD, "all around"),
        (rows(theta_i=("nan",)), HEAD, "theta_i = nan"),
    ],
)
def test_what_is_no_table_is_one_line(file, lines, head, words):
    with pytest.raises(InputError) as caught:
        write(file, lines, head)
    assert words in str(caught.value)
    assert "own.csv" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_bytes_that_are_no_text_are_one_line(file):
    file.write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(InputError, match="not a CSV"):
        load_user_brdf(str(file))


def test_incidence_is_not_interpolated(file):
    own = write(file, rows())
    with pytest.raises(InputError, match="no theta_i = 45, it has 20, 60"):
        model.examine(own, Scene(light=Light((20.0, 45.0))))
    own = write(file, rows(phi_i=(0, 90)))
    with pytest.raises(InputError, match="no phi_i = 30"):
        model.examine(own, Scene(light=Light((20.0,), (30.0,))))
    assert model.examine(own, Scene(light=Light((20.0,), (-270.0,)))) == []
