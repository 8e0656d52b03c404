"""Files of measured BRDFs: what is read, what is said, and what is refused in one line."""

import struct

import numpy as np
import pytest
from tensor_writer import example, write_tensors

from microsurf.errors import InputError
from microsurf.results.measured_brdf import read_brdf, write_csv

PBRT = """# a paint
2
450 550  # nm
0.5 0 0.5 3.14159265 1.5 2.5
0.5 0 0.2 3.0 0.1 0.2
1.0 0 1.0 3.14 9.0 8.0
"""
ASTM = """SAMPLE a plate
NUM_POINTS 3
VARS theta_i,phi_i,theta_s,phi_s,450nm,550nm
30,0,30,180,1.5,2.5
30,0,10,170,0.1,0.2
60,0,60,180,9,8
"""


def write(tmp_path, name, text):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


def refused(path, words):
    with pytest.raises(InputError, match=words) as caught:
        read_brdf(path)
    assert "\n" not in str(caught.value)
    assert path.name in str(caught.value)


def test_pbrt_gives_radians_wavelengths_and_values(tmp_path):
    brdf = read_brdf(write(tmp_path, "a.brdf", PBRT))
    assert brdf.wavelengths == (450.0, 550.0)
    assert brdf.channels == ("450 nm", "550 nm")
    assert np.allclose(brdf.theta_o, [0.5, 0.2, 1.0])
    assert np.array_equal(brdf.values, [[1.5, 2.5], [0.1, 0.2], [9, 8]])
    assert brdf.reader == "pbrt-v2 .brdf"


def test_astm_in_degrees_is_the_same_as_in_radians(tmp_path):
    degrees = read_brdf(write(tmp_path, "a.astm", ASTM))
    lines = ASTM.splitlines()
    for k in (3, 4, 5):
        words = [float(word) for word in lines[k].split(",")]
        lines[k] = ",".join(f"{v:.12g}" for v in [*np.radians(words[:4]), *words[4:]])
    radians = read_brdf(write(tmp_path, "b.astm", "\n".join(lines)))
    assert np.allclose(degrees.theta_i, np.radians([30, 30, 60]))
    assert np.allclose(degrees.theta_o, radians.theta_o, atol=1e-9)
    assert np.allclose(degrees.values, radians.values)
    assert "read as degrees" in degrees.remarks[0]
    assert "read as radians" in radians.remarks[0]


def test_csv_long_and_wide_are_the_same(tmp_path):
    wide = "theta_i,phi_i,theta_o,phi_o,f_450nm,f_550nm\n30,0,30,180,1.5,2.5\n30,0,10,170,0.1,\n"
    long = (
        "wavelength,theta_i,theta_o,phi_o,f\n450,30,30,180,1.5\n550,30,30,180,2.5\n"
        "450,30,10,170,0.1\n"
    )
    a, b = (read_brdf(write(tmp_path, f"{k}.csv", text)) for k, text in enumerate((wide, long)))
    order = np.argsort(b.theta_o)[::-1]
    assert a.channels == b.channels
    assert np.array_equal(a.values, b.values[order], equal_nan=True)
    assert np.array_equal(a.theta_o, b.theta_o[order])


def test_the_columns_of_a_goniometer_with_signed_incidence(tmp_path):
    text = (
        "lambda,thetai,phi,thetar,phir,f_r11,f_r12\n0.532,-30,0,30,0,0.5,9\n0.532,-30,0,0,0,0.3,9"
    )
    brdf = read_brdf(write(tmp_path, "p.csv", text))
    assert brdf.channels == ("532 nm",)
    assert np.allclose(brdf.theta_i, np.radians(30))
    assert np.allclose(np.cos(brdf.phi_o - brdf.phi_i), -1)  # phir = 0 is forward
    assert any("minus sign" in remark for remark in brdf.remarks)
    # Rows come sorted by their angles.
    assert np.array_equal(np.sort(brdf.values[:, 0]), [0.3, 0.5])


def test_what_is_odd_is_said(tmp_path):
    rows = ["theta_i,phi_i,theta_o,phi_o,f_R"]
    rows += [f"40,0,{t},180,{v}" for t, v in ((10, -0.01), (20, 7), (30, 7), (40, 7), (50, 7))]
    rows += ["40,0,95,180,1", "40,0,60,180,0", "40,0,61,180,0", "40,0,62,180,1e38"]
    brdf = read_brdf(write(tmp_path, "odd.csv", "\n".join(rows)))
    said = " | ".join(brdf.remarks)
    for words in (
        "1 of 9 pairs at or below the horizon",
        "negative (down to -0.01",
        "saturation? 4 pairs of channel R",
        "2 of 7 values are exactly 0",
        "1 values below −1/cosθ or above",
    ):
        assert words in said
    assert brdf.pairs == 7


