"""Bands of a single surface against what other rays on it really give."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from microsurf import trace
from microsurf.report.figures.bands import cut, half_widths, ray_errors
from microsurf.results import datasets, detector
from microsurf.scene import Accuracy, Light, Material, Roughness, Scene, Surface
from microsurf.surface import surfaces_of

REPEATS = 24
SCENE = Scene(
    material=Material(1.5, (0.8,)),
    roughness=Roughness(2.0, (0.5,)),
    surface=Surface(cells=256, realisations=1),
    accuracy=Accuracy(40_000),
)


@pytest.fixture(scope="module", params=[(0.0, (0.5,)), (60.0, (0.5,)), (60.0, (0.5, 0.4))])
def repeated(request, new_seed):
    """Independent rays on one surface, as realisations; isotropic lobes come folded."""
    theta, sigma = request.param
    scene = replace(SCENE, light=Light((theta,)), roughness=Roughness(2.0, sigma))
    surfaces = list(surfaces_of(scene, new_seed(1))) * REPEATS
    return scene, trace.measure(scene, surfaces, seed=new_seed(2), workers=1)


def curves(scene, dataset):
    density = cut(dataset, scene, 0.8)
    return {
        "specular": density.sel(order=1, kind="specular"),
        "body": density.sel(order=1, kind="body"),
        "total": density.sum(("order", "kind")),
    }


@pytest.fixture(scope="module")
def ratios(repeated):
    """Variance over repeats over the claimed one, mean over the bins that hold light enough."""
    scene, dataset = repeated
    dataset = dataset.isel(theta_i=0, phi_i=0)
    claimed = [ray_errors(dataset.isel(realisation=[r]), scene, 0.8) for r in range(REPEATS)]
    found = {}
    for key, curve in curves(scene, dataset).items():
        values = curve.transpose("realisation", "theta_o").values
        errors = np.mean([c[key] ** 2 for c in claimed], axis=0)
        enough = values.mean(axis=0) > values.mean() / 3
        found[key] = values.var(axis=0, ddof=1)[enough] / errors[enough]
    return found


def test_bands_of_order_1_are_the_spread_of_other_rays(repeated, ratios, judge):
    """Bins of 23 degrees of freedom, 60 of them specular: their mean is known to 4 %.

    A fan fills a whole sector: of the body lobe only the two half planes are independent.

    Stratified rays spread less than independent ones. A mean over all sectors (θ_i = 0)
    spreads less than they would on their own, because they share out the light.
    """
    _, dataset = repeated
    for key in ("specular", "body"):
        found = ratios[key]
        assert len(found) > 20
        dof = (REPEATS - 1) * (len(found) if key == "specular" else 2)
        least = 0.6 if float(dataset.theta_i[0]) > 0 else 0.1
        law = stats.chi2(dof)
        judge.keeps([law.sf(found.mean() * dof), law.cdf(found.mean() * dof / least)])


def test_bands_of_all_orders_are_an_upper_bound(ratios):
    found = ratios["total"]
    assert 0.01 < found.mean() < 1


def test_poisson_of_all_paths_would_not_be_the_spread(repeated):
    """Negative control: what stood here before took every path for a whole one."""
    scene, dataset = repeated
    dataset = dataset.isel(theta_i=0, phi_i=0)
    curve = curves(scene, dataset)["body"]
    values = curve.transpose("realisation", "theta_o").values
    size = datasets.in_plane(
        dataset.flux.isel(realisation=0, order=0, body_events=0) * 0
        + detector.projected_solid_angles()
    ).values
    if float(dataset.theta_i) == 0:
        size = size * detector.SECTORS
    poisson = values.mean(axis=0) / (size * float(dataset.paths[0]))
    enough = values.mean(axis=0) > values.mean() / 3
    ratio = values.var(axis=0, ddof=1)[enough] / poisson[enough]
    assert not 0.6 < ratio.mean() < 1 + 5 * np.sqrt(2 / (REPEATS - 1) / enough.sum())


def test_several_surfaces_have_bands_over_them(repeated):
    scene, dataset = repeated
    dataset = dataset.isel(theta_i=0, phi_i=0)
    given = curves(scene, dataset)
    widths = half_widths(given, dataset, scene, 0.8)
    wanted = given["body"].std("realisation", ddof=1).values * 2.0687 / np.sqrt(REPEATS)
    np.testing.assert_allclose(widths["body"], wanted, rtol=1e-4)
    alone = dataset.isel(realisation=[0])
    by_rays = ray_errors(alone, scene, 0.8)["body"] * 1.959964
    np.testing.assert_allclose(half_widths(given, alone, scene, 0.8)["body"], by_rays, rtol=1e-6)
