"""Multiple scattering by random walks: `walk`.

Among facets of independent heights (Heitz et al., ACM TOG 35(4), 2016), between both
facets of a V-cavity, or in two layers, see `model.registry`. No walk has a cap on its events.
"""

import time
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from tqdm import tqdm

from ... import memory, seeds
from ...errors import InputError
from ...results import detector
from ...results.layers import LENGTHS, substrate_events, with_lengths, with_substrate_events
from ...scene import Scene
from ...scene.layers import refuse, required
from ..directions import direction
from ..prediction import Attributes, prediction
from ..registry import MODELS, walk_of
from ..single_scattering import flat
from .parameters import (
    LayeredFacets,
    LayeredSlopes,
    SlopeParameters,
    WalkFacet,
    layered_facets,
    layered_slopes,
    slope_parameters,
    stream,
    walk_facet,
)
from .tally import CAUSES, WalkTally, tally_layered, tally_walks

Array = NDArray[np.float64]

CHUNK = 262_144
"""Walks of one work item; each is seeded by its place and adds up with the others."""
MOST_EVENTS = 10**9
"""Facet events after which a path counts as lost: there to end a fault, not to save time."""


def walk(
    scene: Scene,
    kind: str = "smith-walk",
    *,
    walks: int | None = None,
    seed: int = 0,
    workers: int | None = None,
    progress: bool = False,
) -> xr.Dataset:
    """Walk ``walks`` paths of light for every angle of the scene.

    Parameters
    ----------
    scene : Scene
        What to predict; its surface is not used.
    kind : str
        A model of all orders, see `model.registry`.
    walks : int, optional
        Paths for each angle; by default ``scene.accuracy.paths``.
    seed : int
        Same seed, same bits, whatever the number of workers.
    workers : int, optional
        Threads; default one for each core.
    progress : bool
        Show a progress bar on standard error if that is a terminal.

    Returns
    -------
    xarray.Dataset
        As `microsurf.results.datasets` describes, one realisation; with the numbers of ``paths``,
        of those that ``arrived`` and of those that ``ended`` otherwise (absorbed, left
        out, or lost because they were endless), and ``events`` (facet events in all)
        and ``seconds`` in its attributes. A flat scene (σ = 0) is answered exactly,
        without these numbers.

    Raises
    ------
    InputError
        If the kind is unknown, ``walks`` is not positive, or the scene has two layers and
        the kind one surface, or the other way round.

    """
    run = walk_of(kind).simulate
    arguments = arguments_of(scene, kind)
    walks = scene.accuracy.paths if walks is None else walks
    if walks < 1:
        raise InputError(f"walks = {walks}: must be 1 or more")
    begin = time.perf_counter()
    if not scene.requires.roughness:
        return _flat(scene, kind, begin)
    workers = workers or memory.cores()
    angles = list(product(scene.light.theta, scene.light.phi))
    count = -(-walks // CHUNK)
    sizes = [walks * (k + 1) // count - walks * k // count for k in range(count)]
    most = MOST_EVENTS if scene.requires.multiple_scattering else 1

    def work_item(a: int, k: int) -> WalkTally:
        rng = seeds.generator(seed, seeds.WALKS, a, k)
        theta, phi = angles[a]
        i = direction(np.radians(theta), np.radians(phi))
        exits, events = arguments.paths(sizes[k])
        run(exits, events, most, i, arguments.slopes, arguments.facets, stream(rng))
        if scene.layers is not None:
            thickness = scene.layers.absorption * scene.layers.gap
            return tally_layered(exits, events, phi, thickness, scene.layers.gap, rng)
        return tally_walks(exits, events, phi, single=not scene.requires.multiple_scattering)

    run(
        *arguments.paths(0), 1, np.zeros(3), arguments.slopes, arguments.facets,
        stream(np.random.default_rng(0)),
    )  # fmt: skip
    begin = time.perf_counter()  # after compilation
    bar = tqdm(
        total=len(angles) * walks / 1e6,
        disable=None if progress else True,
        desc=kind,
        unit=" Mwalks",
        bar_format="{desc}: {percentage:3.0f}%|{bar}| {n:.1f}/{total:.1f}{unit} "
        "[{elapsed}<{remaining}]",
    )
    totals: list[WalkTally] = [WalkTally.empty()] * len(angles)
    with bar, ThreadPoolExecutor(workers) as pool:
        places = list(product(range(len(angles)), range(count)))
        jobs = [pool.submit(work_item, *angle_and_chunk) for angle_and_chunk in places]
        try:
            for (a, k), job in zip(places, jobs, strict=True):
                totals[a] = totals[a] + job.result()
                bar.update(sizes[k] / 1e6)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    seconds = time.perf_counter() - begin
    attrs: Attributes = {"seed": seed, "seconds": seconds}
    return to_dataset(scene, kind, totals, arguments.weighed, attrs)


class Arguments(NamedTuple):
    """What the kernel of a walk is given, the facet whose events weigh, and columns of paths."""

    slopes: SlopeParameters | LayeredSlopes
    facets: WalkFacet | LayeredFacets
    weighed: WalkFacet
    columns: tuple[int, int]

    def paths(self, count: int) -> tuple[Array, NDArray[np.int64]]:
        """Exits and events that are not filled yet."""
        exits, events = self.columns
        return np.zeros((count, exits)), np.zeros((count, events), np.int64)

    def weights(self, exits: Array, events: NDArray[np.int64]) -> Array:
        """Light that each path carries where it leaves, 0 where it ended.

        Beyond BODY_EXACT events roulette has taken the place of the weight.
        """
        body = np.clip(events[:, 1], 0, detector.BODY_EXACT)
        left = np.where(events[:, 1] >= 0, 1.0, 0.0)
        if isinstance(self.facets, LayeredFacets):
            body = substrate_events(body)
            left *= np.exp(-self.facets.thickness * exits[:, 3])
        return np.asarray(left * np.power(self.weighed.survival, body))


def arguments_of(scene: Scene, kind: str) -> Arguments:
    """What the kernels of a walk are given for a scene, which must have layers if they need them.

    Raises
    ------
    InputError
        If the scene has two layers and the kind one surface, or the other way round.

    """
    if MODELS[kind].layered:
        required(scene.layers, f"the model {kind}")
        facets = layered_facets(scene)
        return Arguments(layered_slopes(scene), facets, facets.substrate, (4, 5))
    refuse(scene.layers, f"the model {kind}")
    rough = scene.roughness
    slopes = slope_parameters(rough.gamma, rough.sigma_x, rough.sigma_y)
    facet = walk_facet(scene, max(scene.material.kd))
    return Arguments(slopes, facet, facet, (3, 2))


def _flat(scene: Scene, kind: str, begin: float) -> xr.Dataset:
    """One flat facet: a ray meets it once, there is nothing to walk through."""
    bins = np.stack([flat.lobes(scene, theta) for theta in np.radians(scene.light.theta)])
    flux = np.repeat(bins[None, :, None, None], len(scene.light.phi), axis=2)
    attrs: Attributes = {"effects": _effects(scene), "seconds": time.perf_counter() - begin}
    return prediction(scene, kind, flux, attrs, orders=(1,))


def _effects(scene: Scene) -> str:
    needs = scene.requires
    names = ("interface", "substrate", "roughness", "multiple_scattering")
    effects = [name for name in names if getattr(needs, name)]
    if needs.roughness and not scene.roughness.isotropic:
        effects.append("anisotropy")
    return ", ".join(effects)


def to_dataset(
    scene: Scene, kind: str, totals: list[WalkTally], facet: WalkFacet, attrs: Attributes
) -> xr.Dataset:
    """Tallies of the scene's angles, θ outermost, as a Dataset."""
    thetas, phis = scene.light.theta, scene.light.phi
    shape = (1, len(thetas), len(phis))
    events = max(max(len(total.counts), len(total.lengths)) for total in totals)
    flux = np.zeros((*shape, len(detector.ORDERS), events, detector.RINGS, detector.SECTORS))
    beyond = np.maximum(detector.BODY_EVENTS[:events] - detector.BODY_EXACT, 0)
    path_weight = facet.survival**-beyond
    paths, arrived, ended = np.zeros(shape), np.zeros(shape), np.zeros((*shape, len(CAUSES)))
    lengths = np.zeros((2, *shape, LENGTHS, events))
    for a, total in enumerate(totals):
        index = (0, *divmod(a, len(phis)))
        paths[index] = total.paths
        arrived[index] = total.counts.sum()
        ended[index] = total.ended
        filled = total.counts.shape[0]
        flux[index][:, :filled] = np.swapaxes(total.counts, 0, 1) / total.paths
        inside = np.moveaxis(total.lengths, 0, -1) / total.paths
        lengths[:, *index, :, : inside.shape[-1]] = inside
    flux *= path_weight[:, None, None]
    attrs = {"effects": _effects(scene), **attrs, "events": sum(total.events for total in totals)}
    walked = prediction(scene, kind, flux, attrs, path_weight=path_weight)
    dims = ("realisation", "theta_i", "phi_i")
    walked["paths"], walked["arrived"] = (dims, paths), (dims, arrived)
    walked["ended"] = ((*dims, "cause"), ended)
    lost = [cause == "endless" for cause in CAUSES]
    walked = walked.assign_coords(cause=list(CAUSES), lost=("cause", lost))
    if MODELS[kind].layered:
        return with_substrate_events(with_lengths(walked, *(lengths * path_weight)))
    return walked
