"""Masking and shadowing of the explicit surface by slope, beside Smith's.

Where Smith's theory departs in the order-1 specular lobe, it is here that it does: D is
the mesh's own, F is the same. See `trace.visibility` for what is measured, `physics.smith`
for the theory. Smith's numbers are averages over the mesh's own slopes at uniform azimuth,
with Λ of all of STD: what a mesh lacks of the tail is 1 − Σ facing G1 of Smith's over the bins.
"""

from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import memory, seeds
from ..physics import smith, student_t
from ..physics.facet import mirror
from ..physics.fresnel import reflectance
from ..scene import Scene
from ..surface import Heightfield, mesh, surfaces_of
from ..trace import engine
from ..trace.beam import light_direction
from ..trace.visibility import MeshFacets, Visibility, facets_of, visibility

Array = NDArray[np.float64]

QUANTILES = (0.0, 0.25, 0.5, 0.75, 0.9, 0.97, 0.99, 0.999, 1.0)
"""Of STD's ρ: edges of the bins."""
RAYS = 32_768
"""For each θ and surface, and as many shadow rays: surfaces then differ by more than their rays."""
SIDES = 4
"""From which light comes in turn where all are one: so many azimuths of each surface."""
_GROUPS, _AZIMUTHS = 64, 64  # slopes of a bin on each surface, and azimuths, Smith is averaged at
_LEAST_SURFACES = 2


