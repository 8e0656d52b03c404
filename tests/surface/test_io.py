import io
import pickle
import zipfile

import numpy as np
import pytest
import trimesh
from scipy import stats

from microsurf.errors import InputError
from microsurf.surface import (
    Heightfield,
    facet_slopes,
    generate_surface,
    read_surface,
    write_endings,
    write_surface,
)
from microsurf.surface.mesh_io import triangles

MESHES = (".ply", ".obj", ".stl")


@pytest.fixture(scope="module")
def generated():
    return generate_surface(2.0, 0.5, cells=(24, 37), structure="tops", spacing=0.3e-6, seed=19)


@pytest.mark.parametrize("boundary", ["periodic", "mirror"])
@pytest.mark.parametrize("ending", write_endings())
def test_round_trip(tmp_path, generated, ending, boundary):
    h = Heightfield(generated.heights, generated.spacing, boundary, generated.recipe)
    if ending == ".x3p":  # is in µm, and knows no boundary
        h = Heightfield(generated.heights * 1e6, 0.3, boundary, generated.recipe)
    path = tmp_path / f"surface{ending.upper()}"
    write_surface(h, path)
    known = {"spacing": h.spacing} if ending == ".npy" else {}
    known |= {"boundary": boundary} if ending in (".npy", ".x3p") else {}
    found = read_surface(path, **known)
    assert found.boundary == boundary
    assert found.recipe == (h.recipe if ending == ".npz" else {})
    if ending == ".stl":  # single precision: half a unit in the last place of the largest
        assert found.spacing == pytest.approx(h.spacing, rel=2**-23)
        assert np.abs(found.heights - h.heights).max() <= np.abs(h.heights).max() * 2**-24
    elif ending == ".x3p":  # metres and back
        assert found.spacing == pytest.approx(h.spacing, rel=4e-16)
        np.testing.assert_allclose(found.heights, h.heights, rtol=4e-16)
    else:
        # A mesh's spacing is its extent over its cells: one rounding each.
        assert found.spacing == pytest.approx(h.spacing, rel=4e-16)
        assert np.array_equal(found.heights, h.heights)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_native_keeps_every_bit(tmp_path, generated):
    write_surface(generated, tmp_path / "s.npz")
    found = read_surface(tmp_path / "s.npz")
    assert found.spacing == generated.spacing
    assert found.recipe == generated.recipe


def test_mesh_by_hand():
    h = Heightfield(np.array([[0.0, 1.0], [2.0, 5.0]]), 0.5, "mirror")
    vertices, faces = triangles(h)
    assert np.array_equal(vertices, [[0, 0, 0], [0.5, 0, 1], [0, 0.5, 2], [0.5, 0.5, 5]])
    assert np.array_equal(faces, [[0, 1, 3], [0, 3, 2]])
    assert len(triangles(Heightfield(h.heights))[0]) == 9  # closed: (2+1)²


def test_ply_holds_the_law_for_trimesh_alone(tmp_path):
    """No code of ours between the file and F(2, 2γ−2). Negative control: another γ."""
    write_surface(generate_surface(2.0, 0.5, cells=(256, 320), seed=20), tmp_path / "s.ply")
    loaded = trimesh.load_mesh(tmp_path / "s.ply", process=False)
    assert loaded.vertices.shape == (257 * 321, 3)
    normals = loaded.face_normals
    assert normals.shape == (2 * 256 * 320, 3)
    assert normals[:, 2].min() > 0
    slope2 = (normals[:, 0] ** 2 + normals[:, 1] ** 2) / normals[:, 2] ** 2
    assert stats.kstest(slope2 / 0.25, stats.f(2, 2).cdf).statistic < 1e-3
    assert stats.kstest(slope2 / 0.25, stats.f(2, 3).cdf).statistic > 0.01


@pytest.mark.parametrize("ending", MESHES)
def test_trimesh_sees_our_slopes(tmp_path, generated, ending):
    write_surface(generated, tmp_path / f"s{ending}")
    loaded = trimesh.load_mesh(tmp_path / f"s{ending}", process=False)
    # Scaled up: trimesh takes triangles of square nanometres for degenerate.
    loaded.apply_scale(1 / generated.spacing)
    p, q = facet_slopes(generated)
    m = loaded.face_normals
    rounding = 1e-5 if ending == ".stl" else 1e-12
    np.testing.assert_allclose(
        m[:, 0] * np.hypot(1, np.hypot(p, q)).ravel(), -p.ravel(), atol=rounding * np.abs(p).max()
    )
    np.testing.assert_allclose(
        m[:, 1] * np.hypot(1, np.hypot(p, q)).ravel(), -q.ravel(), atol=rounding * np.abs(q).max()
    )


