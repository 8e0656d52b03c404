"""Instruments' files: units, pixel, orientation, channels, voids, and what is refused.

Real files are read where MICROSURF_DATA names their folder.
"""

import os
import warnings
from pathlib import Path

import numpy as np
import pytest
import x3pio
from PIL import Image

from microsurf.errors import InputError
from microsurf.surface import (
    Heightfield,
    facet_slopes,
    read_endings,
    read_surface,
    write_surface,
)
from microsurf.surface.readers import surface_topography

DATA = os.environ.get("MICROSURF_DATA")
measured = pytest.mark.skipif(not DATA, reason="set MICROSURF_DATA to the measured surfaces")


def topography(name):
    return Path(str(DATA)) / "topography" / name


def library():
    """SurfaceTopography, which warns on import about the MPI it does without."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import SurfaceTopography.IO  # noqa: PLC0415 - 2 s, only where it is needed
    return SurfaceTopography


def stored_topography(h):
    """SurfaceTopography's own object of a surface in µm, heights [x, y]."""
    rows, columns = h.heights.shape
    sizes = (columns * h.pixel[0], rows * h.pixel[1])
    return library().Topography(h.heights.T, sizes, unit="µm")


@measured
@pytest.mark.parametrize(
    ("name", "format_", "shape", "pixel", "unit"),
    [
        ("al3d-1.al3d", "al3d", (296, 200), 0.438027, "m"),
        ("di-3.di", "di", (256, 256), 0.0390625, "nm"),
        ("di-4.di", "di", (512, 512), 0.01953125, "nm"),
        ("example_ps.tiff", "ps", (512, 512), 0.001953125, "µm"),
        ("frt-2.frt", "frt", (300, 150), 200.0, "m"),
        ("metropro-1.dat", "metropro", (480, 640), 1.0982520279867458, "m"),
    ],
)
def test_measured_files(name, format_, shape, pixel, unit):
    found = read_surface(topography(name))
    assert found.heights.shape == shape
    assert found.pixel == pytest.approx((pixel, pixel), rel=1e-9)
    assert found.boundary == "mirror"
    provenance = found.provenance
    assert provenance["reader"].startswith("SurfaceTopography 1.")
    assert (provenance["format"], provenance["unit"], provenance["unit_in_file"]) == (
        format_,
        "µm",
        unit,
    )
    assert provenance["orientation"] == "seen from above, x to the right, y down"
    voids = 12314 / 45000 if format_ == "frt" else 0.0
    assert provenance["voids"]["share"] == pytest.approx(voids)
    assert (found.filled is not None) == (voids > 0)


@measured
@pytest.mark.parametrize("name", ["al3d-1.al3d", "di-3.di", "di-4.di", "example_ps.tiff"])
def test_heights_are_those_published_beside_the_files(name):
    """Transposed, without their mean, and in single precision, as they were published."""
    published = np.load(topography(name).with_suffix(".npy")).T.astype(float)
    heights = read_surface(topography(name)).heights
    difference = heights - heights.mean() - (published - published.mean())
    rounding = np.abs(published).max() * 2**-24
    assert np.abs(difference).max() < max(1e-7, 1.1 * rounding)
    # Negative control: no other orientation is as near.
    for turned in (published[::-1], published[:, ::-1]):
        assert np.abs(heights - heights.mean() - turned).max() > 1e-3


@measured
@pytest.mark.parametrize(
    ("name", "start", "number", "shape", "void", "turned"),
    [
        # The phases end the file, the upper row first.
        ("metropro-1.dat", -480 * 640 * 4, ">i4", (480, 640), None, False),
        # Behind the head of block 0x000B; the lower row is first, and 1 marks a void.
        ("frt-2.frt", 140, "<u2", (300, 150), 1, True),
    ],
)
def test_heights_are_those_of_the_bytes(name, start, number, shape, void, turned):
    """Rows, columns and voids against numbers decoded here; no other orientation agrees."""
    words = np.frombuffer(topography(name).read_bytes()[start:], number, count=np.prod(shape))
    upright = words.reshape(shape)[:: -1 if turned else 1].astype(float)
    found = read_surface(topography(name))
    known = np.ones(shape, bool) if void is None else upright != void
    assert np.array_equal(found.filled if void else ~known, ~known)
    heights, numbers = found.heights[known], upright[known]
    unit = np.ptp(heights) / np.ptp(numbers)
    assert np.ptp(heights - unit * numbers) < 1e-9 * np.ptp(heights)
    for other in (upright[::-1], upright[:, ::-1], upright[::-1, ::-1]):
        assert np.ptp(heights - unit * other[known]) > 0.01 * np.ptp(heights)