def test_an_infinite_value_of_one_channel_is_left_out_and_said(tmp_path):
    text = "theta_i,theta_o,phi_o,f_R,f_G\n10,20,180,inf,0.2\n10,30,180,0.1,nan\n"
    brdf = read_brdf(write(tmp_path, "a.csv", text))
    np.testing.assert_array_equal(brdf.values, [[np.nan, 0.2], [0.1, np.nan]])
    assert "1 values below −1/cosθ or above" in " | ".join(brdf.remarks)


def test_a_lobe_on_the_side_of_the_light_is_said(tmp_path):
    rows = ["theta_i,phi_i,theta_o,phi_o,f"]
    rows += [f"40,0,{t},0,5" for t in (30, 40, 50)] + [f"40,0,{t},180,0.1" for t in (30, 40, 50)]
    brdf = read_brdf(write(tmp_path, "back.csv", "\n".join(rows)))
    assert any("side of the light" in remark for remark in brdf.remarks)


def test_csv_out_reads_back_with_all_digits(tmp_path):
    brdf = read_brdf(write(tmp_path, "a.brdf", PBRT))
    write_csv(brdf, tmp_path / "out.csv")
    again = read_brdf(tmp_path / "out.csv")
    assert again.wavelengths == brdf.wavelengths
    assert np.array_equal(again.values, brdf.values)
    assert np.allclose(again.phi_o, brdf.phi_o, rtol=1e-15)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("cut.brdf", PBRT[:-5], "multiple of 6"),
        ("other.brdf", "theta_i,phi_i\n", "number of wavelengths"),
        ("waves.brdf", "5\n450 550\n", "2 of 5 wavelengths"),
        ("degrees.brdf", PBRT.replace("0.5 0 0.5", "30 0 30"), "radians"),
        ("word.brdf", PBRT.replace("9.0", "oops"), "'oops' is not a number"),
        ("empty.brdf", "", "empty"),
        ("cut.astm", ASTM.replace("60,0,60,180,9,8\n", ""), "NUM_POINTS 3, and 2 rows"),
        ("row.astm", ASTM.replace("60,0,60,180,9,8", "60,0,60"), "3 fields where 6"),
        ("other.astm", PBRT, "no line VARS"),
        ("vars.astm", ASTM.replace("theta_s", "x"), "must be theta_i"),
        ("none.csv", "a,b\n1,2\n", "no column theta_i"),
        ("value.csv", "theta_i,theta_o,phi_o,g\n1,2,3,4\n", "no column f"),
        ("cut.csv", "theta_i,theta_o,phi_o,f\n1,2\n", "line 2 has 2 fields where 4"),
        ("head.csv", "theta_i,theta_o,phi_o,f\n", "no row of numbers"),
        ("below.csv", "theta_i,theta_o,phi_o,f\n95,2,3,4\n", "none of 1 pairs"),
        ("nan.csv", "theta_i,theta_o,phi_o,f\nnan,2,3,4\n", "no finite number"),
        ("twice.csv", "theta_i,theta_o,phi_o,f_R,f_R\n1,2,3,4,5\n", "two columns of one name"),
        ("gap.csv", "theta_i,theta_o,phi_o,f_R,f_G\n1,2,3,4,\n5,6,7,8,\n", "no usable value at G"),
        ("unnamed.csv", "theta_i,theta_o,phi_o,f_R,f_\n1,2,3,4,5\n", "f_ has no wavelength"),
        ("nm.csv", "theta_i,theta_o,phi_o,f_nm\n1,2,3,4\n", "f_nm has no wavelength"),
        ("often.csv", "theta_i,theta_o,phi_o,f\n1,2,3,4\n1,2,3,5\n", "add a column wavelength"),
        ("semi.csv", "theta_i;theta_o;phi_o;f\n1,5;2;3;4\n", "separated by commas"),
        (
            "nist.csv",
            "thetai,thetar,phir,f_r11,f_r12/f_r11\n1,2,3,4,5\n",
            "without a column lambda",
        ),
        ("infinite.csv", "theta_i,theta_o,phi_o,f\n1,2,3,inf\n", "none of 1 pairs"),
        ("new.xyz", "1", "unknown ending"),
        ("zero.csv", "theta\x00", "not a text"),
    ],
)
def test_bad_files_are_refused_in_one_line(tmp_path, name, text, words):
    refused(write(tmp_path, name, text), words)


def test_a_missing_file_is_refused(tmp_path):
    refused(tmp_path / "no.csv", "no such file")