@pytest.mark.parametrize("ending", [".npz", ".npy", ".ply", ".obj", ".stl", ".x3p"])
def test_oblong_pixels_round_trip(tmp_path, generated, ending):
    h = Heightfield(generated.heights * 1e6, (0.3, 0.45))
    write_surface(h, tmp_path / f"s{ending}")
    known = {"spacing": (0.3, 0.45)} if ending == ".npy" else {}
    known |= {"boundary": "periodic"} if ending == ".x3p" else {}
    found = read_surface(tmp_path / f"s{ending}", **known)
    rounding = 2**-23 if ending == ".stl" else 4e-16
    assert found.pixel == pytest.approx((0.3, 0.45), rel=rounding)
    np.testing.assert_allclose(found.heights, h.heights, rtol=rounding)


def test_what_is_filled_and_where_it_comes_from_is_kept(tmp_path, generated):
    filled = generated.heights > 0
    h = Heightfield(generated.heights, 1.0, filled=filled, provenance={"unit": "µm"})
    write_surface(h, tmp_path / "s.npz")
    found = read_surface(tmp_path / "s.npz")
    assert np.array_equal(found.filled, filled)
    assert found.provenance == {"unit": "µm"}


def test_the_largest_of_a_working_day_is_written_in_seconds(tmp_path):
    h = generate_surface(2.0, 0.5, cells=512, iterations=0)
    for ending in (".npz", ".ply"):
        write_surface(h, tmp_path / f"s{ending}")
        assert np.array_equal(read_surface(tmp_path / f"s{ending}").heights, h.heights)


def test_boundary_of_a_mesh(tmp_path, generated):
    write_surface(generated, tmp_path / "closed.ply")
    declared = read_surface(tmp_path / "closed.ply", boundary="mirror")
    assert declared.heights.shape == (25, 38)
    write_surface(Heightfield(generated.heights, 1.0, "mirror"), tmp_path / "open.ply")
    with pytest.raises(InputError, match="take 'mirror'"):
        read_surface(tmp_path / "open.ply", boundary="periodic")


def test_boundary_and_spacing_of_the_native_format(tmp_path, generated):
    path = tmp_path / "s.npz"
    write_surface(generated, path)
    mirrored = read_surface(path, spacing=generated.spacing, boundary="mirror")
    assert (mirrored.boundary, mirrored.recipe) == ("mirror", {})
    for bad in (1.0, 0.0, -1.0, np.nan):
        with pytest.raises(InputError, match="spacing"):
            read_surface(path, spacing=bad)
    with pytest.raises(InputError, match="periodic, mirror"):
        read_surface(path, boundary="torus")


def test_vertices_in_any_order_are_recognised(tmp_path, generated):
    vertices, faces = triangles(generated)
    order = np.random.default_rng(21).permutation(len(vertices))
    where = np.argsort(order)
    shuffled = trimesh.Trimesh(vertices[order] / 3e-7, where[faces][::-1], process=False)
    (tmp_path / "s.ply").write_bytes(trimesh.exchange.ply.export_ply(shuffled))
    found = read_surface(tmp_path / "s.ply")
    assert found.boundary == "periodic"
    np.testing.assert_allclose(found.heights, generated.heights / 3e-7, rtol=2**-23)


def grid(change):
    vertices, faces = triangles(Heightfield(np.arange(20.0).reshape(4, 5) ** 1.5, 1.0, "mirror"))
    vertices, faces = change(vertices, faces.copy())
    return trimesh.exchange.ply.export_ply(trimesh.Trimesh(vertices, faces, process=False))


def moved(vertices, index, axis, by):
    vertices[index, axis] += by
    return vertices


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda v, f: (v, f[:-1]), "missing or double"),
        (lambda v, f: (v, np.concatenate([f, f[:1]])), "missing or double"),
        (lambda v, f: (v, np.where(f == 6, 5, f)), "do not split cells"),
        (lambda v, f: (v * [-1, 1, 1], f), "do not split cells"),
        (lambda v, f: (v * [1, 0, 1], f), "different y"),
        (lambda v, f: (v * [0, 1, 1], f), "different x"),
        (lambda v, f: (moved(v, slice(0, None, 5), 0, 0.1), f), "equally spaced"),
        (lambda v, f: (moved(v, 6, 0, 0.1), f), "equally spaced"),
        (lambda v, f: (moved(v, 6, 0, 1.0), f), "gaps"),
        (lambda v, f: (np.vstack([v, v[0] + np.array([0, 0, 1])]), f), "several heights"),
        (lambda v, f: (moved(v, 6, 2, np.nan), f), "NaN"),
        (lambda v, f: (v, f[:0]), "triangles|mesh"),
    ],
)
def test_other_meshes_are_refused(tmp_path, change, said):
    path = tmp_path / "s.ply"
    path.write_bytes(grid(lambda v, f: (v, f)))
    assert read_surface(path).heights.shape == (4, 5)  # what is changed below is good before
    path.write_bytes(grid(change))
    with pytest.raises(InputError, match=said) as caught:
        read_surface(path)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


