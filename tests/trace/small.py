"""A measurement of many small work items, for tests of scheduling and checkpoints."""

from microsurf.scene import Accuracy, Light, Material, Roughness, Scene, Surface
from microsurf.trace import scheduler

PATHS_PER_ITEM = 2_000
"""Paths of a work item in these tests."""


def many_items(monkeypatch):
    """Make work items small in this process; whoever is sent one does what it says."""
    monkeypatch.setattr(scheduler, "PATHS_PER_ITEM", PATHS_PER_ITEM)


def scene(*, by_error=False, kd=0.8, realisations=3):
    """Two angles on ``realisations`` surfaces: five work items each, or what the error takes."""
    accuracy = (
        Accuracy(standard_error=3e-3, lobe_error=0.12) if by_error else Accuracy(5 * PATHS_PER_ITEM)
    )
    return Scene(
        roughness=Roughness(8.0, (0.2,)),
        material=Material(1.5, (kd,)),
        surface=Surface(cells=32, correlation=4.0, realisations=realisations),
        light=Light((0.0, 60.0)),
        accuracy=accuracy,
    )


def same(a, b):
    """Whether two measurements have the same bits, all but the time they took."""
    return a.drop_attrs().identical(b.drop_attrs())
