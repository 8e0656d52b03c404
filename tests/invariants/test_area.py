import numpy as np

from microsurf.invariants import area, false_alarms
from microsurf.invariants.replicates import heights_of, tile_of
from microsurf.physics import smith
from microsurf.surface import generate_surface
from microsurf.trace.beam import light_direction


class Leaky:
    """Lets through every eighth ray that it is asked for."""

    def __init__(self, tile):
        self._tile = tile
        self.grid = tile.grid

    def intersect(self, origins, rays):
        """Find nothing for one in eight."""
        hits = self._tile.intersect(origins, rays)
        hits.triangle[::8] = -1
        return hits


def tiles():
    return [
        tile_of(heights_of(generate_surface(*law, cells=area.CELLS, seed=5)))
        for law in area.SURFACES
    ]


def test_projected_area_holds(pool, judge):
    judge.pays(false_alarms.RATE / false_alarms.TESTS)
    triangles, visible = area.projected_area(pool, seed=judge.seed(5))
    assert triangles.holds
    assert visible.holds


def test_a_mesh_with_a_gap_is_found():
    """The vertices past the period's end, which only its last cells have, are lowered."""
    grid = tiles()[1].grid
    assert area.vector_area(grid) < 1e-12
    heights = grid.heights.copy()
    heights[:, -2] -= 1e-3
    assert area.vector_area(grid._replace(heights=heights)) > 1e-6


def test_facets_that_see_through_others_are_found(pool):
    found = area.visible(pool, [Leaky(tile) for tile in tiles()], (5, 2))
    assert found.value > 1.5 * found.tolerance


def test_mean_g1_of_a_large_mesh_is_smiths():
    """Azimuths together: 256² cells know the mean |slope| of γ = 8 to about 1 %.

    The surface is one for all runs: its slopes are made to follow STD, not drawn, and how
    they scatter about it has no law to take a level from.
    """
    grid = tile_of(heights_of(generate_surface(8.0, 0.5, cells=256, seed=1))).grid
    found = np.mean([area.mean_g1(grid, 75.0, phi) for phi in range(0, 360, 20)])
    assert abs(found / smith.g1(light_direction(75.0, 0.0), 8.0, 0.5) - 1) < 0.01
    assert abs(found / smith.g1(light_direction(75.0, 0.0), 8.0, 0.6) - 1) > 0.05
