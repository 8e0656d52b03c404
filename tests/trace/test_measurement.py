from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from microsurf.physics import facet, fresnel, metals
from microsurf.results import albedos
from microsurf.scene import Accuracy, Effects, Light, Material, Roughness, Scene, Surface
from microsurf.surface import Heightfield, generate_surface
from microsurf.trace import measure


def scene(n=1.5, kd=(0.8,), sigma=0.5, theta=(60.0,), paths=100_000, realisations=1, **rest):
    return Scene(
        material=Material(n, kd),
        roughness=Roughness(2.0, (sigma,)),
        surface=Surface(cells=64, realisations=realisations),
        light=Light(theta),
        accuracy=Accuracy(paths),
        **rest,
    )


def total(measured, n=1.5, kd=0.8):
    """Total albedo of the first realisation and angle, and its standard error from the rays."""
    value = measured.microsurf.albedo(n=n, kd=kd).values.flat[0]
    return value, measured.microsurf.ray_error(n=n, kd=kd).values.flat[0]


def assert_books(measured):
    gap = (measured.arrived + measured.ended.sum("cause")) / measured.paths - 1
    assert float(np.abs(gap).max()) <= 1e-12


def test_same_seed_same_bits_whatever_the_workers():
    asked = scene(paths=600_000)  # three work items
    one, two, other = (measure(asked, seed=s, workers=w) for s, w in ((5, 1), (5, 3), (6, 1)))
    xr.testing.assert_identical(one.flux, two.flux)
    xr.testing.assert_identical(one.ended, two.ended)
    assert not np.array_equal(one.flux.values, other.flux.values)


def test_one_trace_answers_every_kd(judge):
    """Against runs of their own on the same surface."""
    colours = (0.2, 0.5, 0.8)
    made = [generate_surface(2.0, 0.5, cells=64, seed=3)]
    at_once = measure(scene(kd=colours, paths=400_000), made, seed=judge.seed(0))
    for seed, kd in enumerate(colours):
        alone = measure(scene(kd=(kd,), paths=400_000), made, seed=judge.seed(seed + 1))
        (a, error_a), (b, error_b) = total(at_once, kd=kd), total(alone, kd=kd)
        judge.near(a, b, np.hypot(error_a, error_b))
        judge.tells(a, 1.02 * b, np.hypot(error_a, error_b))  # negative control


def test_thinning_long_paths_is_unbiased(judge):
    """A pit where light bounces hundreds of times; Kd = 1 is never thinned out."""
    heights = np.zeros((4, 4))
    heights[0, 0] = 60.0
    pit = Heightfield(heights)
    asked = scene(n=1.0, kd=(0.97,), theta=(30.0,), paths=100_000)
    thinned = measure(asked, [pit], seed=judge.seed(0))
    bright = scene(n=1.0, kd=(1.0,), theta=(30.0,), paths=100_000)
    white = measure(bright, [pit], seed=judge.seed(1))
    assert thinned.path_weight.max() > 1.5
    assert (white.path_weight == 1).all()
    (a, error_a), (b, error_b) = total(thinned, 1.0, 0.97), total(white, 1.0, 0.97)
    judge.near(a, b, np.hypot(error_a, error_b))
    judge.tells(a, 1.05 * b, np.hypot(error_a, error_b))  # negative control
    long_paths = white.flux.sel(body_events=slice(17, None)).sum()
    assert long_paths > 0.01  # the comparison is about something


@pytest.mark.parametrize("n", [1.0, 1.5])
def test_a_flat_mesh_and_the_flat_short_cut_give_one_facet(n, judge):
    theta = (0.0, 30.0, 60.0, 80.0, 89.0)
    asked = scene(n=n, sigma=0.0, theta=theta)
    flat = Heightfield(np.zeros((16, 16)))
    for given in (None, [flat]):
        measured = measure(asked, given, seed=judge.seed(0))
        values = measured.microsurf.albedo(n=n, kd=0.8).values.ravel()
        errors = measured.microsurf.ray_error(n=n, kd=0.8).values.ravel()
        expected = facet.albedo(np.cos(np.radians(theta)), n, 0.8)
        judge.near(values, expected, errors, within=1e-12)
        wrong = facet.albedo(np.cos(np.radians(theta)), n, 0.81)
        judge.tells(values, wrong, errors, within=1e-12)


def test_unit_of_length_changes_nothing():
    """The same rays on the same surface, and no chance: the seed is the same for all runs."""
    made = generate_surface(2.0, 0.5, cells=64, seed=3)
    asked = scene()
    base = measure(asked, [Heightfield(made.heights)])  # as bare as the others
    for factor in (2.0**-30, 2.0**10):
        scaled = Heightfield(made.heights * factor, spacing=factor)
        xr.testing.assert_identical(measure(asked, [scaled]).flux, base.flux)
    value, error = total(base)
    for factor in (1e-9, 1e3):
        scaled = Heightfield(made.heights * factor, spacing=factor)
        assert abs(total(measure(asked, [scaled]))[0] - value) <= 0.1 * error