class _Seen(NamedTuple):
    """Of one surface: share of facets by bin, groups of them; visibilities by θ and φ."""

    share: Array
    groups: list[Array]
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
        Threads; default one for each core.

    Returns
    -------
    list of dict
        For each θ_i (averaged over the scene's φ_i, or over all sides if they are one) and
        bin of ρ = |(p/σ_x, q/σ_y)| that has facets facing the light:
        ``theta_i`` in degrees; ``rho_low``, ``rho_high`` (None: ∞); ``share`` of the projected
        area in the mesh, ``share_std`` in STD; ``facing``, the part of the light the bin would
        take without masking; ``g1``, ``g2``, the parts of it that are met, and that a mirror
        there sends out at once (0 below the horizon; height-correlated in Smith);
        ``specular``, the bin's part of the order-1 specular albedo per unit of ``share``.
        Each of these three with ``…_se``, its standard error over surfaces (over the rays if
        there is one: at most, rays are stratified), and ``…_smith``; ``lost``, the part
        of the rays of this θ_i that was lost.

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
    edges = student_t.slope_quantile(QUANTILES, rough.gamma)
    heightfields = surfaces_of(scene, seed) if surfaces is None else surfaces
    with ThreadPoolExecutor(workers or memory.cores()) as pool:
        by_surface = [_look(scene, s, edges, seed, r, pool) for r, s in enumerate(heightfields)]
    groups = [np.hstack([s.groups[b] for s in by_surface]) for b in range(len(edges) - 1)]
    share = np.mean([s.share for s in by_surface], axis=0)
    rows: list[dict[str, Any]] = []
    for t, theta in enumerate(scene.light.theta):
        facing, measured = _units([s.beams[t] for s in by_surface])
        beams = [v for s in by_surface for v in s.beams[t]]
        lost = sum(v.lost for v in beams) / sum(v.rays for v in beams)
        for b in np.flatnonzero(facing.mean(axis=0) > 0):
            theory = _smith(scene, theta, *groups[b])
            row: dict[str, Any] = {
                "theta_i": theta,
                "rho_low": float(edges[b]),
                "rho_high": float(edges[b + 1]) if np.isfinite(edges[b + 1]) else None,
                "share": float(share[b]),
                "share_std": QUANTILES[b + 1] - QUANTILES[b],
                "facing": float(facing[:, b].mean()),
                "lost": lost,
            }
            below = {"g1": facing[:, b], "g2": facing[:, b]}
            for name, values in measured.items():
                over = below.get(name, np.full(len(values), share[b]))
                row[name], row[f"{name}_se"] = _ratio(values[:, b], over)
                row[f"{name}_smith"] = theory[name]
            rows.append(row)
    return rows


def _azimuths(scene: Scene, surface: Heightfield, realisation: int) -> Array:
    """Where light comes from: as in `measure` the scene's φ, or all sides if they are one."""
    recipe = surface.recipe
    if (
        scene.requires.azimuth
        or "sigma_x" not in recipe
        or recipe["sigma_x"] != recipe.get("sigma_y")
    ):
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
    pool: ThreadPoolExecutor,
) -> _Seen:
    surface_mesh = mesh(surface)
    rough, material = scene.roughness, scene.material
    tile = engine.tile_of(engine.engine_of(scene), surface_mesh)
    facets = facets_of(tile, rough.sigma_x, rough.sigma_y, edges)
    sides = _azimuths(scene, surface, realisation)
    rays = -(-RAYS // len(sides))

    def beam(index: tuple[int, int]) -> Visibility:
        rng = seeds.generator(seed, seeds.VISIBILITY, realisation, *index)
        theta, phi = scene.light.theta[index[0]], float(sides[index[1]])
        return visibility(tile, facets, theta, phi, rays, rng, n=material.n, k=material.k)

    angles = range(len(scene.light.theta))
    of_beams = list(pool.map(beam, [(t, s) for t in angles for s in range(len(sides))]))
    beams = [of_beams[t * len(sides) : (t + 1) * len(sides)] for t in angles]
    return _Seen(*_groups(facets, rough.sigma_x, rough.sigma_y), beams)


def _groups(facets: MeshFacets, sigma_x: float, sigma_y: float) -> tuple[Array, list[Array]]:
    """Share of the facets in each bin; mean ρ and number of groups of like ones, shape (2, …)."""
    rho = np.hypot(facets.p / sigma_x, facets.q / sigma_y)
    counts = np.bincount(facets.bin, minlength=facets.bins)
    groups = []
    for of_bin in np.split(np.sort(rho), np.cumsum(counts)[:-1]):
        count = min(len(of_bin), _GROUPS)
        begin = np.arange(count) * len(of_bin) // max(count, 1)
        size = np.diff(begin, append=len(of_bin))
        sums = np.add.reduceat(of_bin, begin) if count else np.empty(0)
        groups.append(np.stack([sums / size[:count], size[:count]]))
    return counts / len(rho), groups


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
    values = {key: result[0] for key, result in batches.items()}
    return np.repeat(facing, len(values["g1"]), axis=0), values


def _ratio(values: Array, over: Array) -> tuple[float, float]:
    """Ratio of two means over independent units, and its standard error (linearised)."""
    ratio = values.mean() / over.mean()
    spread = (values - ratio * over).std(ddof=1) / np.sqrt(len(values))
    return float(ratio), float(spread / over.mean())


def _smith(scene: Scene, theta: float, slopes: Array, numbers: Array) -> dict[str, float]:
    """Smith's G1, G2 and specular part of so many facets of these ρ at uniform azimuth."""
    rough, material = scene.roughness, scene.material
    slope_parameters = (rough.gamma, rough.sigma_x, rough.sigma_y)
    sides = scene.light.phi[: 1 if rough.isotropic else None]
    turn = 2 * np.pi * (np.arange(_AZIMUTHS) + 0.5) / _AZIMUTHS
    p = rough.sigma_x * np.outer(slopes, np.cos(turn))
    q = rough.sigma_y * np.outer(slopes, np.sin(turn))
    m = student_t.normals(p, q)
    sums = np.zeros(4)
    for phi in sides:
        i = light_direction(theta, float(phi))
        slant = np.maximum(i[2] - i[0] * p - i[1] * q, 0)
        cosine = np.clip(slant * m[..., 2], 0, 1)
        o = mirror(i, m)
        g2 = np.where(slant > 0, smith.g2_height_correlated(i, o, *slope_parameters), 0)
        g1 = smith.g1(i, *slope_parameters)
        taken = slant / i[2]
        mirrored = reflectance(cosine, material.n, material.k)
        values = (taken, taken * g1, taken * g2, taken * g2 * mirrored)
        sums += [np.average(v.mean(axis=1), weights=numbers) for v in values]
    facing, visible, passed, specular = sums
    return {
        "g1": float(visible / facing),
        "g2": float(passed / facing),
        "specular": float(specular / len(sides)),
    }
