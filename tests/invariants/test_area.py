from dataclasses import replace

import numpy as np
import pytest

from microsurf.invariants import area, false_alarms
from microsurf.invariants.replicates import heights_of, tile_of
from microsurf.physics import smith
from microsurf.surface import generate_surface
from microsurf.trace import engine
from microsurf.trace.beam import light_direction


def tiles():
    return [
        tile_of(heights_of(generate_surface(*law, cells=area.CELLS, seed=5)))
        for law in area.SURFACES
    ]


@pytest.mark.parametrize("name", ["exact", "embree"])
def test_projected_area_holds(pool, name, judge):
    judge.pays(false_alarms.RATE / false_alarms.TESTS)
    facets, visible = area.projected_area(pool, judge.seed(5), name)
    assert facets.holds
    assert visible.holds


def test_a_mesh_with_a_gap_is_found():
    """The vertices past the period's end, which only its last cells have, are lowered."""
    period = engine.period_of(tiles()[1])
    assert area.vector_area(period) < 1e-12
    heights = period.heights.copy()
    heights[:, -1] -= 1e-3
    assert area.vector_area(replace(period, heights=heights)) > 1e-6


def test_facets_that_see_through_others_are_found(pool, monkeypatch):
    """Every eighth ray is let through."""
    right = engine.ways_out

    def leaky(*arguments):
        out = right(*arguments)
        out[::8] = True
        return out

    monkeypatch.setattr(engine, "ways_out", leaky)
    found = area.visible(pool, tiles(), (5, 2))
    assert found.value > 1.5 * found.tolerance


def test_mean_g1_of_a_large_mesh_is_smiths():
    """Azimuths together: 256² cells know the mean |slope| of γ = 8 to about 1 %.

    The surface is one for all runs: its slopes are made to follow STD, not drawn, and how
    they scatter about it has no law to take a level from.
    """
    tile = tile_of(heights_of(generate_surface(8.0, 0.5, cells=256, seed=1)))
    found = np.mean([area.mean_g1(tile, 75.0, phi) for phi in range(0, 360, 20)])
    assert abs(found / smith.g1(light_direction(75.0, 0.0), 8.0, 0.5) - 1) < 0.01
    assert abs(found / smith.g1(light_direction(75.0, 0.0), 8.0, 0.6) - 1) > 0.05
