import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

from microsurf.errors import InputError
from microsurf.physics import facet
from microsurf.results import datasets, detector

RINGS, SECTORS = detector.RINGS, detector.SECTORS


def dataset(shape=(2, 2, 1), orders=4, events=3, seed=0, **attrs):
    """Random light in every bin."""
    rng = np.random.default_rng(seed)
    flux = rng.random((*shape, orders, events, RINGS, SECTORS))
    return datasets.build(
        flux,
        np.linspace(0, 60, shape[1]),
        np.linspace(0, 90, shape[2]),
        detector.ORDERS[:orders],
        attrs={"source": "measurement", "scene": "", **attrs},
    )


# The bins


def test_bins_cover_the_hemisphere():
    assert detector.solid_angles().sum() * SECTORS == pytest.approx(2 * np.pi, rel=1e-14)
    assert detector.projected_solid_angles().sum() * SECTORS == pytest.approx(np.pi, rel=1e-14)
    edges = detector.RING_EDGES
    assert (edges[0], edges[1], edges[2], edges[-1]) == (0, 1, 3, 90)
    assert (np.diff(edges) > 0).all()


def test_mirror_directions_at_whole_even_degrees_lie_inside_a_bin():
    for theta in range(2, 90, 2):
        ring = detector.ring_of(theta)
        assert detector.RING_EDGES[ring] + 0.9 < theta < detector.RING_EDGES[ring + 1] - 0.9
    assert detector.ring_of(0) == 0
    assert detector.ring_of(89.999) == RINGS - 1
    mirror = detector.SECTORS // 2
    assert detector.SECTOR_EDGES[mirror] == 175
    assert detector.SECTOR_EDGES[mirror + 1] == 185


@given(st.floats(0, 90, exclude_max=True))
@settings(deadline=None)
def test_ring_of_is_where_the_edges_say(theta):
    ring = detector.ring_of(theta)
    assert detector.RING_EDGES[ring] <= theta < detector.RING_EDGES[ring + 1]


def test_a_lambertian_has_the_brdf_kd_over_pi():
    """Energy Kd cosθ/π dω in each bin: the projected solid angle takes the cosine out."""
    energy = 0.3 / np.pi * np.repeat(detector.projected_solid_angles(), SECTORS, axis=1)
    values = datasets.brdf(xr.DataArray(energy, dims=("theta_o", "phi_o")))
    np.testing.assert_allclose(values, 0.3 / np.pi, rtol=1e-14)
    assert energy.sum() == pytest.approx(0.3, rel=1e-14)


def test_by_kind_by_hand():
    """w = 1/2: light of b body events counts 2^−b; none is specular."""
    n, kd = 1.5, 0.8
    w = float(facet.body_weight(n, kd))
    flux = dataset(shape=(1, 1, 1), events=4).flux
    kinds = datasets.by_kind(flux, n, kd)
    b = flux.values[0, 0, 0]
    assert list(kinds.kind.values) == ["specular", "body"]
    found = kinds.isel(realisation=0, theta_i=0, phi_i=0)
    np.testing.assert_array_equal(found.sel(kind="specular"), b[:, 0])
    by_hand = w * b[:, 1] + w**2 * b[:, 2] + w**3 * b[:, 3]
    np.testing.assert_allclose(found.sel(kind="body"), by_hand, rtol=1e-14)


def test_no_substrate_has_no_body_and_a_white_one_loses_nothing():
    flux = dataset().flux
    assert not datasets.by_kind(flux, 1.5, 0.0).sel(kind="body").any()
    white = datasets.by_kind(flux, 1.5, 1.0).sum("kind")
    np.testing.assert_allclose(white, flux.sum("body_events"), rtol=1e-14)


