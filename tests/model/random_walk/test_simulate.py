from importlib import import_module

import numpy as np
import pytest
from brute import direction
from numba import njit
from scipy import stats

from microsurf import model
from microsurf.errors import InputError
from microsurf.invariants.walk_furnace import furnace
from microsurf.model import all_orders
from microsurf.model.random_walk import facet_kernels, smith_kernels
from microsurf.model.random_walk.evaluate import evaluate_walk
from microsurf.model.random_walk.parameters import slope_parameters, stream, walk_facet
from microsurf.model.random_walk.simulate import MOST_EVENTS, walk
from microsurf.physics import facet
from microsurf.physics import visible_normals as visible
from microsurf.results import albedos, datasets, detector
from microsurf.scene import Effects, Light, Material, Roughness, Scene
from microsurf.stats.hypothesis_tests import chi_square, z_test

CLOSED = {"smith-walk": "smith", "vcavity-walk": "vcavity"}
GOLD = Scene(material=Material(0.43, k=2.455), roughness=Roughness(2.0, (0.5,)))
GOLD_FACET = walk_facet(GOLD, 0.0)
MATERIALS = {"IL": (1.5, 0.8), "mirror": (1.5, 0.0), "Lambertian": (1.0, 0.8)}
ISOTROPIC, ANISOTROPIC = (2.0, (0.5,)), (8.0, (0.7, 0.2))


def scene(roughness=ISOTROPIC, n=1.5, kd=0.8, theta=(0.0, 60.0, 85.0), phi=(0.0,), **more):
    return Scene(
        material=Material(n, (kd,)),
        roughness=Roughness(*roughness),
        light=Light(theta, phi),
        **more,
    )


def random_state(seed=0):
    return stream(np.random.default_rng(seed))


# What the kernels are made of


def test_random_numbers_are_those_of_numpys_sfc64():
    generator = np.random.Generator(np.random.SFC64(5))
    state = generator.bit_generator.state["state"]["state"].copy()
    drawn = [facet_kernels.uniform(state) for _ in range(1000)]
    np.testing.assert_array_equal(drawn, generator.random(1000))


@pytest.mark.parametrize("gamma", [1.501, 1.6, 2.0, 2.0001, 3.0, 8.0, 1e3, 1e6, 1e9, np.inf])
def test_the_table_holds_the_projected_area(gamma):
    """Within 1e−10 of the area at the horizon, for rays up, at random heights and at the ends."""
    parameters = slope_parameters(gamma, 0.5, 0.2)
    rng = np.random.default_rng(1)
    theta = np.concatenate([rng.random(2000) * 90, 90 - np.geomspace(1e-7, 1, 300), [0.0, 90.0]])
    for t in theta:
        w = direction(t, 360 * rng.random())
        across = np.hypot(parameters.scale_x * w[0], parameters.scale_y * w[1])
        expected = visible.projected_area(w, gamma, 0.5, 0.2) - w[2]
        assert (
            abs(smith_kernels.above(w[2], across, parameters) - expected)
            < 1e-10 * parameters.excess * across + 1e-16
        )


@njit
def visible_normals(out, wx, wy, wz, parameters, state):
    for k in range(len(out)):
        out[k] = smith_kernels.visible_normal(wx, wy, wz, parameters, state)


@pytest.mark.parametrize("gamma", [1.501, 1.6, 2.0, 2.5, 8.0, 1e6, np.inf])
def test_kernel_draws_the_visible_normals_of_physics(gamma, judge):
    """Two-sample Kolmogorov–Smirnov."""
    levels = []
    count, thetas = 50_000, (0, 30, 75, 89.999, 90, 91, 120, 170)
    parameters, state, rng = (
        slope_parameters(gamma, 0.5, 0.2),
        random_state(judge.seed(0)),
        np.random.default_rng(judge.seed(2)),
    )
    for theta in thetas:
        w = direction(theta, 40)
        m = np.zeros((count, 3))
        visible_normals(m, *w, parameters, state)
        np.testing.assert_allclose(np.linalg.norm(m, axis=1), 1, rtol=1e-14)
        assert (m @ w > -1e-15).all()
        expected = visible.sample(np.tile(w, (count, 1)), gamma, 0.5, 0.2, rng)
        levels += [stats.ks_2samp(m[:, k], expected[:, k]).pvalue for k in range(3)]
    judge.keeps(levels)


