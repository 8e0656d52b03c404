"""What a small validation spends its time on, cut for tests of all else."""

from microsurf.analysis import validate
from microsurf.report.figures import figure


def without_figures(patch):
    """Leave figures empty: they are two thirds of the time."""
    patch.setattr(figure, "_drawn", lambda *_: b"<svg/>")
    patch.setattr(figure, "_raster", lambda _: b"no PNG")


def with_few_walks(patch):
    """Predict with a fiftieth of the walks: a third of the time of a scene without figures."""
    patch.setattr(validate, "WALKS", 20_000)
