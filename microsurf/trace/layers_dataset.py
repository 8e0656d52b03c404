"""What two layers add to a measurement: paths by their passages, and lengths inside."""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from ..results.layers import LENGTHS, with_lengths, with_substrate_events
from .kernels.exact_layers import (
    INNER_HITS,
    LENGTH,
    LENGTH_LIGHT,
    LENGTH_SUM,
    MANY,
    REFLECTIONS_BY_ENTRIES,
    SUBSTRATE_EVENTS,
)
from .wavefront import FacetOptics, Tally


def with_layers(
    measured: xr.Dataset, tallies: Sequence[Sequence[Tally]], facet: FacetOptics
) -> xr.Dataset:
    """Add what was inside, as parts of the incident light, before absorption on the way.

    ``passages`` by outer reflections and entries (3 is three or more); ``length_light`` and
    ``length_sum``, light and light times length inside, by bins of the length in cells;
    ``inside_sums``, light times length, substrate events, hits on the interface from
    below. All by substrate events, as at Kd = 1.
    """
    shape = measured.flux.shape[:3]
    events = measured.sizes["body_events"]
    table = np.zeros((*shape, len(tallies[0][0].inside), events))
    for r, row in enumerate(tallies):
        for a, tally in enumerate(row):
            index = (r, *divmod(a, shape[2]))
            table[index][:, : tally.inside.shape[1]] = tally.inside / tally.light
    table *= facet.path_weight(events)
    dims, last = ("realisation", "theta_i", "phi_i"), ("body_events",)
    passages = table[..., :REFLECTIONS_BY_ENTRIES, :].reshape(*shape, MANY + 1, MANY + 1, events)
    measured["passages"] = ((*dims, "reflections", "entries", *last), passages)
    measured["inside_sums"] = (
        (*dims, "inside_of", *last),
        table[..., [LENGTH, SUBSTRATE_EVENTS, INNER_HITS], :],
    )
    light, total = (table[..., row : row + LENGTHS, :] for row in (LENGTH_LIGHT, LENGTH_SUM))
    measured = with_lengths(measured, light, total).assign_coords(
        reflections=np.arange(MANY + 1),
        entries=np.arange(MANY + 1),
        inside_of=["length", "substrate events", "inner hits"],
    )
    return with_substrate_events(measured)
