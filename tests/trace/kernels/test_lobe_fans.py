"""Fans against quadrature, and against lobes summed up over a profile that is known exactly."""

import itertools

import numpy as np
import pytest
from scipy import integrate, stats

from microsurf.physics import fresnel
from microsurf.results import detector
from microsurf.trace import wavefront
from microsurf.trace.beam import light_direction
from microsurf.trace.embree import EmbreeTile
from microsurf.trace.grid import from_heights
from microsurf.trace.kernels import lobe_fans

TILTS = [(1.0, 0.0), (0.8, 0.6), (0.8, -0.6), (0.6, 0.2), (0.01, 0.9999), (0.01, -0.9999)]
"""Normals by m_z and their part along the azimuth, m_t."""


def density(theta, mz, mt, n):
    mu = np.maximum(mz * np.cos(theta) + mt * np.sin(theta), 0.0)
    return mu * np.sin(theta) * (fresnel.transmittance(mu, n) if n > 1 else 1.0)


def light_between(low, high, mz, mt, n):
    """∫ of the density, in eight parts; none beyond where the facet looks."""
    high = min(high, np.pi / 2 + np.arctan2(mt, mz))
    if high <= low:
        return 0.0
    parts = np.linspace(low, high, 9)
    return sum(
        integrate.quad(density, a, b, args=(mz, mt, n), epsabs=1e-15)[0]
        for a, b in itertools.pairwise(parts)
    )


@pytest.mark.parametrize(("n", "tolerance"), [(1.0, 1e-9), (1.5, 1e-6), (2.4, 1e-6), (100, 1e-4)])
@pytest.mark.parametrize(("mz", "mt"), TILTS)
def test_shares_are_the_light_of_each_ring(mz, mt, n, tolerance):
    """Parts of all light, as the module's text says; at n = 100 T falls to 0 within a ring."""
    rings = lobe_fans.all_rings(n)
    light = np.zeros(len(rings.edges) - 1)
    count, total = lobe_fans.shares(mz, mt, np.pi / 2 + np.arctan2(mt, mz), rings, light)
    exact = np.array([light_between(a, b, mz, mt, n) for a, b in itertools.pairwise(rings.edges)])
    assert total == pytest.approx(light.sum(), rel=1e-13)
    assert not light[count:].any()
    np.testing.assert_allclose(light / total, exact / exact.sum(), atol=tolerance)
    # Negative control: the facet's horizon ignored, its last ring counted as a whole.
    if mt > 0:
        assert np.abs(light[:-1] / total - exact[1:] / exact.sum()).max() > tolerance


@pytest.mark.parametrize(("mz", "mt"), TILTS[:-1])
def test_directions_within_a_ring_follow_its_light(mz, mt):
    """Their distribution against quadrature, times the ring's light: 1e−4 of it all.

    Not where all that is seen lies within one ring, which happens to one azimuth in 1e4.
    """
    rings = lobe_fans.all_rings(1.5)
    light = np.zeros(len(rings.edges) - 1)
    count, total = lobe_fans.shares(mz, mt, np.pi / 2 + np.arctan2(mt, mz), rings, light)
    last = np.pi / 2 + np.arctan2(mt, mz)
    chances = (np.arange(500) + 0.5) / 500
    for ring in range(count):
        low, high = rings.edges[ring], min(rings.edges[ring + 1], np.pi / 2 + np.arctan2(mt, mz))
        theta = [lobe_fans.elevation(ring, mz, mt, last, chance, rings) for chance in chances]
        grid = np.linspace(low, high, 2001)
        below = integrate.cumulative_trapezoid(density(grid, mz, mt, 1.5), grid, initial=0)
        gap = np.abs(np.interp(theta, grid, below / below[-1]) - chances).max()
        assert gap * light[ring] / total < 1e-4


def profile(columns=48, seed=3):
    """Heights along x, periodic; the same for all y."""
    rng = np.random.default_rng(seed)
    x = np.arange(columns) * 2 * np.pi / columns
    return sum(
        rng.normal(0, 3.0 / k) * np.cos(k * x + rng.uniform(0, 2 * np.pi)) for k in range(1, 7)
    )


