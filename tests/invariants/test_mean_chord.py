"""The mean chord theorem as an invariant of scenes with two layers."""

from dataclasses import replace

import numpy as np
import pytest
from layered_pairs import PAIRS

from microsurf.invariants import mean_chord
from microsurf.invariants.mean_chord import area, expected
from microsurf.scene import Accuracy, Layers, Material, Roughness, Scene, Substrate, Surface
from microsurf.surface import Mesh
from microsurf.trace import engine, layers

SCENE = Scene(
    material=Material(1.5, (0.3,)),
    roughness=Roughness(8.0, (0.5,)),
    surface=Surface(cells=64, correlation=4.0),
    accuracy=Accuracy(1000, engine="exact"),
    layers=Layers(8.0, Substrate(8.0, (0.25,)), absorption=0.5),
)


def test_two_layers_keep_to_it():
    """Whatever absorbs in the scene."""
    found = mean_chord(SCENE, seed=3)
    assert found.holds, found.figures
    assert found.figures["length inside, must be"] == pytest.approx(4 * 1.5**2 * 8)


@pytest.mark.parametrize("defect", ["substrate too low", "absorbing", "another index"])
def test_planted_defects_break_it(monkeypatch, defect):
    """Each is traced in the place of what the scene says."""
    of = engine.EXACT.layers

    def low(pair, absorption):
        m = pair.substrate
        below = Mesh(m.heights - 0.5, m.flipped, m.aspect)
        return of.tile_of(replace(pair, substrate=below), absorption)

    def absorbing(pair, _):
        return layers.layered_tile(pair, 0.05)

    def bent(tile, theta, phi, facet, *rest, **more):
        return of.trace(tile, theta, phi, facet._replace(n=1.52), *rest, **more)

    planted = {
        "substrate too low": replace(of, tile_of=low),
        "absorbing": replace(of, tile_of=absorbing),
        "another index": replace(of, trace=bent),
    }[defect]
    monkeypatch.setattr(engine, "EXACT", replace(engine.EXACT, layers=planted))
    assert not mean_chord(SCENE, seed=3).holds


def test_areas_of_both_diagonals():
    """A cell split along either diagonal, and cells that are not square."""
    rng = np.random.default_rng(1)
    z = rng.random((4, 6))
    straight = np.zeros(z.shape, bool)
    # The other diagonal is that of the same heights seen in a mirror.
    mirrored = np.roll(z[:, ::-1], 1, axis=1)
    assert area(Mesh(z, ~straight)) == pytest.approx(area(Mesh(mirrored, straight)), rel=1e-12)
    assert area(Mesh(z, straight)) != pytest.approx(area(Mesh(z, ~straight)), rel=1e-3)
    ramp = np.tile([0.0, 1.0, 0.0, -1.0], (4, 1))
    assert area(Mesh(ramp, np.zeros((4, 4), bool), 2.0)) == pytest.approx(np.sqrt(2))
    assert area(Mesh(ramp.T, np.zeros((4, 4), bool), 2.0)) == pytest.approx(np.sqrt(5))
    both = PAIRS["flat over rough"]
    assert expected(both, 1.0)[2] == pytest.approx(1)
