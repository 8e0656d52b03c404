"""The walk in two layers: exact invariants, closed forms, limits, and defects that must show."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import integrate, special

from microsurf import model, seeds
from microsurf.errors import InputError
from microsurf.model.directions import direction
from microsurf.model.random_walk import layered_kernels
from microsurf.model.random_walk.layered_kernels import BELOW, OUTSIDE, layered_walk
from microsurf.model.random_walk.parameters import layered_facets, layered_slopes, stream
from microsurf.model.random_walk.simulate import MOST_EVENTS, arguments_of, walk
from microsurf.physics import facet, fresnel, smith
from microsurf.physics.thick_layers import thick_albedo
from microsurf.results import detector
from microsurf.results.layers import absorbed
from microsurf.scene import Layers, Light, Material, Roughness, Scene, Substrate
from microsurf.stats.hypothesis_tests import chi_square

KIND = "layered-walk"
FLAT = (8.0, 0.0)


def scene(above=(2.0, 0.5), below=(8.0, 0.7), n=1.5, kd=(0.8,), theta=(60.0,), absorption=0.0):
    """An interface and a substrate of (γ, σ)."""
    return Scene(
        material=Material(n, kd),
        roughness=Roughness(above[0], (above[1],)),
        light=Light(theta),
        layers=Layers(2.0, Substrate(below[0], (below[1],)), absorption),
    )


def area(gamma, sigma):
    """Area of the facets over that of the plane, E √(1 + slope²)."""

    def facets(u):
        return np.sqrt(1 + (gamma - 1) * sigma**2 * np.expm1(-np.log(u) / (gamma - 1)))

    return integrate.quad(facets, 0, 1, limit=400)[0]


class Furnace:
    """Paths of light from the Lambertian hemisphere, a few from each of many directions."""

    def __init__(self, of, seed, directions=200, rays=300, kernel=layered_walk):
        rng = np.random.default_rng(seed)
        slopes, facets, state = layered_slopes(of), layered_facets(of), stream(rng)
        self.squares = (np.arange(directions) + rng.random(directions)) / directions
        self.exits = np.zeros((directions, rays, 4))
        self.events = np.zeros((directions, rays, 5), np.int64)
        for k, square in enumerate(self.squares):
            i = direction(np.arcsin(np.sqrt(square)), 0.3)
            kernel(self.exits[k], self.events[k], MOST_EVENTS, i, slopes, facets, state)

    def mean(self, values):
        """Mean and standard error, by direction: strata's spread counts as error."""
        each = np.asarray(values, float).mean(1)
        return each.mean(0), each.std(0, ddof=1) / np.sqrt(len(each))

    def invariants(self):
        """Length inside, substrate events, hits from below, light within 45°; and errors."""
        inside = np.maximum(self.events[..., 1] - 1, 0)
        values = [self.exits[..., 3], inside, self.events[..., 3], self.exits[..., 2] ** 2 > 0.5]
        return self.mean(np.stack(values, -1))


def expected(of):
    n, upper, lower = of.material.n, of.roughness, of.layers.substrate
    return np.array(
        [
            4 * n**2,
            n**2 * area(lower.gamma, lower.sigma[0]),
            n**2 * area(upper.gamma, upper.sigma_x),
            0.5,
        ]
    )


WHITE = (1.0,)


@pytest.mark.parametrize(
    ("above", "below", "n"),
    [
        ((8.0, 0.5), (8.0, 0.5), 1.5),
        ((2.0, 0.5), (8.0, 0.7), 1.33),
        ((2.5, 1.0), (3.0, 0.4), 2.0),
        (FLAT, (8.0, 0.5), 1.5),
        ((2.0, 0.5), FLAT, 1.5),
    ],
)
def test_invariants_of_any_two_surfaces(judge, above, below, n):
    """Mean chord theorem, see docs/layers.md; and all light of a white substrate returns."""
    of = scene(above, below, n, WHITE)
    furnace = Furnace(of, judge.seed(1))
    assert (furnace.events[..., 1] >= 0).all()
    assert np.abs(np.linalg.norm(furnace.exits[..., :3], axis=-1) - 1).max() < 1e-12
    mean, error = furnace.invariants()
    judge.near(mean, expected(of), error)
    judge.tells(mean, expected(scene(above, below, 1.05 * n, WHITE)), error)