def horizon(heights, x, z, along):
    """cot θ of the horizon seen from (x, z), per unit of |cos φ|, looking to +x or −x."""
    periods = 40
    period = len(heights)
    at = np.arange(-periods * period, (periods + 1) * period + 1)
    ahead = (at[None] - x[:, None]) * along
    rise = heights[at % period][None] - z[:, None]
    with np.errstate(divide="ignore"):
        slope = np.where(ahead > 1e-9, rise / np.maximum(ahead, 1e-9), -np.inf)
    return slope.max(axis=1)


def summed_up(heights, theta, phi, n, *, shadowed=True, count=960, fine=4):
    """Order-1 body light by ring and sector: sums over points of the profile and directions."""
    period = len(heights)
    x = (np.arange(count) + 0.5) * period / count
    cell = x.astype(int)
    slope = heights[(cell + 1) % period] - heights[cell]
    z = heights[cell] + slope * (x - cell)
    normal = np.stack([-slope, 0 * slope, 1 + 0 * slope], axis=1)
    steep = np.sqrt(1 + slope**2)
    normal /= steep[:, None]
    horizons = {sign: horizon(heights, x, z, sign) for sign in (1, -1)}

    def visible(theta, azimuth):
        if not shadowed:
            return np.ones(count)
        across = np.cos(azimuth)
        limit = horizons[1 if across > 0 else -1] * np.abs(across)
        return 1 / np.tan(theta) > limit

    incident = light_direction(theta, phi)
    mu = np.maximum(normal @ incident, 0)
    lit = mu * fresnel.transmittance(mu, n) * visible(np.radians(theta), np.radians(phi))
    lit *= steep / np.cos(np.radians(theta)) / count
    whole = integrate.quad(lambda m: m * fresnel.transmittance(m, n), 0, 1)[0] * 2 * np.pi
    light = np.zeros((detector.RINGS, detector.SECTORS))
    for ring, sector in np.ndindex(light.shape):
        low, high = np.radians(detector.RING_EDGES[ring : ring + 2])
        theta_o = low + (np.arange(fine) + 0.5) / fine * (high - low)
        turn = np.radians(detector.SECTOR_EDGES[sector] + 10 * (np.arange(fine) + 0.5) / fine + phi)
        for t in turn:
            for o in theta_o:
                mu = np.maximum(normal @ light_direction(np.degrees(o), np.degrees(t)), 0)
                lobe = mu * fresnel.transmittance(mu, n) / whole * visible(o, t)
                light[ring, sector] += (lit @ lobe) * np.sin(o)
        light[ring, sector] *= (high - low) / fine * np.radians(10) / fine
    return light


def test_lobes_are_those_summed_up_over_a_profile(judge):
    """Chi-square over bins; without shadowing it must fail.

    The sums over points and directions are good to 1 %, the rays to 3 % a bin.
    """
    heights = profile()
    theta, phi, n = 50.0, 20.0, 1.5
    tile = EmbreeTile(from_heights(np.tile(heights, (4, 1)), np.zeros((4, len(heights)), bool)))
    facets = wavefront.FacetOptics(n, interface=True, substrate=True, multiple_scattering=True)
    tally = wavefront.trace(tile, theta, phi, facets, 150_000, np.random.default_rng(judge.seed(4)))
    seen, variance = tally.energy[0, 1] / tally.light, tally.squares[1] / tally.light**2
    for shadowed in (True, False):
        exact = summed_up(heights, theta, phi, n, shadowed=shadowed)
        lit = exact > 1e-5
        error = np.sqrt(variance + (0.01 * exact) ** 2)
        chi2 = (((seen - exact) / error)[lit] ** 2).sum()
        (judge.keeps if shadowed else judge.catches)(stats.chi2.sf(chi2, lit.sum()))
    # The errors are those of the rays: from four runs they are not too large either.
    assert np.median(np.sqrt(variance[lit]) / seen[lit]) < 0.05
