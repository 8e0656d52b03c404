"""Single directions in V-cavities: closed chains of mirrors, and body light through mirrors."""

import mpmath as mp
import numpy as np
import pytest
from brute import direction

from microsurf import model
from microsurf.model import MODELS
from microsurf.model.random_walk.evaluate import evaluate_walk
from microsurf.model.random_walk.parameters import slope_parameters, stream, walk_facet
from microsurf.model.random_walk.vcavity_kernels import chain, more_mirrors
from microsurf.model.single_scattering import brdf
from microsurf.results import datasets, detector
from microsurf.scene import Light, Material, Roughness, Scene

PAIRS = [
    ((30, 0), (40, 130)), ((80, 10), (70, 170)), ((60, 0), (60, 60)), ((89, 0), (20, 90)),
    ((0, 0), (35, 20)), ((75, 0), (80, 5)), ((50, 30), (50, 200)), ((89.9, 0), (89.9, 179)),
]  # fmt: skip
LIGHT, EYE = (np.array([direction(*pair[k]) for pair in PAIRS]) for k in (0, 1))
GOLD, IL = Material(0.43, k=2.455), Material(1.5, (0.8,))


def scene(gamma=2.0, sigma=(0.5,), material=IL, theta=60.0):
    return Scene(material=material, roughness=Roughness(gamma, sigma), light=Light((theta,)))


def kernel_arguments(asked):
    rough = asked.roughness
    return slope_parameters(rough.gamma, rough.sigma_x, rough.sigma_y), walk_facet(
        asked, asked.material.kd[0]
    )


MASKING = MODELS["vcavity"].masking


@pytest.mark.parametrize(
    "roughness", [(1.501, (2.0,)), (2.0, (0.5, 0.05)), (8.0, (0.7,)), (1e9, (0.3,))]
)
@pytest.mark.parametrize("material", [Material(1.5, (0.0,)), GOLD])
def test_one_mirror_is_the_closed_form(roughness, material):
    asked = scene(*roughness, material)
    facets = brdf.Facets(material.n, asked.roughness.gamma, asked.roughness.sigma_x,
                           asked.roughness.sigma_y, MASKING, material.k)  # fmt: skip
    expected = brdf.specular(facets, LIGHT, EYE) * EYE[:, 2]
    parameters, facet = kernel_arguments(asked)
    found = [chain(1, *i, *o, parameters, facet) for i, o in zip(LIGHT, EYE, strict=True)]
    # 1e−9 of the exponent at γ = 1e9, which one of the two rounds as a power.
    np.testing.assert_allclose(found, expected, rtol=1e-12 if asked.roughness.gamma < 1e6 else 1e-9)


def dot(v, w):
    return sum(x * y for x, y in zip(v, w, strict=True))


def followed(k, i, o, u, azimuth, width, n):
    """Part of the places on a from which k mirrors lead to o, times Π F: the ray itself."""
    tilt = (mp.pi - width) / 2
    a = [mp.sin(tilt) * u * mp.cos(azimuth), mp.sin(tilt) * u * mp.sin(azimuth), mp.cos(tilt)]
    b = [-a[0], -a[1], a[2]]
    if dot(i, a) <= 0:
        return mp.mpf(0)
    d, ratio, light = [-x for x in i], mp.mpf(1), mp.mpf(1)
    low, high = max(mp.mpf(0), -dot(i, b) / dot(i, a)), mp.mpf(1)
    for event in range(k):
        mu = -dot(d, a)
        inside = mp.sqrt(1 - (1 - mu**2) / n**2)
        r_s, r_p = (mu - n * inside) / (mu + n * inside), (n * mu - inside) / (n * mu + inside)
        light *= (r_s**2 + r_p**2) / 2
        d = [x + 2 * mu * y for x, y in zip(d, a, strict=True)]
        leaving, towards = dot(d, a), -dot(d, b)
        if mu <= 0 or (towards <= 0 and event < k - 1):
            return mp.mpf(0)
        if event < k - 1:
            ratio *= leaving / towards
            high, a, b = min(high, 1 / ratio), b, a
        else:
            low = max(low, towards / (leaving * ratio))
    assert max(abs(x - y) for x, y in zip(d, o, strict=True)) < 1e-40
    return max(high - low, mp.mpf(0)) * light


