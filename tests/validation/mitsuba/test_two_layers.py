"""Mitsuba's two layers: the flat ones in closed form, and rough ones against the exact engine."""

import numpy as np
import pytest

from microsurf.errors import MicrosurfError
from microsurf.physics import facet
from microsurf.surface import flat_layers
from validation.mitsuba import renderer, two_layers

try:
    renderer.load()
except MicrosurfError as absent:
    pytest.skip(str(absent), allow_module_level=True)

BATCHES, PATHS = 24, 2**15


def test_flat_layers_have_the_closed_albedo(judge):
    """Energy is carried through the interface, and hardly a path falls through a surface."""
    tile = renderer.MitsubaTile.layered(flat_layers(16, 0.7), 1.5, 0.8)
    for theta in (0.0, 70.0):
        draws = [tile.trace(theta, PATHS, judge.seed(k)) for k in range(BATCHES)]
        albedos = np.array([draw.flux.sum() for draw in draws])
        error = albedos.std(ddof=1) / np.sqrt(BATCHES)
        closed = facet.albedo(np.cos(np.radians(theta)), 1.5, 0.8)
        judge.near(albedos.mean(), closed, error, dof=BATCHES - 1)
        assert sum(sum(draw.lost.values()) for draw in draws) <= 1e-5 * BATCHES * PATHS


def test_rough_layers_are_those_of_the_exact_engine(judge):
    """Negative control: an interface of another index."""
    rows = two_layers.compare("independent, γ 8 over γ 3", 60.0, BATCHES, PATHS, judge.seed(100))
    assert {row["figure"] for row in rows} == set(two_layers.FIGURES)
    judge.keeps(two_layers.p_value(rows, "z", BATCHES))
    judge.catches(two_layers.p_value(rows, "z_of_n_1.52", BATCHES))
    lines = list(two_layers.said(rows, BATCHES))
    assert [line.split(":")[0] for line in lines] == ["z", "z_of_n_1.52"]
    assert "3 figures" in lines[0]


def test_cells_of_another_shape_are_refused():
    pair = flat_layers(16, 0.7)
    pair.interface.flipped[0, 0] = True
    with pytest.raises(ValueError, match="square cells"):
        renderer.MitsubaTile.layered(pair, 1.5, 0.8)
