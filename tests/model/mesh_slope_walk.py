"""Walks among given slopes by rejection: slow, and nothing is weighed.

Visible facets have the density ∝ (c − ρ cosφ)₊ among those of the list, see
`model.mesh_slopes.slopes`. The walk is that of Heitz et al., ACM TOG 35(4), 2016, as in `walk`.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from microsurf.model.directions import direction
from microsurf.model.mesh_slopes.slopes import Slopes
from microsurf.model.random_walk.facet_kernels import ABSORBED, OVER
from microsurf.model.random_walk.parameters import walk_facet
from microsurf.model.random_walk.simulate import to_dataset
from microsurf.model.random_walk.tally import WalkTally, tally_walks
from microsurf.physics import facet, fresnel
from microsurf.results import detector
from microsurf.scene import Scene

Array = NDArray[np.float64]

_WALKS = 65_536  # at a time
_MOST = 10**6  # events: there to end a fault


@dataclass(frozen=True, eq=False)
class Facets(Slopes):
    """Slopes to draw from."""

    @cached_property
    def sums(self) -> Array:
        """Sums of ρ up to each facet, beginning with 0."""
        return np.concatenate([[0.0], np.cumsum(self.rho)])

    def visible(self, w: Array, rng: np.random.Generator) -> Array:
        """Draw a normal that is seen from each unit vector w, above the horizon or below."""
        across, turn = self.stretched(w)
        c = w[:, 2] / np.maximum(across, 1e-300)
        rho, azimuth = np.zeros(len(w)), np.zeros(len(w))
        count, sums = self.rho.size, self.sums
        pending = np.arange(len(w))
        while pending.size:
            at = c[pending]
            up = np.maximum(at, 0.0)
            # Facets that can be seen: all from above, those steeper than |c| from below.
            first = np.where(at < 0, np.searchsorted(self.rho, -at, side="right"), 0)
            first = np.minimum(first, count - 1)
            steep = sums[-1] - sums[first]
            flat = rng.random(pending.size) * (up * count + steep) < up * count
            place = np.searchsorted(
                sums, sums[first] + rng.random(pending.size) * steep, side="right"
            )
            chosen = np.where(flat, rng.integers(0, count, pending.size), place - 1)
            r = self.rho[np.clip(chosen, 0, count - 1)]
            phi = rng.uniform(-np.pi, np.pi, pending.size)
            kept = rng.random(pending.size) * (up + r) < at - r * np.cos(phi)
            done = pending[kept]
            rho[done], azimuth[done] = r[kept], phi[kept] + turn[done]
            pending = pending[~kept]
        return self.normals(rho, azimuth)


def walk_realised(scene: Scene, slopes: Slopes, *, walks: int, seed: int = 0) -> xr.Dataset:
    """All orders of Smith's theory of these slopes; a Dataset as `walk` gives.

    ``walks`` for each angle. The scene's own roughness is not used.
    """
    of_kernel = walk_facet(scene, max(scene.material.kd))
    totals = []
    for a, (theta, phi) in enumerate((t, p) for t in scene.light.theta for p in scene.light.phi):
        found = WalkTally.empty()
        for k in range(0, walks, _WALKS):
            sequence = np.random.SeedSequence(seed, spawn_key=(4, a, k))
            rng = np.random.Generator(np.random.SFC64(sequence))
            i = direction(np.radians(theta), np.radians(phi))
            count = min(_WALKS, walks - k)
            exits, events = _walk(scene, slopes, i, count, of_kernel.survival, rng)
            single = not scene.requires.multiple_scattering
            found = found + tally_walks(exits, events, phi, single=single)
        totals.append(found)
    return to_dataset(scene, "smith-walk", totals, of_kernel, {"seed": seed})


def _walk(
    scene: Scene, slopes: Slopes, i: Array, count: int, survival: float, rng: np.random.Generator
) -> tuple[Array, NDArray[np.int64]]:
    """Exits and events of ``count`` walks from i, see `walk_tally.tally`."""
    most = _MOST if scene.requires.multiple_scattering else 1
    exits, events = np.zeros((count, 3)), np.zeros((count, 2), np.int64)
    alive = np.arange(count)
    d, height = np.repeat(-i[None], count, axis=0), np.zeros(count)
    order, body = np.zeros(count, np.int64), np.zeros(count, np.int64)
    while alive.size:
        across, _ = slopes.stretched(d)
        z = np.abs(d[:, 2])
        area = across * slopes.excess(z / np.maximum(across, 1e-300)) + np.maximum(-d[:, 2], 0)
        with np.errstate(divide="ignore", invalid="ignore"):
            height = height - np.log1p(-rng.random(alive.size)) * d[:, 2] / area
        out = (d[:, 2] > 0) & ~(height < 0)  # NaN is 0 · ∞: nothing left to meet
        over = ~out & (order >= most)
        body = np.where(over, OVER, body)
        exits[alive[out]] = d[out]
        on = ~(out | over)
        done = alive[~on]
        events[done, 0], events[done, 1] = order[~on], body[~on]
        alive, d, height, order, body = alive[on], d[on], height[on], order[on], body[on]
        if not alive.size:
            break
        m = slopes.visible(-d, rng)
        d, was_body, absorbed = _scatter(scene, -d, m, body, survival, rng)
        order, body = order + 1, body + was_body
        ended = alive[absorbed]
        events[ended, 0], events[ended, 1] = order[absorbed], ABSORBED
        on = ~absorbed
        alive, d, height, order, body = alive[on], d[on], height[on], order[on], body[on]
    return exits, events


def _scatter(
    scene: Scene,
    i: Array,
    m: Array,
    body: NDArray[np.int64],
    survival: float,
    rng: np.random.Generator,
) -> tuple[Array, NDArray[np.bool_], NDArray[np.bool_]]:
    """One event: new directions, whether it was one of the body, whether the light ended."""
    material, needs = scene.material, scene.requires
    if material.conductor:
        mu = np.clip(np.sum(i * m, axis=-1), 0, 1)
        lost = rng.random(len(i)) >= fresnel.reflectance(mu, material.n, material.k)
        return facet.mirror(i, m), np.zeros(len(i), bool), lost
    o, was_body = facet.sample(i, m, material.n, rng)
    o /= np.linalg.norm(o, axis=-1, keepdims=True)
    if not needs.substrate:
        return o, was_body, was_body
    thinned = was_body & (body >= detector.BODY_EXACT)
    return o, was_body, thinned & (rng.random(len(i)) >= survival)