# Order 1 against the closed forms


def order_one(kind, walks, roughness, material, seed, theta=(0.0, 60.0, 85.0)):
    """p-values against the quadrature, over kinds and angles."""
    n, kd = MATERIALS[material]
    asked = scene(roughness, n, kd, theta=theta, phi=(25.0,))
    walked = walk(asked, kind, walks=walks, seed=seed)
    predicted = model.predict(asked, CLOSED[kind])
    levels = []
    for quantity in ("specular", "body"):
        measured = walked.microsurf.albedo(**albedos.SELECTED[quantity], n=n, kd=kd).values
        error = walked.microsurf.ray_error(**albedos.SELECTED[quantity], n=n, kd=kd).values
        expected = predicted.microsurf.albedo(**albedos.SELECTED[quantity], n=n, kd=kd).values
        levels.append(z_test(measured, expected, error))  # without an error: equal
    return levels


@pytest.mark.parametrize(
    ("kind", "roughness", "material"),
    [
        ("smith-walk", ISOTROPIC, "IL"),
        ("smith-walk", ANISOTROPIC, "mirror"),
        ("smith-walk", (1.6, (0.5,)), "Lambertian"),
        ("vcavity-walk", ISOTROPIC, "mirror"),
    ],
)
def test_order_one_is_the_closed_form(kind, roughness, material, judge):
    judge.keeps(order_one(kind, 300_000, roughness, material, judge.seed(0), theta=(65.0,)))


@pytest.mark.parametrize("kind", all_orders())
def test_order_one_of_gold_is_the_closed_form(kind, judge):
    walked = walk(GOLD, kind, walks=300_000, seed=judge.seed(0))
    predicted = model.predict(GOLD, CLOSED[kind])
    measured, expected = (
        d.microsurf.albedo(order=1, kind="specular", n=0.43, kd=0.0) for d in (walked, predicted)
    )
    error = walked.microsurf.ray_error(order=1, kind="specular", n=0.43, kd=0.0)
    judge.near(measured, expected, error)
    judge.tells(measured, 1.02 * expected, error)  # the negative control
    assert walked.flux.sel(order=2).sum() > 0.01


@pytest.mark.long
@pytest.mark.parametrize("kind", all_orders())
@pytest.mark.parametrize("roughness", [ISOTROPIC, ANISOTROPIC, (1.6, (0.5,)), (1e6, (0.3,))])
@pytest.mark.parametrize("material", MATERIALS)
def test_order_one_is_the_closed_form_at_ten_million_walks(kind, roughness, material, judge):
    judge.keeps(order_one(kind, 10_000_000, roughness, material, judge.seed(0)))


def test_the_two_models_are_told_apart(judge):
    """The negative control: order 1 of V-cavities must fail against Smith's."""
    asked = scene(theta=(70.0,), kd=0.0)
    walked = walk(asked, "vcavity-walk", walks=200_000, seed=judge.seed(0))
    error = walked.microsurf.ray_error(order=1, kind="specular", n=1.5, kd=0.0)
    other = model.predict(asked, "smith").microsurf.albedo(order=1, kind="specular", n=1.5, kd=0.0)
    judge.tells(walked.microsurf.albedo(order=1, kind="specular", n=1.5, kd=0.0), other, error)


@pytest.mark.parametrize("kind", all_orders())
def test_lobes_of_order_one_fall_into_the_bins_of_the_model(kind, judge):
    asked = scene(ANISOTROPIC if kind == "smith-walk" else ISOTROPIC, 2.0, 0.0, (50.0,), (35.0,))
    count = 400_000
    seen = (
        walk(asked, kind, walks=count, seed=judge.seed(0)).flux.sel(order=1).values[0, 0, 0, 0]
        * count
    )
    flux = model.predict(asked, CLOSED[kind]).flux.values[0, 0, 0, 0, 0] * count
    judge.keeps(chi_square(np.rint(seen), flux, total_fixed=False))
    turned = np.roll(flux, 1, axis=-1)  # the negative control: one sector on
    judge.catches(chi_square(np.rint(seen), turned, total_fixed=False))