def chain_reference(k, i, o, gamma, sigma, n):
    """f cosθ_o of k mirrors in 50 digits, each V-cavity that leads to o followed ray by ray."""
    i, o = ([mp.mpf(float(x)) / mp.norm(w.tolist()) for x in w] for w in (i, o))
    h, azimuth = mp.hypot(i[0] + o[0], i[1] + o[1]), mp.atan2(i[1] + o[1], i[0] + o[0])
    cosine, sine = mp.cos(azimuth), mp.sin(azimuth)
    along_i, along_o = (w[0] * cosine + w[1] * sine for w in (i, o))
    total = mp.mpf(0)
    for u in (1, -1):
        tau_i, tau_o = mp.atan2(u * along_i, i[2]), mp.atan2(u * along_o, o[2])
        width = (mp.pi - tau_i + (-tau_o if k % 2 else tau_o)) / k
        if width >= mp.pi:
            continue
        slope, up = mp.cot(width / 2), mp.sin(width / 2)
        facing = mp.cos(width / 2) * u * along_i + up * i[2]
        rho2 = slope**2 * ((cosine / sigma[0]) ** 2 + (sine / sigma[1]) ** 2)
        density = (1 + rho2 / (gamma - 1)) ** -gamma / (mp.pi * sigma[0] * sigma[1])
        jacobian = slope / (up**2 * 2 * k * h)
        part = followed(k, i, o, u, azimuth, width, n)
        total += density * jacobian * facing / (up * i[2]) * part
    return total


GRAZING = [
    ((89.99999, 0), (89.99999, 3)), ((89.99999, 0), (89.99998, 179.999)), ((89.99999, 0), (20, 30)),
    ((40, 0), (40.001, 2)), ((0, 0), (0.01, 20)), ((50, 0), (50, 170)),
]  # fmt: skip


@pytest.mark.parametrize(
    ("gamma", "sigma", "n"), [(2.0, (1.0, 0.6), 4.0), (1.501, (10.0, 10.0), 1.5)]
)
def test_chains_are_the_rays_that_make_them(gamma, sigma, n):
    """Against rays bounced in 50 digits.

    Exponents of the density at slopes to 1e7 are up to 100, and so many ε are lost; each
    of k factors F is right to a few ε. The lengths of i and o are right to ε, so the
    azimuth of H to ε/|H|, and angles across the V-cavity, s long there, to ε/(|H| s).
    """
    parameters, facet = kernel_arguments(scene(gamma, sigma, Material(n, (0.0,))))
    with mp.workdps(50):
        for pair in PAIRS + GRAZING:
            i, o = (direction(*w) for w in pair)
            h = np.hypot(*(i + o)[:2])
            slant = np.hypot(i[:2] @ (i + o)[:2] / h, i[2])
            for k in (1, 2, 3, 4, 5, 8, 9, 33):
                exact = float(chain_reference(k, i, o, gamma, sigma, n))
                rounding = np.finfo(float).eps * (128 + 8 * k + 8 / (h * slant))
                found = chain(k, *i, *o, parameters, facet)
                assert found == pytest.approx(exact, rel=rounding, abs=0), (pair, k)


def test_each_number_of_mirrors_is_reciprocal():
    parameters, facet = kernel_arguments(scene(2.0, (1.0, 0.6), Material(4.0, (0.0,))))
    seen = 0
    for k in range(1, 9):
        for i, o in zip(LIGHT, EYE, strict=True):
            there, back = (
                chain(k, *i, *o, parameters, facet) / o[2],
                chain(k, *o, *i, parameters, facet) / i[2],
            )
            assert there == pytest.approx(back, rel=1e-9)
            seen += there > 0
    assert seen > 20


def average(asked, ring, sector, order, rng, count=1500):
    """∫ f cosθ_o dω over a bin of the detector, its standard error, specular and body apart."""
    low, high = np.cos(np.radians(detector.RING_EDGES[[ring + 1, ring]]))
    z = rng.uniform(low, high, count)
    phi = rng.uniform(sector - 0.5, sector + 0.5, count) * 360 / detector.SECTORS
    o = np.array([direction(np.degrees(np.arccos(c)), d) for c, d in zip(z, phi, strict=True)])
    i = direction(asked.light.theta[0], 0)
    f, _ = evaluate_walk(asked, i, o, "vcavity-walk", 16, rng, (order, order))
    solid = (high - low) * 2 * np.pi / detector.SECTORS
    values = np.stack([f.specular, f.body]) * o[:, 2] * solid
    return values.mean(axis=1), values.std(axis=1) / np.sqrt(count)