@measured
def test_both_forms_of_x3p_give_the_same():
    text, binary = (topography(f"ISO5436-sample1{kind}.x3p") for kind in ("", "_bin"))
    for path in (text, binary):
        with pytest.raises(InputError, match="pixel would be 16016"):
            read_surface(path)
    ours = [read_surface(path, spacing=16.016) for path in (text, binary)]
    assert np.array_equal(ours[0].heights, ours[1].heights)
    assert np.array_equal(ours[0].filled, ours[1].filled)
    # y points up in the file: its first row is our last.
    assert ours[0].heights[-1, :2] == pytest.approx([0.48621912e6, 0.00346341e6], rel=1e-5)
    assert ours[0].filled.nonzero() == ([2], [3])


@measured
def test_a_pixel_of_a_third_of_a_metre_is_refused():
    with pytest.raises(InputError, match=r"312500 × 312500 µm; must be 0\.0001 … 1000"):
        read_surface(topography("nms-1.nms"))
    found = read_surface(topography("nms-1.nms"), spacing=0.3125)
    assert found.pixel == (0.3125, 0.3125)


@measured
def test_channels_are_chosen_or_listed():
    path = topography("di-3.di")
    default, named, numbered = (read_surface(path, channel=c) for c in (None, "Height", "1"))
    assert default.provenance["channel"] == "ZSensor"
    assert default.provenance["channels"] == ["ZSensor", "Height"]  # no errors, no phases
    assert np.array_equal(named.heights, numbered.heights)
    assert not np.array_equal(named.heights, default.heights)
    with pytest.raises(InputError, match="0 = 'ZSensor', 1 = 'Height'"):
        read_surface(path, channel="Phase")


AFTER_THE_HEIGHTS = {("al3d-1.al3d", 0.9), ("frt-2.frt", 0.9), ("nms-1.nms", 0.9)}
"""Files and how much of them is kept, where what is cut off is not heights."""


@measured
@pytest.mark.parametrize("keep", [0, 1, 100, 0.1, 0.5, 0.9])
@pytest.mark.parametrize(
    "name",
    ["al3d-1.al3d", "di-3.di", "example_ps.tiff", "frt-2.frt", "metropro-1.dat", "nms-1.nms",
     "ISO5436-sample1.x3p", "ISO5436-sample1_bin.x3p"],
)  # fmt: skip
def test_truncated_files_are_refused_or_whole(tmp_path, name, keep):
    """What some formats hold after the heights may be missing: the heights may not."""
    spacing = {"nms": 0.3125, "x3p": 16.016}.get(name.split(".")[-1])
    whole = topography(name).read_bytes()
    path = tmp_path / name
    path.write_bytes(whole[: keep if keep >= 1 else int(keep * len(whole))])
    if (name, keep) in AFTER_THE_HEIGHTS:
        found, all_of_it = (read_surface(f, spacing=spacing) for f in (path, topography(name)))
        assert np.array_equal(found.heights, all_of_it.heights)
        return
    with pytest.raises(InputError, match=str(path)) as caught:
        read_surface(path, spacing=spacing)
    assert "\n" not in str(caught.value)


def test_a_park_tiff_without_its_heights_was_cut_short(tmp_path):
    """A mark and nothing behind it, as Pillow sees a file of which half is there."""
    path = tmp_path / "s.tiff"
    image = Image.fromarray(np.zeros((8, 8), np.uint8))
    image.save(path, tiffinfo={50432: 0x0E031301})
    with pytest.raises(InputError, match="ends before its heights do"):
        read_surface(path)