def test_scattered_points_allocate_no_grid(tmp_path):
    """10 000 different x and y would be a grid of 1e8."""
    v = np.random.default_rng(22).random((10_000, 3)).round(6) * 100
    points = trimesh.Trimesh(v, np.arange(9999).reshape(-1, 3), process=False)
    (tmp_path / "s.ply").write_bytes(trimesh.exchange.ply.export_ply(points))
    with pytest.raises(InputError, match=r"spaced|gaps"):
        read_surface(tmp_path / "s.ply")


@pytest.mark.parametrize("ending", write_endings())
@pytest.mark.parametrize("keep", [0, 1, 20, 100, 0.5, 0.99])
def test_truncated_files_are_refused(tmp_path, generated, ending, keep):
    path = tmp_path / f"s{ending}"
    write_surface(Heightfield(generated.heights * 1e6, 0.3), path)
    whole = path.read_bytes()
    path.write_bytes(whole[: keep if keep >= 1 else int(keep * len(whole))])
    with pytest.raises(InputError, match=str(path)) as caught:
        read_surface(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("ending", write_endings())
def test_garbage_is_refused(tmp_path, ending):
    for size in (10, 1000, 100_000):
        path = tmp_path / f"s{ending}"
        path.write_bytes(np.random.default_rng(size).bytes(size))
        with pytest.raises(InputError, match=str(path)):
            read_surface(path)


def test_a_damaged_archive_is_refused(tmp_path, generated):
    path = tmp_path / "s.npz"
    write_surface(generated, path)
    damaged = bytearray(path.read_bytes())
    damaged[2000] ^= 255
    path.write_bytes(damaged)
    with pytest.raises(InputError, match="damaged"):
        read_surface(path)


class Bomb:
    """Leaves a mark if unpickled."""

    def __reduce__(self):
        return (exec, ("raise SystemExit",))


def npy(array, **options):
    stream = io.BytesIO()
    np.lib.format.write_array(stream, array, **options)
    return stream.getvalue()


def claim(shape, dtype="<f8"):
    """Header of a .npy that claims an array, and no data."""
    stream = io.BytesIO()
    header = {"descr": dtype, "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(stream, header)
    return stream.getvalue()


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (npy(np.zeros((1, 1))), "rows and columns"),
        (npy(np.zeros((2, 3, 4))), "two dimensions"),
        (npy(np.zeros((2, 3), complex)), "real numbers"),
        (npy(np.array([["a", "b"]] * 2)), "real numbers"),
        (npy(np.array([[Bomb(), 1], [2, 3]], object)), "real numbers"),
        (npy(np.zeros((2, 3)), version=(2, 0)).replace(b"\x02\x00", b"\x04\x00", 1), "format 4.0"),
        (b"\x93NUMPY\x02\x00\xff\xff\xff\xff" + b" " * 20_000, "header too long"),
        (b"\x93NUMPY\x03\x00\x20\x4e\x00\x00" + b" " * 20_000, "header too long"),
        (npy(np.zeros((2, 3))) + b"more", "damaged"),
        (claim((16384, 16384)), "truncated"),
        (claim((2**40, 2**40)), "rows and columns"),
        (claim((2, 3), "|O"), "real numbers"),
        (claim((-2, 3)), "rows and columns"),
        (pickle.dumps(Bomb()), "not a .npy"),
    ],
)
def test_bad_arrays_are_refused_before_they_are_loaded(tmp_path, content, said):
    for name, text in (("s.npy", content), ("s.npz", None)):
        path = tmp_path / name
        if text is None:
            good = tmp_path / "good.npz"
            write_surface(Heightfield(np.zeros((2, 3))), good)
            with zipfile.ZipFile(good) as old, zipfile.ZipFile(path, "w") as new:
                for entry in old.namelist():
                    new.writestr(entry, content if entry == "heights.npy" else old.read(entry))
        else:
            path.write_bytes(text)
        with pytest.raises(InputError, match=said) as caught:
            read_surface(path)
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("entry", "content", "said"),
    [
        ("spacing.npy", npy(np.array(-1.0)), "spacing"),
        ("spacing.npy", npy(np.ones(3)), "not a microsurf surface"),
        ("spacing.npy", npy(np.array(Bomb(), object)), "not a microsurf surface"),
        ("spacing.npy", npy(np.array("wide")), "spacing"),
        ("boundary.npy", npy(np.array("torus")), "boundary"),
        ("recipe.npy", npy(np.array("[1]")), "recipe"),
        ("recipe.npy", npy(np.array("{")), "recipe"),
        ("recipe.npy", npy(np.array("[" * 100_000)), "recipe"),
        ("recipe.npy", npy(np.array("x" * 1_000_001)), "not a microsurf surface"),
        ("recipe.npy", None, "no recipe inside"),
    ],
)
def test_bad_entries_of_the_native_format_are_refused(tmp_path, generated, entry, content, said):
    write_surface(generated, tmp_path / "good.npz")
    with (
        zipfile.ZipFile(tmp_path / "good.npz") as old,
        zipfile.ZipFile(tmp_path / "s.npz", "w") as new,
    ):
        for name in old.namelist():
            changed = content if name == entry else old.read(name)
            if changed is not None:
                new.writestr(name, changed)
    with pytest.raises(InputError, match=said):
        read_surface(tmp_path / "s.npz")