@pytest.fixture(scope="module")
def walked(new_seed):
    """Walks in detector bins, by material, roughness and angle."""
    cases = {
        "IL": scene(2.0, (1.0,), Material(1.5, (0.8,)), 50.0),
        "IL, anisotropic": scene(1.7, (1.0, 0.4), Material(2.5, (0.8,)), 70.0),
        "gold": scene(2.0, (1.0,), GOLD, 60.0),
        "Lambertian": scene(8.0, (1.0,), Material(1.0, (0.8,)), 40.0),
    }
    return {
        name: (asked, model.walk(asked, "vcavity-walk", walks=3_000_000, seed=new_seed(1)))
        for name, asked in cases.items()
    }


@pytest.mark.parametrize("case", ["IL", "IL, anisotropic", "gold", "Lambertian"])
@pytest.mark.parametrize(("theta_o", "sector"), [(40, 0), (40, 18), (65, 9), (20, 4)])
def test_bins_of_the_walk_by_order(walked, case, theta_o, sector, judge):
    """f averaged over a bin against the walks that fell into it, order by order."""
    asked, found = walked[case]
    ring, material = detector.ring_of(theta_o), asked.material
    energy = datasets.by_kind(found.flux, material.n, material.kd[0]).isel(
        realisation=0, theta_i=0, phi_i=0, theta_o=ring, phi_o=sector
    )
    rows, rng = [], np.random.default_rng(judge.seed(0))
    for order in (1, 2, 3):
        mean, error = average(asked, ring, sector, order, rng)
        for k, kind in enumerate(detector.KINDS):
            share = energy.sel(order=order, kind=kind).item()
            spread = np.hypot(error[k], np.sqrt(max(share, 1e-6) / 3_000_000))
            rows.append((mean[k], share, spread))
    mean, share, spread = np.transpose(rows)
    judge.near(mean, share, spread)
    judge.tells(1.5 * mean, share, spread)  # the negative control: seen in some of them


def chain_energy(asked, k, rng, count=20_000):
    """∫ f cosθ_o dω_o of k mirrors, in polar coordinates of H: no caustic, no horizon."""
    parameters, facet = kernel_arguments(asked)
    i = direction(asked.light.theta[0], 0)
    values = np.zeros(count)
    for draw, azimuth in enumerate(rng.uniform(0, 2 * np.pi, count)):
        u = np.array([np.cos(azimuth), np.sin(azimuth)])
        longest = u @ i[:2] + np.sqrt((u @ i[:2]) ** 2 + i[2] ** 2)  # where o is at the horizon
        h = longest * rng.random()
        x, y = h * u - i[:2]
        z = np.sqrt(1 - x * x - y * y)
        values[draw] = 2 * np.pi * longest * h * chain(k, *i, x, y, z, parameters, facet) / z
    return values.mean(), values.std() / np.sqrt(count)


@pytest.mark.parametrize("case", ["IL", "IL, anisotropic", "gold"])
def test_chains_of_mirrors_carry_the_energy_of_the_walk(walked, case, judge):
    asked, found = walked[case]
    rows = []
    for k in (1, 2, 3):
        mean, error = chain_energy(asked, k, np.random.default_rng(judge.seed(k)))
        share = found.flux.isel(body_events=0).sel(order=k).sum().item()
        spread = np.hypot(error, np.sqrt(share / 3_000_000))
        rows.append((mean, share, spread))
        judge.tells(1.5 * mean, share, spread)  # the negative control
    judge.near(*np.transpose(rows))


@pytest.mark.parametrize(
    "asked", [scene(1.6), scene(8.0, (0.7, 0.2)), scene(2.0, (1.0,), Material(1.0, (0.8,)))]
)
def test_one_body_event_is_the_quadrature(asked, judge):
    rng = np.random.default_rng(judge.seed(6))
    f, se = evaluate_walk(asked, LIGHT, EYE, "vcavity-walk", 50_000, rng, (1, 1))
    specular, body = model.evaluate(asked, LIGHT, EYE, "vcavity")
    np.testing.assert_allclose(f.specular, specular, rtol=1e-12)
    judge.near(f.body, body, se.body)
    judge.tells(f.body, 1.05 * body, se.body)  # the negative control


def test_all_orders_are_reciprocal(judge):
    asked = scene(2.0, (1.0,), Material(1.5, (1.0,)))
    rng = np.random.default_rng(judge.seed(3))
    there, error = evaluate_walk(asked, LIGHT, EYE, "vcavity-walk", 40_000, rng)
    back, other = evaluate_walk(asked, EYE, LIGHT, "vcavity-walk", 40_000, rng)
    spread = np.hypot(error.total, other.total)
    judge.near(there.total, back.total, spread)
    off = there.total * LIGHT[:, 2] - back.total * EYE[:, 2]  # the negative control
    judge.tells(off, 0, spread)