def _no_fresnel_inside(mu, squared, side, interface, state, right=layered_kernels.passes):
    return right(mu, squared, side, interface, state) if side == OUTSIDE else squared > 0


def _uniform(dx, dy, dz, mx, my, mz, body, substrate, state):
    """Uniform over the hemisphere of the facet."""
    del dx, dy, dz, substrate
    draw = layered_kernels.uniform
    z, turn = 2 * draw(state) - 1, 2 * np.pi * draw(state)
    d = np.array([np.sqrt(1 - z * z) * f(turn) for f in (np.cos, np.sin)] + [z])
    return *(d if d @ (mx, my, mz) > 0 else -d), body + 1


def _about_the_vertical(dx, dy, dz, mx, my, mz, body, substrate, state):
    """Lambertian about the mean normal, over the facet."""
    del dx, dy, dz, substrate
    while True:
        square, turn = (layered_kernels.uniform(state) for _ in range(2))
        ring = np.sqrt(square)
        d = np.array([ring * np.cos(2 * np.pi * turn), ring * np.sin(2 * np.pi * turn),
                      np.sqrt(1 - square)])  # fmt: skip
        if d @ (mx, my, mz) > 0:
            return *d, body + 1


def _inverse_index(*event, right=layered_kernels.interface_event.py_func):
    """Into the layer as if out of it, and the other way round."""
    *before, side, interface, state = event
    return right(*before, BELOW if side == OUTSIDE else OUTSIDE, interface, state)


DEFECTS = {
    "inverse index": {"interface_event": _inverse_index},
    "about the mean normal": {"scatter": _about_the_vertical},
    "no inner Fresnel": {"passes": _no_fresnel_inside},
    "uniform emission": {"scatter": _uniform},
    "no bending": {"refract": lambda dx, dy, dz, *_: (dx, dy, dz)},
}
"""Each conserves energy."""


@pytest.mark.parametrize("defect", [None, *DEFECTS])
def test_invariants_catch_what_conserves_energy(judge, monkeypatch, defect):
    """The same loop, not compiled."""
    of = scene((2.0, 1.0), (8.0, 0.7), 2.0, WHITE)
    steps = {
        name: getattr(layered_kernels, name).py_func for name in ("after_hit", "interface_event")
    }
    for name, wrong in {**steps, **DEFECTS.get(defect, {})}.items():
        monkeypatch.setattr(layered_kernels, name, wrong)
    furnace = Furnace(of, judge.seed(2), 100, 80, layered_walk.py_func)
    mean, error = furnace.invariants()
    compare = judge.near if defect is None else judge.tells
    compare(mean, expected(of), error)


def test_light_that_meets_the_interface_once_on_its_way_in(judge):
    """(1 + Λ) B(1 + Λ, 1 + Λ) of straight rays; negative control: heights not turned over."""
    of, i = scene((2.0, 0.7), n=1.0, kd=(0.0,)), direction(np.radians(75.0), 0.0)
    walks = 200_000
    events = np.zeros((walks, 5), np.int64)
    state = stream(np.random.default_rng(judge.seed(13)))
    arguments = layered_slopes(of), layered_facets(of)
    layered_walk(np.zeros((walks, 4)), events, MOST_EVENTS, i, *arguments, state)
    once = np.mean((events[:, 0] == 1) & (events[:, 3] == 0))
    lam = float(smith.smith_lambda(i, 2.0, 0.7))
    exact = (1 + lam) * special.beta(1 + lam, 1 + lam)
    error = np.sqrt(exact * (1 - exact) / walks)
    judge.near(once, exact, error)
    judge.tells(once, (1 + lam) / (1 + 2 * lam), error)


