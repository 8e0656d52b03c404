"""Two explicit surfaces traced by the exact engine: an interface over a substrate."""

import time
from dataclasses import dataclass, replace

import numpy as np

from ..results import detector
from ..surface import LayeredMesh
from .beam import light_direction, stratified_points
from .exact import exact_tile
from .kernels.exact_layers import ROWS, Layers, LayerTallies, trace_layers
from .kernels.splitmix import stream
from .kernels.state import BATCHES, bins_about, empty_tallies
from .wavefront import FacetOptics, Tally, tally_of


@dataclass(frozen=True, eq=False)
class LayeredTile:
    """One period of both surfaces, ready for rays, and what a cell of length inside absorbs."""

    layers: Layers
    absorption: float = 0.0

    @property
    def engine(self) -> str:
        """Which engine it is ready for."""
        return "exact"

    @property
    def layered(self) -> bool:
        """Two surfaces."""
        return True


def layered_tile(pair: LayeredMesh, absorption: float = 0.0) -> LayeredTile:
    """Prepare both surfaces; ``absorption`` is per cell."""
    above, below = pair.interface, pair.substrate
    layers = Layers(
        exact_tile(above.heights, above.flipped, above.aspect, precise=True),
        exact_tile(-above.heights, above.flipped, above.aspect, precise=True),
        exact_tile(below.heights, below.flipped, below.aspect, precise=True),
    )
    return LayeredTile(layers, absorption)


def trace(
    tile: LayeredTile,
    theta: float,
    phi: float,
    facet: FacetOptics,
    paths: int,
    rng: np.random.Generator,
    *,
    part: int = 0,
    parts: int = 1,
    azimuth: float | None = None,
) -> Tally:
    """Follow paths of light from (θ, φ), in degrees, until each has ended.

    As `exact.trace`. ``facet.survival`` is the greatest Kd. Order is how often light meets the
    interface from outside. Body events are 0 for light that was never inside, and one more
    than the substrate events of light that was.
    """
    begin = time.perf_counter()
    light = -(-paths // facet.branches)
    above = tile.layers.above
    starts = stratified_points(light, rng, part, parts) * (above.columns, above.rows)
    tallies = empty_tallies()
    inside = np.zeros((ROWS, len(detector.BODY_EVENTS)))
    rays = trace_layers(
        tile.layers, starts, *-light_direction(theta, phi), facet, tile.absorption,
        bins_about(phi if azimuth is None else azimuth), LayerTallies(tallies, inside), stream(rng),
    )  # fmt: skip
    batch = np.arange(light) % BATCHES
    seconds = time.perf_counter() - begin
    tally = tally_of(tallies, facet, batch, (rays, 0, 0), (seconds, 0.0))
    return replace(tally, inside=inside[:, : tally.energy.shape[1]].copy())