PAIRS = [((30, 0), (40, 130)), ((80, 10), (70, 170)), ((60, 0), (60, 60)), ((89, 0), (20, 90))]


@pytest.mark.parametrize(
    ("roughness", "n"),
    [(ISOTROPIC, 1.5), ((1.6, (0.5,)), 1.5), ((8.0, (0.7,)), 1.0), ((100.0, (0.5, 0.2)), 2.0)],
)
def test_pairs_of_directions_out_of_plane(roughness, n, judge):
    """Order 1 of next-event estimation against the quadrature."""
    asked = scene(roughness, n)
    i, o = (np.array([direction(*pair[k]) for pair in PAIRS]) for k in (0, 1))
    rng = np.random.default_rng(judge.seed(3))
    f, se = evaluate_walk(asked, i, o, "smith-walk", 100_000, rng, (1, 1))
    specular, body = model.evaluate(asked, i, o, "smith")
    judge.near(f.body, body, se.body)
    # With what the table of Λ is off.
    judge.near(f.specular, specular, np.hypot(se.specular, 1e-9 * specular))
    np.testing.assert_allclose(f.total, f.specular + f.body, rtol=1e-12)
    judge.tells(f.body, 1.02 * body, se.body)  # the negative control


@pytest.mark.parametrize("roughness", [ISOTROPIC, (8.0, (1.0, 0.3)), (1.8, (2.0,))])
def test_all_orders_are_reciprocal(roughness, judge):
    asked = scene(roughness, kd=1.0)
    i, o = (np.array([direction(*pair[k]) for pair in PAIRS]) for k in (0, 1))
    rng = np.random.default_rng(judge.seed(4))
    there, error = evaluate_walk(asked, i, o, "smith-walk", 100_000, rng)
    back, other = evaluate_walk(asked, o, i, "smith-walk", 100_000, rng)
    spread = np.hypot(error.total, other.total)
    judge.near(there.total, back.total, spread)
    # The negative control: light is not the same if only one side carries its cosine.
    off = there.total * i[:, 2] - back.total * o[:, 2]
    judge.tells(off, 0, spread)


def test_evaluation_and_walks_agree_in_a_bin(judge):
    """f averaged over one bin of the detector, every order: two estimators, one integral."""
    asked = scene(theta=(60.0,), kd=1.0, roughness=(2.0, (1.0,)))
    walked = walk(asked, walks=2_000_000, seed=judge.seed(3))
    ring, sector = detector.ring_of(40.0), 9
    share = walked.flux.isel(theta_o=ring, phi_o=sector).sum(("order", "body_events")).item()
    low, high = np.cos(np.radians(detector.RING_EDGES[[ring + 1, ring]]))
    rng = np.random.default_rng(judge.seed(5))
    o = np.array(
        [
            direction(np.degrees(np.arccos(z)), d)
            for z, d in rng.uniform((low, 85), (high, 95), (200, 2))
        ]
    )
    f, se = evaluate_walk(asked, direction(60, 0), o, "smith-walk", 5000, rng)
    solid = (high - low) * np.radians(10)
    weighted = f.total * o[:, 2] * solid
    error = np.hypot(weighted.std() / np.sqrt(len(o)), np.sqrt(share / 2_000_000))
    judge.near(weighted.mean(), share, error)
    judge.tells(weighted.mean(), 1.2 * share, error)  # the negative control
    assert (se.total > 0).all()


# Energy