def test_in_plane_by_hand():
    """Each bin holds its own number, ring × 100 + sector: the cut is told by reading it."""
    own = 100.0 * np.arange(RINGS)[:, None] + np.arange(SECTORS)
    values = dataset(shape=(1, 1, 1)).flux.isel(
        realisation=0, theta_i=0, phi_i=0, order=0, body_events=0
    )
    cut = datasets.in_plane(values.copy(data=own))
    theta = detector.ring_centres()
    np.testing.assert_array_equal(cut.theta_o, [*-theta[:0:-1], *theta])
    assert (np.diff(cut.theta_o) > 0).all()
    back = [100.0 * ring for ring in range(RINGS - 1, 0, -1)]  # the light's side, sector 0
    front = [100.0 * ring + SECTORS // 2 for ring in range(1, RINGS)]
    cap = (SECTORS - 1) / 2  # mean of its sectors 0 … 35
    np.testing.assert_allclose(cut, [*back, cap, *front])


# Numbers of body events


def test_body_bins_are_exact_first_and_then_a_quarter_wide():
    edges, names = detector.BODY_EDGES, detector.BODY_EVENTS
    exact = detector.BODY_EXACT + 1
    np.testing.assert_array_equal(names[:exact], np.arange(exact))
    assert edges[-1] >= 10**9
    assert len(names) == len(edges) - 1
    width = np.diff(edges)[exact:] / edges[exact:-1]
    assert (width >= 0.25).all()
    assert (width < 0.25 + 1 / edges[exact]).all()


BODY_WEIGHTS = np.exp(-np.geomspace(1e-6, 3, 300))
LAST = int(np.searchsorted(detector.BODY_EDGES, 20_000))


def test_an_evenly_filled_bin_is_off_by_less_than_2e_3():
    """|mean of w^b − w^middle|, for every bin and weight: at most 1.5e−3 in 17 … 21."""
    worst = 0.0
    for low, high, middle in zip(
        detector.BODY_EDGES[:LAST], detector.BODY_EDGES[1:], detector.BODY_EVENTS, strict=False
    ):
        events = np.arange(low, high)
        mean = np.mean(BODY_WEIGHTS[:, None] ** events, axis=1)
        worst = max(worst, float(np.abs(mean - BODY_WEIGHTS**middle).max()))
    assert 1e-3 < worst < 2e-3


def test_geometric_numbers_of_events_are_off_by_less_than_5e_3_of_all_body_light():
    """Each event is the last with probability 1 − q."""
    events = np.arange(1, detector.BODY_EDGES[LAST])
    middle = detector.BODY_EVENTS[np.searchsorted(detector.BODY_EDGES, events, "right") - 1]
    worst = 0.0
    for q in (0.1, 0.5, 0.8, 0.9, 0.95, 0.98, 0.99, 0.999, 0.9999):
        for w in np.linspace(0.5, 1, 51):
            paths = q**events
            exact, binned = np.sum(paths * w**events), np.sum(paths * w**middle)
            worst = max(worst, abs(binned / exact - 1))
    assert 1e-3 < worst < 5e-3


# Files


@pytest.mark.parametrize("seed", [0, 2**31 - 1, 2**31, 10**30])
def test_a_result_reads_back_the_same(tmp_path, seed):
    written = dataset(seed=1).assign_attrs(seed=seed, seconds=0.25, text="σ ≥ 0, “γ”")
    written["paths"] = (("realisation", "theta_i", "phi_i"), np.full((2, 2, 1), 1e12))
    written = written.assign_coords(cause=["below", "behind"], lost=("cause", [True, False]))
    datasets.save(written, tmp_path / "r.nc")
    read = datasets.load(tmp_path / "r.nc")
    xr.testing.assert_equal(read, written)
    assert int(read.attrs["seed"]) == seed
    assert read.attrs["text"] == written.attrs["text"]
    assert read.attrs["seconds"] == 0.25
    assert read.theta_o.attrs == written.theta_o.attrs
    assert read.lost.dtype == bool
    assert [p.name for p in tmp_path.iterdir()] == ["r.nc"]


def test_empty_bins_take_no_room_and_single_precision_takes_half(tmp_path):
    """Most bins of many body events are empty; the same result gives the same bytes."""
    written = dataset(shape=(2, 2, 2), seed=1)
    flux = written.flux.copy()
    flux[:, :, :, :, 3:] = 0
    written["flux"] = flux
    sizes = []
    for rounded in (False, True):
        for name in ("a.nc", "b.nc"):
            datasets.save(written, tmp_path / name, rounded=rounded)
        assert (tmp_path / "a.nc").read_bytes() == (tmp_path / "b.nc").read_bytes()
        sizes.append((tmp_path / "a.nc").stat().st_size)
    read = datasets.load(tmp_path / "a.nc")
    assert read.flux.dtype == np.float32
    np.testing.assert_allclose(read.flux, written.flux, rtol=6e-8)
    np.testing.assert_array_equal(read.theta_o, written.theta_o)
    filled = int(np.count_nonzero(flux))
    assert sizes[0] < 8 * filled + 60_000
    assert sizes[1] < 4 * filled + 60_000


def test_what_is_no_result_is_refused(tmp_path):
    path = tmp_path / "r.nc"
    good = dataset()
    lacking = {name: value for name, value in good.attrs.items() if name != "scene"}
    for foreign in (
        good.drop_vars("flux"),
        good.isel(theta_o=slice(10)),
        good.drop_attrs().assign_attrs(lacking),
    ):
        foreign.to_netcdf(path, engine="h5netcdf")
        with pytest.raises(InputError, match=r"r\.nc: not a result"):
            datasets.load(path)
    datasets.save(good, path)
    whole = path.read_bytes()
    for broken in (b"", b"CDF\x02" + 20 * b"\xff", whole[: len(whole) // 2]):
        path.write_bytes(broken)
        with pytest.raises(InputError, match="truncated"):
            datasets.load(path)