# --- MERL ---------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def merl(tmp_path_factory):
    """A table that holds cosθ_i cosθ_o of each cell's centre, by vectors and not by our angles."""
    path = tmp_path_factory.mktemp("merl") / "m.binary"
    h, d, p = np.meshgrid(*(np.arange(n) + 0.5 for n in (90, 90, 180)), indexing="ij")
    theta_h, theta_d, phi_d = (h / 90) ** 2 * np.pi / 2, d / 90 * np.pi / 2, p / 180 * np.pi
    half = np.stack([np.sin(theta_h), 0 * theta_h, np.cos(theta_h)], -1)
    along = np.stack([np.cos(theta_h), 0 * theta_h, -np.sin(theta_h)], -1)
    across = np.array([0.0, 1.0, 0.0])
    s, c = np.sin(theta_d), np.cos(theta_d)
    i = (
        half * c[..., None]
        + along * (s * np.cos(phi_d))[..., None]
        + across * (s * np.sin(phi_d))[..., None]
    )
    o = 2 * np.sum(i * half, -1, keepdims=True) * half - i
    value = np.where((i[..., 2] > 0) & (o[..., 2] > 0), i[..., 2] * o[..., 2], -1.0)
    table = np.stack([value * scale for scale in (1500, 1500 / 1.15, 1500 / 1.66)])
    path.write_bytes(struct.pack("<3i", 90, 90, 180) + table.astype("<f8").tobytes())
    return path


def test_merl_cells_are_read_at_their_directions(merl):
    brdf = read_brdf(merl)
    assert brdf.channels == ("R", "G", "B")
    expected = np.cos(brdf.theta_i) * np.cos(brdf.theta_o)
    assert np.allclose(brdf.values, expected[:, None], rtol=1e-9, atol=1e-12)
    assert 0.5e6 < brdf.pairs < 1.3e6


def test_a_cut_table_of_merl_is_refused(merl, tmp_path):
    path = tmp_path / "cut.binary"
    path.write_bytes(merl.read_bytes()[:-8])
    refused(path, "truncated or damaged")
    path.write_bytes(struct.pack("<3i", 90, 90, 360))
    refused(path, "90, 90 and 180")


# --- RGL ----------------------------------------------------------------------------------


@pytest.mark.parametrize("isotropic", [True, False])
@pytest.mark.parametrize("jacobian", [0, 1])
def test_rgl_is_what_mitsuba_evaluates(tmp_path, isotropic, jacobian):
    """At all pairs but at normal incidence, where the azimuth of the light is convention."""
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    path = tmp_path / "made.bsdf"
    write_tensors(path, example(jacobian, isotropic=isotropic))
    brdf = read_brdf(path)
    bsdf = mi.load_dict({"type": "measured", "filename": str(path)})
    si, context, compared = mi.SurfaceInteraction3f(), mi.BSDFContext(), 0
    turn = np.abs(np.abs(brdf.phi_i) - np.pi) > 1e-3
    half = brdf.light + brdf.detector
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    inner = (half[:, 2] < 0.9999) & (np.abs(half[:, 1]) > 1e-3)
    for k in np.flatnonzero((brdf.theta_i > 0.1) & (turn | isotropic) & inner):
        si.wi = mi.Vector3f(*brdf.light[k])
        seen = np.array(bsdf.eval(context, si, mi.Vector3f(*brdf.detector[k])))
        assert np.allclose(seen, brdf.values[k] * np.cos(brdf.theta_o[k]), rtol=2e-3)
        compared += 1
    assert compared > 80


def test_rgl_spectra_have_wavelengths(tmp_path):
    path = tmp_path / "s.bsdf"
    write_tensors(path, example(spectral=True))
    assert read_brdf(path).wavelengths == (450.0, 500.0, 550.0, 600.0)


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (lambda raw: raw[:-100], "ends beyond the file"),
        (lambda raw: raw[:40], "truncated"),
        (lambda raw: b"x" + raw[1:], "not RGL"),
        (lambda raw: raw[:14] + b"\xff\xff\xff\xff" + raw[18:], "fields: must be"),
        (lambda raw: raw.replace(b"vndf", b"vndg"), "no field vndf"),
        (lambda raw: raw.replace(b"theta_i", b"sheta_i"), "no field theta_i"),
    ],
)
def test_damaged_tensor_files_are_refused(tmp_path, damage, words):
    path = tmp_path / "bad.bsdf"
    write_tensors(path, example())
    path.write_bytes(damage(path.read_bytes()))
    refused(path, words)


def test_fields_of_another_shape_are_refused(tmp_path):
    fields = example()
    fields["vndf"] = fields["vndf"][:, :3]
    write_tensors(tmp_path / "bad.bsdf", fields)
    refused(tmp_path / "bad.bsdf", "shapes")