def test_reciprocity(judge):
    """In Lambertian light what goes from i to o goes from o to i: differences have no mean."""
    of = scene((2.0, 0.7), (8.0, 0.7), kd=(0.5,))
    furnace = Furnace(of, judge.seed(3), 1500, 100)
    weight = np.where(furnace.events[..., 1] >= 0, 1.0, 0.0)
    i, o = 1 - furnace.squares[:, None], furnace.exits[..., 2] ** 2
    for light, compare in ((weight, judge.near), (weight / np.sqrt(i), judge.tells)):
        odd = np.stack([light * (i - o), light * (i**3 - o**3), light * i * o * (i - o)], -1)
        mean, error = furnace.mean(odd)
        compare(mean, np.zeros(3), error)


@pytest.mark.parametrize("theta", [0.0, 60.0, 80.0])
def test_two_planes_are_one_facet(judge, theta):
    walked = walk(scene(FLAT, FLAT, kd=(1.0,), theta=(theta,)), KIND, walks=100_000,
                  seed=judge.seed(4))  # fmt: skip
    for kd in (0.5, 0.8):
        error = walked.microsurf.ray_error(kd=kd)
        closed = facet.albedo(np.cos(np.radians(theta)), 1.5, kd)
        judge.near(walked.microsurf.albedo(kd=kd), closed, error)
        judge.tells(walked.microsurf.albedo(kd=kd), closed + 0.02, error)
    assert float(walked.flux.sum()) == pytest.approx(1, abs=1e-12)


def test_without_an_index_the_substrate_is_alone(judge):
    """The walk of one Lambertian surface, in all light and in the third of rings at zenith."""
    of = scene((2.0, 0.7), (8.0, 0.7), 1.0)
    layered = walk(of, KIND, walks=200_000, seed=judge.seed(5))
    values, errors = _all_and_near(layered)
    for sigma, compare in ((0.7, judge.near), (0.5, judge.tells)):
        alone = replace(of, layers=None, roughness=Roughness(8.0, (sigma,)))
        others, spread = _all_and_near(walk(alone, walks=200_000, seed=judge.seed(6)))
        compare(values, others, np.hypot(errors, spread))
    assert float(layered.flux.isel(body_events=slice(0, 2)).sum()) == 0