@measured
def test_half_a_park_tiff_was_cut_short(tmp_path):
    whole = topography("example_ps.tiff").read_bytes()
    path = tmp_path / "half.tiff"
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match="ends before its heights do"):
        read_surface(path)


@measured
@pytest.mark.parametrize("ending", [".al3d", ".di", ".tiff", ".frt", ".dat", ".x3p", ".png"])
def test_another_format_under_an_ending_is_refused(tmp_path, ending):
    for name in ("al3d-1.al3d", "di-3.di", "metropro-1.dat", "ISO5436-sample1.x3p"):
        if not name.endswith(ending):
            path = tmp_path / f"s{ending}"
            path.write_bytes(topography(name).read_bytes())
            with pytest.raises(InputError, match=str(path)) as caught:
                read_surface(path, spacing=16.016, height_unit="µm" if ending == ".png" else None)
            assert "\n" not in str(caught.value)


@pytest.fixture(scope="module")
def lopsided():
    """A map that no turn and no mirror leaves as it is, on an oblong pixel."""
    y, x = np.mgrid[:11, :17]
    return Heightfield(0.3 * x + 0.02 * x**2 + 0.1 * y - 0.004 * x * y**2, (0.5, 0.75), "mirror")


@pytest.mark.parametrize("format_", ["x3p", "nc", "gwy", "npz", "ply"])
def test_orientation_and_oblong_pixels_survive_every_format(tmp_path, lopsided, format_):
    path = tmp_path / f"s.{format_}"
    if format_ in ("nc", "gwy"):
        write = getattr(stored_topography(lopsided), {"nc": "to_netcdf", "gwy": "to_gwy"}[format_])
        write(str(path))
    else:
        write_surface(lopsided, path)
    found = read_surface(path)
    assert found.pixel == pytest.approx((0.5, 0.75), rel=1e-12)
    np.testing.assert_allclose(found.heights, lopsided.heights, rtol=1e-12, atol=1e-12)


def test_x3p_is_turned_over(tmp_path, lopsided):
    """Its y points up; a file whose checksum is wrong is refused."""
    x3pio.write(tmp_path / "s.x3p", lopsided.heights * 1e-6, x_scale=5e-7, y_scale=7.5e-7)
    found = read_surface(tmp_path / "s.x3p")
    np.testing.assert_allclose(found.heights, lopsided.heights[::-1], rtol=1e-12)
    assert found.pixel == pytest.approx((0.5, 0.75), rel=1e-12)
    stored_topography(lopsided).to_x3p(str(tmp_path / "s.x3p"))  # 1.27 writes a wrong one
    with pytest.raises(InputError, match="checksum"):
        read_surface(tmp_path / "s.x3p")


@pytest.mark.parametrize("format_", ["x3p", "nc", "npz", "ply", "npy"])
def test_slopes_along_x_stay_along_x(tmp_path, format_):
    x = np.arange(20)
    ridges = Heightfield(np.tile(0.4 * (x % 2), (12, 1)), (0.5, 0.75), "mirror")
    path = tmp_path / f"s.{format_}"
    if format_ == "nc":
        stored_topography(ridges).to_netcdf(str(path))
    else:
        write_surface(ridges, path)
    found = read_surface(path, **({"spacing": (0.5, 0.75)} if format_ == "npy" else {}))
    p, q = facet_slopes(found)
    np.testing.assert_allclose(np.abs(p), 0.8, rtol=1e-12)
    np.testing.assert_allclose(q, 0, atol=1e-12)


def test_voids_go_through_x3p(tmp_path):
    heights = np.random.default_rng(31).normal(size=(20, 30))
    filled = np.zeros((20, 30), dtype=bool)
    filled[5:9, 6:20] = True
    write_surface(Heightfield(heights, 0.5, "mirror", filled=filled), tmp_path / "s.x3p")
    found = read_surface(tmp_path / "s.x3p")
    assert np.array_equal(found.filled, filled)
    np.testing.assert_allclose(found.heights[~filled], heights[~filled], rtol=1e-14)


