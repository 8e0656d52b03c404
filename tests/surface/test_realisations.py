"""Surfaces made side by side are those made one after the other, as many at once as fit."""

from dataclasses import replace

import numpy as np

from microsurf import memory
from microsurf.scene import Roughness, Scene, Surface
from microsurf.surface import all_surfaces_of, surfaces_of, write_surface

SCENE = Scene(roughness=Roughness(2.0, (0.3,)), surface=Surface(cells=32, realisations=5))


def same(one, other):
    pairs = list(zip(one, other, strict=True))
    return all(np.array_equal(a.heights, b.heights) for a, b in pairs) and len(pairs)


def test_they_are_the_same_to_the_bit():
    assert same(all_surfaces_of(SCENE, 7, 3), surfaces_of(SCENE, 7)) == 5
    assert not same(all_surfaces_of(SCENE, 8, 3), surfaces_of(SCENE, 7))


def test_a_file_is_read_once(tmp_path):
    write_surface(next(iter(surfaces_of(SCENE))), tmp_path / "s.npz")
    scene = replace(SCENE, surface=Surface(file=str(tmp_path / "s.npz")))
    assert same(all_surfaces_of(scene), surfaces_of(scene)) == 1


def test_no_more_than_fit_are_made_at_once(monkeypatch):
    monkeypatch.setattr(memory, "available", lambda: 3.5 * 10**6 * memory.EXACT_BYTES_PER_CELL)
    assert memory.at_once(10**6, 8) == 3
    assert memory.at_once(10**6, 2) == 2
    assert memory.at_once(10**9, 8) == 1  # whether it fits at all is asked elsewhere
    assert len(all_surfaces_of(SCENE, workers=8)) == 5