def test_rotating_surface_and_light_together_changes_nothing(judge):
    """A quarter turn flips the diagonals, so the mesh is another: 0.5 % beside what chance does.

    The surface is the same for all runs: the part of the diagonals is known of this one.
    """
    made = generate_surface(3.0, 0.3, 0.6, cells=128, seed=3)
    turned = Heightfield(np.rot90(made.heights, k=-1).copy())  # +x → +y with rows as y
    a = measure(scene(paths=300_000), [made], seed=judge.seed(0))
    asked = scene(paths=300_000)
    asked = Scene(asked.title, asked.rationale, asked.material, asked.roughness, asked.surface,
                  Light((60.0,), (90.0,)), asked.accuracy)  # fmt: skip
    b = measure(asked, [turned], seed=judge.seed(1))
    for name in ("specular", "body", "total"):
        x, y = (
            float(m.microsurf.albedo(**albedos.SELECTED[name], n=1.5, kd=0.8).item())
            for m in (a, b)
        )
        e = float(a.microsurf.ray_error(**albedos.SELECTED[name], n=1.5, kd=0.8).item())
        judge.near(y, x, np.sqrt(2) * e, within=0.005 * x)
    # Negative control: the light turned alone sees the other roughness.
    c = measure(asked, [made], seed=judge.seed(2))
    x, z = (
        float(m.microsurf.albedo(order=1, kind="specular", n=1.5, kd=0.8).item()) for m in (a, c)
    )
    e = float(a.microsurf.ray_error(order=1, kind="specular", n=1.5, kd=0.8).item())
    judge.tells(z, x, np.sqrt(2) * e, within=0.005 * x)


def test_effects_left_out():
    asked = scene(effects=Effects(multiple_scattering=False))
    measured = measure(asked)
    assert float(measured.flux.sel(order=slice(2, None)).sum()) == 0
    left_out = float(measured.ended.sel(cause="left out").sum() / measured.paths.sum())
    assert left_out > 0.01
    assert_books(measured)


def test_a_mirror_absorbs_what_it_lets_in():
    measured = measure(scene(kd=(0.0,)))
    assert measured.sizes["body_events"] == 1
    assert_books(measured)
    assert float(measured.ended_paths.sum()) == 0


def test_a_conductor_mirrors_and_absorbs(judge):
    """Flat gold reflects F; rough gold loses more at a second facet."""
    n, k = metals.GOLD[1].n, metals.GOLD[1].k
    gold = Material(n, k=k)
    theta = (0.0, 60.0, 85.0)
    flat = measure(replace(scene(sigma=0.0, theta=theta), material=gold))
    values, errors = (
        figure().values.ravel() for figure in (flat.microsurf.albedo, flat.microsurf.ray_error)
    )
    expected = fresnel.reflectance(np.cos(np.radians(theta)), n, k)
    np.testing.assert_allclose(values, expected, rtol=1e-11)
    assert (errors <= 1e-12).all()
    assert (np.abs(values / fresnel.reflectance(0.9, n, 1.1 * k) - 1) > 1e-3).all()
    rough = measure(replace(scene(theta=(0.0,)), material=gold), seed=judge.seed(0))
    assert float(rough.flux.sel(order=2).sum()) > 0
    assert_books(rough)
    albedo, error = total(rough, n, 0.0)
    assert albedo < expected[0]
    judge.tells(albedo, expected[0], error)


def test_nothing_comes_back_from_a_black_body():
    """Neither interface nor substrate: it must not be taken for a perfect mirror."""
    measured = measure(scene(n=1.0, kd=(0.0,)))
    assert float(measured.arrived.sum()) == 0
    assert float(measured.ended.sel(cause="absorbed").sum()) == pytest.approx(100_000)


@pytest.mark.long
@pytest.mark.parametrize("gamma", [1.75, 2.0, 8.0])
@pytest.mark.parametrize("n", [1.0, 1.33, 1.5, 2.4])
def test_books_close_on_3e6_paths(gamma, n):
    """Kd = 1: |albedo + lost − 1| ≤ 1e−12; nothing lost for γ ≥ 2, at most 30 for 1.75."""
    for sigma, theta in ((1.0, (0.0, 80.0)), (0.3, (60.0,))):
        asked = Scene(
            material=Material(n, (1.0,)),
            roughness=Roughness(gamma, (sigma,)),
            surface=Surface(cells=512, realisations=1),
            light=Light(theta),
            accuracy=Accuracy(3_000_000),
        )
        measured = measure(asked)
        albedo = measured.microsurf.albedo(n=n, kd=1.0).isel(realisation=0)
        lost = albedos.losses(measured)
        assert float(np.abs(albedo + albedos.lost_light(measured) - 1).max()) <= 1e-12
        assert sum(lost["lost_by_cause"].values()) <= (0 if gamma >= 2 else 30)