def white(asked, walks, seed, last=10**9):
    """∫ f cosθ_o dω_o over the hemisphere, cosine-drawn o, and its standard error."""
    rng = np.random.default_rng(seed)
    z, turn = np.sqrt(rng.random(walks)), 360 * rng.random(walks)
    o = np.array([direction(np.degrees(np.arccos(c)), t) for c, t in zip(z, turn, strict=True)])
    i = direction(asked.light.theta[0], 0)
    f, _ = evaluate_walk(asked, i, o, "vcavity-walk", 2, rng, (1, last))
    return np.pi * f.body.mean(), np.pi * f.body.std() / np.sqrt(walks)


@pytest.mark.parametrize("roughness", [(1.7, (1.0,)), (8.0, (0.7, 0.2))])
@pytest.mark.parametrize("n", [1.0, 1.5, pytest.param(4.0, marks=pytest.mark.long)])
def test_a_white_substrate_gives_back_what_mirrors_do_not(roughness, n, judge):
    """Body light alone, whose lobes are smooth; what mirrors send is counted by the walk."""
    asked = scene(*roughness, Material(n, (1.0,)), 55.0)
    mirrored = model.walk(asked, "vcavity-walk", walks=400_000, seed=judge.seed(2)).flux.isel(
        body_events=0
    )
    expected, count = 1 - mirrored.sum().item(), 400_000
    mean, error = white(asked, 6000, seed=judge.seed(3))
    spread = np.hypot(error, np.sqrt(expected * (1 - expected) / count))
    judge.near(mean, expected, spread)
    capped, error = white(asked, 6000, seed=judge.seed(3), last=1)  # the negative control
    judge.tells(capped, expected, np.hypot(error, spread))


def test_long_chains_are_drawn_without_bias(judge):
    """Chains of 33 and more of a nearly perfect mirror: drawn against summed one by one."""
    asked = scene(1.6, (5.0,), Material(0.05, k=50.0))
    parameters, facet = kernel_arguments(asked)
    i, o, state = (
        direction(20, 0),
        direction(20.2, 60),
        stream(np.random.default_rng(judge.seed(0))),
    )
    summed = sum(chain(k, *i, *o, parameters, facet) for k in range(40, 200))
    drawn = np.zeros(20_000)
    more_mirrors(drawn, 40, 199, *i, *o, parameters, facet, state)
    error = np.std(drawn) / np.sqrt(len(drawn))
    judge.near(np.mean(drawn), summed, error)
    judge.tells(np.mean(drawn), 1.5 * summed, error)  # the negative control


def test_the_caustic_of_the_mirror_direction_is_finite():
    """Chains of two and more grow as 1/|H| towards it, and are cut off at 1e−9."""
    asked = scene(2.0, (1.0,), Material(1.5, (0.0,)))
    parameters, facet = kernel_arguments(asked)
    i = direction(40, 0)
    near, nearer = (chain(2, *i, *direction(40, 180 + d), parameters, facet) for d in (1e-4, 1e-5))
    assert nearer == pytest.approx(10 * near, rel=1e-3)
    i, o = np.array([i, direction(0, 0)]), np.array([direction(40, 180), direction(0, 0)])
    f, _ = evaluate_walk(asked, i, o, "vcavity-walk", 2, np.random.default_rng(0))
    assert np.isfinite(f.specular).all()


@pytest.mark.parametrize("material", [Material(1 + 1e-9, (0.0,)), Material(100.0, (0.5,)), GOLD])
@pytest.mark.parametrize("gamma", [1.501, 1e9])
@pytest.mark.parametrize("sigma", [1e-4, 10.0])
def test_corners_are_finite_and_never_negative(material, gamma, sigma):
    asked = scene(gamma, (sigma,), material)
    angles = [0.0, 45.0, 89.9, 89.99999]
    i = np.array([direction(a, 0) for a in angles for _ in angles])
    o = np.array([direction(b, 173) for _ in angles for b in angles])
    f, se = evaluate_walk(asked, i, o, "vcavity-walk", 2, np.random.default_rng(1))
    for values in (*f, *se):
        assert np.isfinite(values).all()
        assert (values >= 0).all()