def test_a_mesh_opens_no_other_file(tmp_path, generated):
    path = tmp_path / "s.obj"
    write_surface(generated, path)
    (tmp_path / "trap.mtl").mkdir()  # opening it would fail
    path.write_bytes(b"mtllib trap.mtl\n" + path.read_bytes())
    assert read_surface(path).heights.shape == (24, 37)


@pytest.mark.parametrize("kind", ["<i2", "<u4", "<f4", "<f2", ">f8"])
def test_other_real_numbers_are_taken(tmp_path, kind):
    heights = np.arange(6).reshape(2, 3).astype(kind)
    np.save(tmp_path / "s.npy", np.asfortranarray(heights))
    found = read_surface(tmp_path / "s.npy", spacing=2)
    assert found.heights.dtype == np.float64
    assert np.array_equal(found.heights, heights)
    assert (found.spacing, found.boundary) == (2.0, "periodic")


def test_names_that_can_not_be_used(tmp_path, generated):
    with pytest.raises(InputError, match="no such file"):
        read_surface(tmp_path / "missing.npy")
    with pytest.raises(InputError, match="is a folder"):
        read_surface(tmp_path)
    (tmp_path / "s.doc").write_bytes(b"II*")
    for act in (read_surface, lambda path: write_surface(generated, path)):
        with pytest.raises(InputError, match=r"unknown ending '.doc'.*\.npz"):
            act(tmp_path / "s.doc")
    with pytest.raises(InputError, match=r"unknown ending '.tiff'"):
        write_surface(generated, tmp_path / "s.tiff")
    with pytest.raises(InputError, match="X3P"):
        write_surface(generated, tmp_path / "s.x3p")  # spacing 3e-7: not of micrometres
    with pytest.raises(InputError, match="does not exist"):
        write_surface(generated, tmp_path / "nowhere" / "s.npz")


def test_a_recipe_that_is_no_json_leaves_no_file(tmp_path):
    bad = Heightfield(np.zeros((2, 3)), recipe={"gamma": np.inf})
    with pytest.raises(InputError, match="not JSON"):
        write_surface(bad, tmp_path / "s.npz")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("version", [(1, 0), (2, 0), (3, 0)])
def test_every_version_of_npy_is_read(tmp_path, version):
    heights = np.random.default_rng(0).normal(size=(4, 6))
    for array in (heights, np.asfortranarray(heights), heights.astype(">f4")):
        (tmp_path / "s.npy").write_bytes(npy(array, version=version))
        np.testing.assert_array_equal(read_surface(tmp_path / "s.npy").heights, array)


@pytest.mark.parametrize("ending", write_endings())
def test_heights_by_columns_are_written_as_they_are(tmp_path, ending):
    heights = np.random.default_rng(0).normal(size=(4, 6)).round(3)
    by_columns = Heightfield(np.asfortranarray(heights))
    write_surface(by_columns, tmp_path / f"s{ending}")
    h = read_surface(tmp_path / f"s{ending}")
    found = h.heights[:4, :6] - h.heights[0, 0]
    np.testing.assert_allclose(found, heights - heights[0, 0], atol=1e-6)