@pytest.mark.parametrize(
    ("mode", "kind", "ending"),
    [("L", np.uint8, ".png"), ("I;16", np.uint16, ".png"), ("F", np.float32, ".tiff"),
     ("I;16", np.uint16, ".tif"), ("L", np.uint8, ".bmp"), ("L", np.uint8, ".pgm")],
)  # fmt: skip
def test_images_with_what_they_do_not_know(tmp_path, mode, kind, ending):
    levels = np.arange(12, dtype=kind).reshape(3, 4) ** 2
    path = tmp_path / f"s{ending}"
    Image.frombytes(mode, (4, 3), levels.tobytes()).save(path)
    found = read_surface(path, spacing=(0.5, 0.25), height_unit="2.5 nm")
    np.testing.assert_allclose(found.heights, levels * 2.5e-3, rtol=1e-6)
    assert found.pixel == (0.5, 0.25)
    for given, said in (
        ({"height_unit": "nm"}, "give --spacing"),
        ({"spacing": 0.5}, "give --height-unit"),
        ({"spacing": 0.5, "height_unit": "furlong"}, "unit of length"),
        ({"spacing": 0.5, "height_unit": "-1nm"}, "must be like nm"),
        ({"spacing": 2000.0, "height_unit": "nm"}, "must be 0.0001 … 1000"),
    ):
        with pytest.raises(InputError, match=said):
            read_surface(path, **given)


def test_images_in_colour_and_of_one_row_are_refused(tmp_path):
    known = {"spacing": 1.0, "height_unit": "nm"}
    Image.new("RGB", (4, 3)).save(tmp_path / "s.png")
    with pytest.raises(InputError, match="mode RGB"):
        read_surface(tmp_path / "s.png", **known)
    Image.new("L", (4, 1)).save(tmp_path / "s.png")
    with pytest.raises(InputError, match="rows and columns"):
        read_surface(tmp_path / "s.png", **known)


def test_bare_heights_with_a_unit_come_out_in_micrometres(tmp_path):
    np.save(tmp_path / "s.npy", np.arange(6.0).reshape(2, 3))
    found = read_surface(tmp_path / "s.npy", spacing=0.5, height_unit="nm")
    np.testing.assert_allclose(found.heights, np.arange(6.0).reshape(2, 3) * 1e-3)
    assert found.provenance["unit_in_file"] == "nm"
    with pytest.raises(InputError, match="no spacing; give --spacing, or"):
        read_surface(tmp_path / "s.npy", height_unit="nm")
    with pytest.raises(InputError, match="channel"):
        read_surface(tmp_path / "s.npy", channel="0")


def test_a_mark_for_voids_is_pointed_out(tmp_path):
    heights = np.random.default_rng(32).normal(size=(40, 50))
    heights[3, 4:7] = -32768
    np.save(tmp_path / "s.npy", heights)
    with pytest.raises(InputError, match=r"3 heights are exactly -32768.*--void-value"):
        read_surface(tmp_path / "s.npy")
    found = read_surface(tmp_path / "s.npy", void_value=-32768)
    assert found.filled.sum() == 3
    assert np.abs(found.heights).max() < 10
    with pytest.raises(InputError, match="no height is that"):
        read_surface(tmp_path / "s.npy", void_value=5.0)
    # Negative control: a steep surface has no mark.
    np.save(tmp_path / "s.npy", heights[4:])
    assert read_surface(tmp_path / "s.npy").filled is None


def test_without_the_extra_one_line_says_what_to_install(tmp_path, monkeypatch):
    for package, ending in (("SurfaceTopography", ".al3d"), ("x3pio", ".x3p")):
        monkeypatch.setitem(__import__("sys").modules, package, None)
        path = tmp_path / f"s{ending}"
        path.write_bytes(b"x")
        with pytest.raises(InputError, match=rf"{package}.*pip install 'microsurf\[topography\]'"):
            read_surface(path)


def test_every_format_of_the_library_has_an_ending():
    """But those that we read ourselves, profiles, and maps of whole countries."""
    theirs = set(library().IO.lookup_reader_by_format)
    ours = {name for formats in surface_topography.FORMATS.values() for name in formats}
    assert theirs - ours == {"x3p", "npy", "npz", "mitutoyo", "hgt"}
    assert ours <= theirs
    assert ".x3p" in read_endings()
