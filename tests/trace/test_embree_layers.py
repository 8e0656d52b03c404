"""Two layers by Embree: what it shares with the exact engine is the detector alone."""

from dataclasses import replace

import numpy as np
import pytest
from layered_pairs import PAIRS, albedo, follow, optics, pair, relief

from microsurf.errors import InputError
from microsurf.invariants import referee
from microsurf.results import detector
from microsurf.scene import Accuracy, Layers, Light, Material, Roughness, Scene, Substrate, Surface
from microsurf.surface import Mesh
from microsurf.surface.layers import LayeredMesh
from microsurf.trace import embree_layers, engine, layers, measure
from microsurf.trace.kernels.exact_layers import (
    INNER_HITS,
    LENGTH,
    LENGTH_LIGHT,
    LENGTHS,
    REFLECTIONS_BY_ENTRIES,
    SUBSTRATE_EVENTS,
)

SCENE = Scene(
    material=Material(1.5, (0.8,)),
    roughness=Roughness(8.0, (0.5,)),
    surface=Surface(cells=64, correlation=4.0, realisations=1),
    light=Light((60.0,)),
    accuracy=Accuracy(4_000),
    layers=Layers(gap=2.0, substrate=Substrate(shape="same")),
)


def moments(tally):
    """Albedo, order-1 specular light and the sums of what was inside, with errors, by batches.

    The table of what was inside has no batches: its errors are those of counts, a path's
    number or length being spread about as exponentially.
    """
    mean, error = albedo(tally, 0.8)
    specular = tally.batches[:, 0, 0] / tally.batch_light
    sums = tally.inside[[LENGTH, SUBSTRATE_EVENTS, INNER_HITS]].sum(1) / tally.light
    spread = specular.std(ddof=1) / np.sqrt(len(specular))
    values = np.array([mean, specular.mean(), *sums])
    return values, np.array([error, spread, *(1.5 * sums / np.sqrt(tally.light))])


@pytest.mark.parametrize("name", PAIRS)
@pytest.mark.parametrize(
    "theta", [pytest.param(0, marks=pytest.mark.long), 60, pytest.param(80, marks=pytest.mark.long)]
)
def test_both_engines_see_the_same_light(judge, name, theta):
    """Negative control: n = 1.6."""
    exact, embree = layers.layered_tile(PAIRS[name]), embree_layers.layered_tile(PAIRS[name])
    ours = moments(follow(exact, theta, optics(1.5), seed=judge.seed(1)))
    for n, compare in ((1.5, judge.near), (1.6, judge.tells)):
        theirs = moments(follow(embree, theta, optics(n), 60_000, seed=judge.seed(2)))
        compare(theirs[0], ours[0], np.hypot(ours[1], theirs[1]), dof=60)


@pytest.mark.parametrize("gap", [0.05, 3.0])
def test_nothing_is_lost_but_what_slips_through(gap):
    both = pair(relief(1), relief(1), gap)
    for facets in (optics(1.5), optics(1.0), optics(1.5, substrate=False), optics(2.0, True, 0.3)):
        tally = follow(embree_layers.layered_tile(both, 0.01), 89.9, facets, 8_000)
        assert abs((tally.energy.sum() + tally.ended.sum()) / tally.light - 1) <= 1e-12
        assert tally.lost[1:].sum() <= 2
        passed = tally.inside[:REFLECTIONS_BY_ENTRIES].sum()
        lengths = tally.inside[LENGTH_LIGHT : LENGTH_LIGHT + LENGTHS].sum()
        assert passed == pytest.approx(lengths, rel=1e-12)
    clear = follow(embree_layers.layered_tile(both), 0, optics(1.5), 8_000)
    assert clear.ended[:2].sum() == 0


def test_cells_that_are_not_square(judge):
    """Cells twice as wide as deep, cut by both diagonals, against the exact engine."""
    rng = np.random.default_rng(1)
    flipped = rng.random((64, 64)) < 0.5
    above = Mesh(relief(1), flipped, 2.0)
    both = LayeredMesh(above, Mesh(relief(2) - 9.0, flipped, 2.0), 9.0)
    ours = moments(follow(layers.layered_tile(both), 70, optics(1.5), 60_000, judge.seed(3)))
    theirs = moments(
        follow(embree_layers.layered_tile(both), 70, optics(1.5), 60_000, judge.seed(4))
    )
    judge.near(theirs[0], ours[0], np.hypot(ours[1], theirs[1]), dof=60)


def test_a_scene_names_embree():
    measured = measure(replace(SCENE, accuracy=Accuracy(4_000, engine="embree")), seed=1)
    assert measured.attrs["engine"] == "embree"
    assert float(measured.passages.sum()) > 0
    assert 0 < measured.microsurf.albedo(kd=0.8).item() < 1


def test_the_referee_of_two_layers(judge, monkeypatch):
    """Negative control: Embree traces n = 1.6."""
    judge.pays(referee.RATE)
    agreed = referee.second_engine(SCENE, None, seed=judge.seed(5))
    assert agreed.holds, agreed
    assert 0 < agreed.figures["θ = 60°, order 1 body: embree"] < 1
    right = engine.EMBREE.layers

    def wrong(tile, theta, phi, facet, *rest, **more):
        return right.trace(tile, theta, phi, facet._replace(n=1.6), *rest, **more)

    changed = replace(engine.EMBREE, layers=replace(right, trace=wrong))
    monkeypatch.setattr(engine, "EMBREE", changed)
    assert not referee.second_engine(SCENE, None, seed=judge.seed(6)).holds


def test_an_engine_of_one_surface_is_refused_in_one_line(monkeypatch):
    monkeypatch.setattr(engine, "EMBREE", replace(engine.EMBREE, layers=None))
    with pytest.raises(InputError, match="it traces one surface only"):
        measure(replace(SCENE, accuracy=Accuracy(4_000, engine="embree")))


def test_bins_of_body_events_are_the_detectors():
    tally = follow(layers.layered_tile(PAIRS["same"]), 60, optics(1.5), 8_000)
    other = follow(embree_layers.layered_tile(PAIRS["same"]), 60, optics(1.5), 8_000)
    assert other.energy.shape[0] == tally.energy.shape[0] == len(detector.ORDERS)
    assert abs(other.energy.shape[1] - tally.energy.shape[1]) <= 5