def white(gamma, sigma, n, theta, walks, seed, cap=MOST_EVENTS):
    """Deviation of the evaluated white furnace from 1, in standard errors."""
    values = np.zeros(walks)
    asked = scene((gamma, (sigma,)), n, 1.0)
    parameters = slope_parameters(gamma, sigma, sigma)
    furnace(
        values, direction(theta, 0), parameters, walk_facet(asked, 1.0), random_state(seed), cap
    )
    return (values.mean() - 1) / (values.std() / np.sqrt(walks))


FURNACES = [
    (gamma, sigma, n, theta)
    for gamma in (1.6, 2.0, 8.0, 1e6)
    for sigma in (0.01, 0.5, 2.0)
    for n in (1.0, 1.5, 4.0)
    for theta in (0, 45, 80, 89)
]


def test_white_furnace(judge):
    """144 of them as one family, and no bias in all."""
    z = [white(*case, walks=10_000, seed=judge.seed(k)) for k, case in enumerate(FURNACES)]
    judge.near(z, 0, 1)
    judge.near(np.mean(z), 0, 1 / np.sqrt(len(z)))


@pytest.mark.long
@pytest.mark.parametrize("gamma", [1.6, 2.0, 8.0, 1e6])
def test_white_furnace_at_a_million_walks(gamma, judge):
    z = [
        white(*case, walks=1_000_000, seed=judge.seed(k))
        for k, case in enumerate(FURNACES)
        if case[0] == gamma
    ]
    judge.near(z, 0, 1)


def test_a_capped_walk_or_a_wrong_law_fails_the_white_furnace():
    """The negative controls: eight events are not all, and r_e matters."""
    assert white(1.6, 2.0, 1.5, 0, walks=100_000, seed=1, cap=8) < -10
    values, right = np.zeros(100_000), walk_facet(scene(), 1.0)
    wrong = right._replace(escape=0.95 * right.escape)  # r_e of another index
    parameters = slope_parameters(2.0, 0.1, 0.1)
    furnace(values, direction(60, 0), parameters, wrong, random_state(), MOST_EVENTS)
    assert values.mean() - 1 > 10 * values.std() / np.sqrt(len(values))


@pytest.mark.parametrize("kind", all_orders())
@pytest.mark.parametrize("n", [1.0, 1.5])
def test_nothing_is_lost_at_unit_substrate(kind, n):
    walked = walk(scene((1.6, (1.0, 0.2)), n, 1.0), kind, walks=20_000)
    energy = walked.microsurf.albedo(n=n, kd=1.0)
    np.testing.assert_allclose(energy, 1, rtol=1e-12)
    assert walked.ended.sum() == 0
    assert (albedos.lost_paths(walked) == 0).all()


@pytest.mark.parametrize("kind", all_orders())
def test_every_walk_is_accounted_for(kind):
    for n, kd in MATERIALS.values():
        walked = walk(scene((1.6, (1.0,)), n, kd), kind, walks=20_001)
        assert (walked.arrived + walked.ended.sum("cause") == walked.paths).all()
        assert (walked.paths == 20_001).all()
        assert walked.ended.sel(cause="endless").sum() == 0


def test_thinned_long_walks_keep_their_light(judge):
    """Energy at Kd = 0.8 is the same whether long walks are thinned for 0.8 or not at all."""
    parameters = (1.6, (2.0,))
    thinned = walk(scene(parameters, kd=0.8, theta=(0.0,)), walks=100_000, seed=judge.seed(1))
    whole = walk(scene(parameters, kd=1.0, theta=(0.0,)), walks=100_000, seed=judge.seed(2))
    mean = [d.microsurf.albedo(n=1.5, kd=0.8).item() for d in (thinned, whole)]
    error = [d.microsurf.ray_error(n=1.5, kd=0.8).item() for d in (thinned, whole)]
    assert thinned.ended.sel(cause="absorbed").item() > 1000
    # Shared bins of body events add up to 2e−3 of the light beyond sixteen of them.
    judge.near(mean[0], mean[1], np.hypot(*error), within=2e-5)
    judge.tells(mean[0], 1.1 * mean[1], np.hypot(*error), within=2e-5)  # the negative control


