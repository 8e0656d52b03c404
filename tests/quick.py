"""What a small validation spends its time on, cut for tests of all else."""

from dataclasses import replace
from functools import cache

from microsurf.analysis import validate
from microsurf.analysis.tradeoff import from_validation
from microsurf.model.single_scattering import first_order
from microsurf.report.figures import figure

_LOBES = {name: cache(getattr(first_order, name)) for name in ("body_bins", "specular_bins")}
"""Lobes of the first order by their arguments, which alone they depend on."""


def without_figures(patch):
    """Leave figures empty: they are two thirds of the time."""
    patch.setattr(figure, "_both", lambda _: (b"no PNG", b"<svg/>"))


def with_few_pixels(patch):
    """Draw pixels a sixteenth of the usual number: half of the time of a figure."""
    patch.setattr(figure, "DPI", 50)


def with_few_walks(patch):
    """Predict with a fiftieth of the walks, and each lobe once in all tests.

    Walks are a third of the time of a scene without figures, lobes half of the rest.
    """
    patch.setattr(validate, "WALKS", 20_000)
    few = replace(from_validation.EFFORT, walks=((1_000, 8), (10_000, 3)))
    patch.setattr(from_validation, "EFFORT", few)
    for name, remembered in _LOBES.items():
        patch.setattr(first_order, name, remembered)
