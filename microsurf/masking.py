"""Masking and shadowing of the explicit surface by slope, beside Smith's.

Where Smith's theory departs in the order-1 specular lobe, it is here that it does: D is
the mesh's own, F is the same. See `trace.visibility` for what is measured, `physics.smith`
for the theory; Smith's numbers are for the mesh's own slopes, at uniform azimuth.
"""

from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .physics import smith, std
from .physics.facet import mirror
from .physics.fresnel import reflectance
from .scene import Scene
from .surface import Heightfield, mesh, surfaces_of
from .trace.beam import direction
from .trace.embree import EmbreeTile
from .trace.grid import from_heights
from .trace.visibility import Facets, Visibility, facets_of, visibility

Array = NDArray[np.float64]

QUANTILES = (0.0, 0.25, 0.5, 0.75, 0.9, 0.97, 0.99, 0.999, 1.0)
"""Of STD's ρ: edges of the bins."""
RAYS = 65_536
"""For each θ and surface; as many shadow rays again."""
SIDES = 4
"""From which light comes in turn where all are one: so many azimuths of each surface."""
_GROUPS, _AZIMUTHS = 256, 64  # slopes of a bin, and azimuths, at which Smith is averaged
_LEAST_SURFACES = 2


class _Seen(NamedTuple):
    """Of one surface: facets and their mean ρ by groups, by bin; visibilities by θ and φ."""

    share: Array
    slopes: list[Array]
    beams: list[list[Visibility]]


def masking_by_slope(
    scene: Scene,
    surfaces: Iterable[Heightfield] | None = None,
    *,
    seed: int = 0,
    workers: int | None = None,
) -> list[dict[str, Any]]:
    """Measure G1 and G2 by facet slope on a scene's surfaces, beside Smith's for its STD.

    Parameters
    ----------
    scene : Scene
        Rough; its ``roughness`` gives the bins and Smith's theory.
    surfaces : iterable of Heightfield, optional
        One for each realisation, instead of those of the scene.
    seed : int
        Same seed, same numbers, whatever the workers.
    workers : int, optional
        Threads; by default as many as a ThreadPoolExecutor takes.

    Returns
    -------
    list of dict
        For each θ_i (at an anisotropic scene averaged over its φ_i, else over all sides) and
        bin of ρ = |(p/σ_x, q/σ_y)| that has facets facing the light:
        ``theta_i`` in degrees; ``rho_low``, ``rho_high`` (None: ∞); ``share`` of the projected
        area in the mesh, ``share_std`` in STD; ``facing``, the part of the light the bin would
        take without masking; ``g1``, ``g2``, the parts of it that are met, and that a mirror
        there sends out at once (0 below the horizon; height-correlated in Smith);
        ``specular``, the bin's part of the order-1 specular albedo per unit of ``share``.
        Each of these three with ``…_se``, its standard error over surfaces (over the rays if
        there is one), and ``…_smith``.

    Raises
    ------
    ValueError
        If the scene is flat.
    InputError
        If a surface can't be used or made.

    """
    rough = scene.roughness
    if not scene.requires.roughness or rough.sigma_x == 0:
        raise ValueError("a flat scene has no slopes to bin")
    edges = std.slope_quantile(QUANTILES, rough.gamma)
    made = surfaces_of(scene, seed) if surfaces is None else surfaces
    with ThreadPoolExecutor(workers) as crew:
        seen = [_look(scene, s, edges, seed, r, crew) for r, s in enumerate(made)]
    slopes = [np.concatenate([s.slopes[b] for s in seen]) for b in range(len(edges) - 1)]
    share = np.mean([s.share for s in seen], axis=0)
    rows: list[dict[str, Any]] = []
    for t, theta in enumerate(scene.light.theta):
        facing, measured = _units([s.beams[t] for s in seen])
        for b in np.flatnonzero(facing.mean(axis=0) > 0):
            theory = _smith(scene, theta, slopes[b])
            row: dict[str, Any] = {
                "theta_i": theta,
                "rho_low": float(edges[b]),
                "rho_high": float(edges[b + 1]) if np.isfinite(edges[b + 1]) else None,
                "share": float(share[b]),
                "share_std": QUANTILES[b + 1] - QUANTILES[b],
                "facing": float(facing[:, b].mean()),
            }
            below = {"g1": facing[:, b], "g2": facing[:, b]}
            for name, values in measured.items():
                over = below.get(name, np.full(len(values), share[b]))
                row[name], row[f"{name}_se"] = _ratio(values[:, b], over)
                row[f"{name}_smith"] = theory[name]
            rows.append(row)
    return rows