def _all_and_near(walked):
    energy = walked.microsurf.lobe(None).squeeze()
    values = np.array([energy.sum(), energy.isel(theta_o=slice(detector.RINGS // 3)).sum()])
    return values, np.sqrt(values / float(walked.paths.sum()))


def test_what_was_never_inside_is_the_rough_mirror(judge):
    """Order 1 in the bins of the closed form; later orders as of the walk of a mirror."""
    of = scene(kd=(0.0,), n=2.0)
    layered = walk(of, KIND, walks=400_000, seed=judge.seed(7))
    mirror = replace(of, layers=None)
    closed = model.predict(mirror, "smith").flux.values[0, 0, 0, 0, 0] * 400_000
    counts = np.rint(layered.flux.values[0, 0, 0, 0, 0] * 400_000)
    judge.keeps(chi_square(counts, closed, total_fixed=False))
    judge.catches(chi_square(counts, np.roll(closed, 1, axis=-1), total_fixed=False))
    other = walk(mirror, walks=400_000, seed=judge.seed(8))
    later = [d.microsurf.albedo(2, "specular", kd=0.0).item() for d in (layered, other)]
    error = np.hypot(
        *(d.microsurf.ray_error(2, "specular", kd=0.0).item() for d in (layered, other))
    )
    judge.near(later[0], later[1], error)
    judge.tells(later[0], 1.2 * later[1], error)


@pytest.mark.parametrize(("below", "within"), [(FLAT, 0.0), ((8.0, 0.5), 3e-3)])
def test_the_closed_thick_limit(judge, below, within):
    """Exact over a plane, which sends out Lambertian light; negative control: r_e of a plane."""
    of = scene((2.0, 0.5), below)
    layered = walk(of, KIND, walks=400_000, seed=judge.seed(9))
    total, error = layered.microsurf.albedo().item(), layered.microsurf.ray_error().item()
    beam = layered.flux.isel(body_events=slice(0, 2)).sum().item()
    black = Furnace(replace(of, material=Material(1.5, (0.0,))), judge.seed(10), 2000, 100)
    diffuse, spread = black.mean(black.events[..., 1] >= 0)
    alone = Furnace(scene(FLAT, below, 1.0, WHITE), judge.seed(11))
    k = alone.mean(0.8 ** np.maximum(alone.events[..., 1] - 1, 0))[0]
    closed = thick_albedo(beam, diffuse, k, 1.5)
    slope = (thick_albedo(beam, diffuse + 1e-3, k, 1.5) - closed) / 1e-3
    error = np.hypot(error, slope * spread)
    judge.near(total, closed, error, within=within * closed)
    flat = thick_albedo(beam, fresnel.external_diffuse_reflectance(1.5), k, 1.5)
    judge.tells(total, flat, error, within=within * closed)


def test_absorption_between_two_planes(judge):
    """Against quadrature; negative control: half the absorption."""
    thickness = 0.15 * 2.0
    of = scene(FLAT, FLAT, absorption=0.15)
    walked = walk(of, KIND, walks=400_000, seed=judge.seed(12))
    total, error = walked.microsurf.albedo().item(), walked.microsurf.ray_error().item()
    judge.near(total, _planes_with(thickness), error)
    judge.tells(total, _planes_with(thickness / 2), error)
    assert float(walked.ended.sum() + walked.arrived.sum()) == 400_000


def _planes_with(thickness, n=1.5, kd=0.8, theta=60.0):
    """Albedo of a Lambertian plane under a plane interface with absorption between."""
    mu = np.cos(np.radians(theta))
    critical = np.sqrt(1 - 1 / n**2)

    def passing(inner):
        return fresnel.transmittance(np.sqrt(max(1 - n**2 * (1 - inner**2), 0.0)), n)

    def integral(f, low):
        return integrate.quad(f, low, 1, epsabs=1e-12, limit=200)[0]

    out = integral(lambda c: 2 * c * passing(c) * np.exp(-thickness / c), critical)
    back = integral(lambda c: 2 * c * (1 - passing(c)) * np.exp(-2 * thickness / c), critical)
    back += integrate.quad(lambda c: 2 * c * np.exp(-2 * thickness / c), 0, critical)[0]
    down = np.exp(-thickness / np.sqrt(1 - (1 - mu**2) / n**2))
    through = fresnel.transmittance(mu, n)
    return 1 - through + through * down * kd * out / (1 - kd * back)


@pytest.mark.parametrize("absorption", [0.0, 0.01, 0.1, 1.0])
def test_any_absorption_is_answered_afterwards(absorption):
    """From one walk, against each of its own paths; negative control: twice the gap."""
    answer = absorbed(walk(scene(), KIND, walks=20_000, seed=3), 1.5, 0.8, absorption)
    of = scene(absorption=absorption)
    arguments = arguments_of(of, KIND)
    exits, events = arguments.paths(20_000)
    state = stream(seeds.generator(3, seeds.WALKS, 0, 0))
    i = direction(np.radians(60.0), 0.0)
    layered_walk(exits, events, MOST_EVENTS, i, arguments.slopes, arguments.facets, state)
    exact = arguments.weights(exits, events).mean()
    assert answer.low.item() <= exact * (1 + 1e-12)
    assert exact <= answer.high.item() * (1 + 1e-12)
    assert answer.albedo.item() == pytest.approx(exact, abs=2e-4)
    exits[:, 3] *= 2
    if absorption > 0:
        assert abs(arguments.weights(exits, events).mean() - answer.albedo.item()) > 1e-3


@pytest.mark.parametrize("above", [(2.0, 0.5), FLAT])
def test_what_a_renderer_takes(above):
    """The walk's own paths; what a plane mirrors is a delta, and of an evaluation left out."""
    of = scene(above, absorption=0.05)
    brdf = model.Brdf(of, KIND, walks=4)
    i = np.tile(direction(np.radians(60.0), 0.0), (5_000, 1))
    drawn = brdf.sample(i, np.random.default_rng(5))
    exits, events = np.zeros((len(i), 4)), np.zeros((len(i), 5), np.int64)
    slopes, facets = layered_slopes(of), layered_facets(of)
    layered_walk(exits, events, MOST_EVENTS, i[0], slopes, facets, stream(np.random.default_rng(5)))
    np.testing.assert_array_equal(drawn.o, exits[:, :3])
    substrate = np.minimum(np.maximum(events[:, 1] - 1, 0), detector.BODY_EXACT - 1)
    left = 0.8**substrate * np.exp(-0.05 * 2.0 * exits[:, 3]) * (events[:, 1] >= 0)
    np.testing.assert_allclose(drawn.weight, left, rtol=1e-12)
    np.testing.assert_array_equal(drawn.delta, (events[:, 1] == 0) & (above == FLAT))
    assert drawn.delta.any() == (above == FLAT)
    assert (brdf.pdf(i, drawn.o)[drawn.weight > 0] > 0).all()
    few = i[:3], drawn.o[:3]
    values = brdf.evaluate(*few, np.random.default_rng(6))
    mean, _ = model.evaluate_walk(of, *few, KIND, 4, np.random.default_rng(6))
    np.testing.assert_array_equal(values, (mean.specular, mean.body))


def test_substrates_by_shape():
    """The same heights, scaled, and a plane, are surfaces of known slopes."""
    of = scene((2.0, 0.5), (2.0, 0.25))
    for substrate, same in (
        (Substrate(shape="same"), Substrate(2.0, (0.5,))),
        (Substrate(shape="same", sigma=(0.25,)), Substrate(2.0, (0.25,))),
        (Substrate(shape="flat"), Substrate(2.0, (0.0,))),
    ):
        pair = [
            walk(replace(of, layers=Layers(2.0, s)), KIND, walks=1000, workers=workers).flux
            for s, workers in ((substrate, 1), (same, 2))
        ]
        np.testing.assert_array_equal(*pair)


def test_what_it_does_not_know_is_refused_in_one_line():
    with pytest.raises(InputError, match=r"layered-walk: is of two layers; give .*\[layers\]"):
        walk(replace(scene(), layers=None), KIND)
    measured = replace(scene(), layers=Layers(2.0, Substrate(file="below.npy")))
    with pytest.raises(InputError, match=r"substrate.file = below.npy: is of unknown roughness"):
        walk(measured, KIND)
    up = np.array([[0.0, 0.0, 1.0]])
    with pytest.raises(InputError, match=r"smith-walk knows one surface"):
        model.evaluate_walk(scene(), up, up, "smith-walk", 2, np.random.default_rng(0))
    with pytest.raises(InputError, match=r"smith knows one surface"):
        model.evaluate(scene(), up, up)
    for name in (*model.order_one(), *model.all_orders()):
        with pytest.raises(InputError, match=rf"\[layers\]: the model {name} knows one surface"):
            model.Brdf(scene(), name)
    with pytest.raises(InputError, match=r"layered-walk: is of two layers"):
        model.Brdf(replace(scene(), layers=None), KIND)
    with pytest.raises(InputError, match=r"is of unknown roughness"):
        model.Brdf(measured, KIND)


# Single pairs of directions


def moments_of_walks(of, i, walks, seed):
    """Light, and light times z² and x where it leaves, with standard errors; of one Kd."""
    slopes, facets = layered_slopes(of), layered_facets(of)
    exits, events = np.zeros((walks, 4)), np.zeros((walks, 5), np.int64)
    layered_walk(exits, events, MOST_EVENTS, i, slopes, facets, stream(np.random.default_rng(seed)))
    events_below = np.maximum(events[:, 1] - 1, 0)
    weight = of.material.kd[0] ** np.minimum(events_below, detector.BODY_EXACT - 1)
    weight *= np.exp(-facets.thickness * exits[:, 3]) * (events[:, 1] >= 0)
    values = weight[:, None] * np.stack([np.ones(walks), exits[:, 2] ** 2, exits[:, 0]], -1)
    return values.mean(0), values.std(0) / np.sqrt(walks)


def moments_of_evaluation(of, i, directions, seed):
    """The same by f at Lambertian directions."""
    rng = np.random.default_rng(seed)
    square, turn = rng.random(directions), 2 * np.pi * rng.random(directions)
    ring = np.sqrt(square)
    o = np.stack([ring * np.cos(turn), ring * np.sin(turn), np.sqrt(1 - square)], -1)
    f, _ = model.evaluate_walk(of, np.tile(i, (directions, 1)), o, KIND, 4, rng)
    values = np.pi * f.total[:, None] * np.stack([np.ones(directions), o[:, 2] ** 2, o[:, 0]], -1)
    return values.mean(0), values.std(0) / np.sqrt(directions)


@pytest.mark.parametrize(
    ("above", "n", "kd", "absorption"),
    [
        ((2.0, 0.5), 1.5, 1.0, 0.0),
        ((8.0, 0.7), 2.0, 0.9, 0.05),
        ((2.0, 0.5), 1.0, 0.9, 0.05),
        (FLAT, 1.5, 0.9, 0.05),
    ],
)
def test_evaluation_adds_up_to_what_leaves(judge, above, n, kd, absorption):
    """A white furnace where nothing is lost; of a plane all but what it mirrors."""
    of, i = scene(above, n=n, kd=(kd,), absorption=absorption), direction(np.radians(50.0), 0.0)
    walked, error = moments_of_walks(of, i, 40_000, judge.seed(14))
    if above == FLAT:
        mirror = fresnel.reflectance(i[2], n)
        walked = walked - mirror * np.array([1, i[2] ** 2, -i[0]])
    elif kd == 1:
        assert walked[0] == pytest.approx(1, abs=1e-12)
    evaluated, spread = moments_of_evaluation(of, i, 12_000, judge.seed(15))
    judge.near(evaluated, walked, np.hypot(error, spread))
    judge.tells(evaluated, 1.1 * walked, np.hypot(error, spread))


PAIRS = (((30, 0), (40, 130)), ((80, 10), (70, 170)), ((60, 0), (60, 60)), ((85, 0), (20, 90)))


def ends():
    return (np.array([direction(*np.radians(pair[k])) for pair in PAIRS]) for k in (0, 1))


@pytest.mark.parametrize("above", [(2.0, 0.5), FLAT])
def test_pairs_of_directions_are_reciprocal(judge, above):
    of, (i, o) = scene(above, absorption=0.05), ends()
    rng = np.random.default_rng(judge.seed(16))
    there, error = model.evaluate_walk(of, i, o, KIND, 20_000, rng)
    back, other = model.evaluate_walk(of, o, i, KIND, 20_000, rng)
    spread = np.hypot(error.total, other.total)
    judge.near(there.total, back.total, spread)
    judge.tells(there.total * i[:, 2], back.total * o[:, 2], spread)


def test_order_one_specular_is_the_closed_form(judge):
    """Of pairs of directions; the walk draws heights, which are all that is random."""
    of, (i, o) = scene(), ends()
    rng = np.random.default_rng(judge.seed(17))
    value, error = model.evaluate_walk(of, i, o, KIND, 50_000, rng, (1, 1))
    closed, _ = model.evaluate(replace(of, layers=None), i, o, "smith")
    judge.near(value.specular, closed, error.specular)
    judge.tells(value.specular, 1.1 * closed, error.specular)