def test_corner_of_heavy_tails_and_steep_slopes():
    """γ = 1.51, σ = 5: a walk has hundreds to thousands of events, and all of them end."""
    walked = walk(scene((1.51, (5.0,)), kd=1.0, theta=(0.0,)), walks=1000, seed=1)
    assert (walked.arrived == 1000).all()
    assert walked.attrs["events"] / 1000 > 100


# What runs


@pytest.mark.parametrize("kind", all_orders())
def test_same_bits_whatever_the_number_of_threads(kind, monkeypatch):
    monkeypatch.setattr(import_module("microsurf.model.random_walk.simulate"), "CHUNK", 3000)
    asked = scene(theta=(30.0,), phi=(0.0, 70.0))
    one, three = (walk(asked, kind, walks=20_000, seed=7, workers=w) for w in (1, 3))
    np.testing.assert_array_equal(one.flux, three.flux)
    other = walk(asked, kind, walks=20_000, seed=8, workers=3)
    assert (one.flux != other.flux).any()


@pytest.mark.parametrize("kind", all_orders())
def test_one_order_alone_leaves_the_rest_out(kind):
    alone = walk(scene(effects=Effects(multiple_scattering=False)), kind, walks=50_000)
    assert alone.flux.sel(order=slice(2, None)).sum() == 0
    assert (alone.arrived + alone.ended.sel(cause="left out") == alone.paths).all()
    assert (albedos.lost_paths(alone) == 0).all()


@pytest.mark.parametrize("kind", all_orders())
def test_a_black_facet_without_interface_sends_nothing_back(kind):
    walked = walk(scene(n=1.0, kd=0.0), kind, walks=1000)
    assert walked.flux.sum() == 0
    assert (walked.ended.sel(cause="absorbed") == 1000).all()


@pytest.mark.parametrize("kind", all_orders())
def test_a_flat_scene_is_one_facet_exactly(kind):
    walked = walk(scene((2.0, (0.0,))), kind, walks=10)
    total = walked.microsurf.albedo(n=1.5, kd=0.8).values.ravel()
    cosine = np.cos(np.radians([0.0, 60.0, 85.0]))
    np.testing.assert_allclose(total, facet.albedo(cosine, 1.5, 0.8), rtol=1e-12)
    assert (walked.microsurf.standard_error(n=1.5, kd=0.8) == 0).all()


def test_figures_and_files_take_a_walk_as_any_result(tmp_path):
    walked = walk(scene(), walks=10_000)
    figures = albedos.figures(walked, (0.0, 0.8), n=1.5)
    assert all(0 < se < 0.01 for pair in figures["albedo_se"] for se in pair)
    datasets.save(walked, tmp_path / "walk.nc")
    np.testing.assert_array_equal(datasets.load(tmp_path / "walk.nc").flux, walked.flux)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: walk(scene(), "smith"), "kind = 'smith': must be one of smith-walk, vcavity-walk"),
        (lambda: walk(scene(), walks=0), "walks = 0: must be 1 or more"),
        (lambda: pair(kind="vcavity"), "kind = 'vcavity': must be one of smith-walk, vcavity-walk"),
        (lambda: pair(walks=1), "walks = 1: must be 2 or more"),
        (lambda: pair(asked=scene((2.0, (0.0,)))), "roughness.sigma = .*: must be > 0"),
        (lambda: pair(i=np.array([0.0, 0.0, 2.0])), "i: must be unit vectors"),
    ],
)
def test_refuses_what_makes_no_sense(call, message):
    with pytest.raises(InputError, match=message):
        call()


def pair(asked=None, i=None, kind="smith-walk", walks=10):
    up = np.array([0.0, 0.0, 1.0])
    i = up if i is None else i
    return evaluate_walk(asked or scene(), i, up, kind, walks, np.random.default_rng(0))


def test_below_the_horizon_is_nothing():
    i = np.array([direction(30, 0), direction(100, 0)])
    o = np.array([direction(95, 0), direction(20, 0)])
    f, se = evaluate_walk(scene(), i, o, "smith-walk", 10, np.random.default_rng(0))
    assert (f.total == 0).all()
    assert (se.total == 0).all()