def _azimuths(scene: Scene, realisation: int) -> Array:
    """Where light comes from: the scene's φ, or all sides, other ones on each surface."""
    if not scene.roughness.isotropic or scene.surface.file is not None:
        return np.array(scene.light.phi)
    # Golden ratio: any number of surfaces has them spread evenly over the quarter turn.
    offset = realisation * (np.sqrt(5) - 1) / 2 % 1
    return np.asarray((np.arange(SIDES) + offset) * (360 / SIDES))


def _look(
    scene: Scene,
    surface: Heightfield,
    edges: Array,
    seed: int,
    realisation: int,
    crew: ThreadPoolExecutor,
) -> _Seen:
    made = mesh(surface)
    rough, material = scene.roughness, scene.material
    tile = EmbreeTile(from_heights(made.heights, made.flipped))
    facets = facets_of(tile.grid, rough.sigma_x, rough.sigma_y, edges)
    sides = _azimuths(scene, realisation)
    rays = -(-RAYS // len(sides))

    def beam(place: tuple[int, int]) -> Visibility:
        sequence = np.random.SeedSequence(seed, spawn_key=(2, realisation, *place))
        rng = np.random.Generator(np.random.SFC64(sequence))
        theta, phi = scene.light.theta[place[0]], float(sides[place[1]])
        return visibility(tile, facets, theta, phi, rays, rng, n=material.n, k=material.k)

    angles = range(len(scene.light.theta))
    found = list(crew.map(beam, [(t, s) for t in angles for s in range(len(sides))]))
    beams = [found[t * len(sides) : (t + 1) * len(sides)] for t in angles]
    share, slopes = _slopes(facets, rough.sigma_x, rough.sigma_y)
    return _Seen(share, slopes, beams)


def _slopes(facets: Facets, sigma_x: float, sigma_y: float) -> tuple[Array, list[Array]]:
    """Share of the facets in each bin, and the mean ρ of groups of like ones of the same size."""
    rho = np.hypot(facets.p / sigma_x, facets.q / sigma_y)
    counts = np.bincount(facets.bin, minlength=facets.bins)
    by_bin = np.split(np.sort(rho), np.cumsum(counts)[:-1])
    groups = [
        # Some of the flatter ones are left out, or groups would not weigh the same.
        of_bin[len(of_bin) % _groups(of_bin) :].reshape(_groups(of_bin), -1).mean(axis=1)
        for of_bin in by_bin
    ]
    return counts / len(rho), groups


def _groups(of_bin: Array) -> int:
    return max(min(len(of_bin), _GROUPS), 1)


def _units(beams: list[list[Visibility]]) -> tuple[Array, dict[str, Array]]:
    """What is independent, by bins: surfaces, means over φ; or the batches of rays of one."""
    facing = np.array([np.mean([v.facing for v in row], axis=0) for row in beams])
    names = {"g1": "met", "g2": "open", "specular": "specular"}
    batches = {
        key: np.array([np.mean([getattr(v, name) for v in row], axis=0) for row in beams])
        for key, name in names.items()
    }
    if len(beams) >= _LEAST_SURFACES:
        return facing, {key: values.mean(axis=1) for key, values in batches.items()}
    values = {key: found[0] for key, found in batches.items()}
    return np.repeat(facing, len(values["g1"]), axis=0), values


def _ratio(values: Array, over: Array) -> tuple[float, float]:
    """Ratio of two means over independent units, and its standard error (linearised)."""
    ratio = values.mean() / over.mean()
    spread = (values - ratio * over).std(ddof=1) / np.sqrt(len(values))
    return float(ratio), float(spread / over.mean())


def _smith(scene: Scene, theta: float, slopes: Array) -> dict[str, float]:
    """Smith's G1, G2 and specular part of facets of these ρ at uniform azimuth."""
    rough, material = scene.roughness, scene.material
    law = (rough.gamma, rough.sigma_x, rough.sigma_y)
    sides = _azimuths(scene, 0)[: 1 if rough.isotropic else None]
    turn = 2 * np.pi * (np.arange(_AZIMUTHS) + 0.5) / _AZIMUTHS
    p = rough.sigma_x * np.outer(slopes, np.cos(turn))
    q = rough.sigma_y * np.outer(slopes, np.sin(turn))
    m = std.normals(p, q)
    sums = np.zeros(4)
    for phi in sides:
        i = direction(theta, float(phi))
        slant = np.maximum(i[2] - i[0] * p - i[1] * q, 0)
        cosine = np.clip(slant * m[..., 2], 0, 1)
        o = mirror(i, m)
        g2 = np.where(slant > 0, smith.g2_height_correlated(i, o, *law), 0)
        g1 = smith.g1(i, *law)
        taken = slant / i[2]
        mirrored = reflectance(cosine, material.n, material.k)
        sums += [np.mean(v) for v in (taken, taken * g1, taken * g2, taken * g2 * mirrored)]
    facing, seen, passed, specular = sums
    return {
        "g1": float(seen / facing),
        "g2": float(passed / facing),
        "specular": float(specular / len(sides)),
    }
