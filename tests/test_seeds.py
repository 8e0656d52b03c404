"""Streams by name: the numbers are part of every result, and no two streams meet."""

from pathlib import Path

import numpy as np

from microsurf import seeds

PACKAGE = Path(__file__).parent.parent / "microsurf"
KEYS = {
    "SURFACES": (0, 3), "RAYS": (1, 3, 0, 2), "WALKS": (2, 0, 3), "VISIBILITY": (2, 3, 0, 2),
    "CONVERGENCE": (3, 3), "METHODS": (4, 3), "REFERENCES": (5, 3), "MESH_WALKS": (6, 0, 3),
    "SUBSTRATES": (7,), "SECOND_ENGINE": (8, 1, 0, 3),
}  # fmt: skip


def test_the_numbers_are_those_that_results_were_made_with():
    for name, (number, *place) in KEYS.items():
        assert getattr(seeds, name) == number
        sequence = np.random.SeedSequence(7, spawn_key=(number, *place))
        drawn = np.random.Generator(np.random.SFC64(sequence)).random(4)
        assert (seeds.generator(7, number, *place).random(4) == drawn).all()
        assert seeds.derived(7, number, *place) == sequence.generate_state(1)[0]


def test_streams_are_apart():
    states = {tuple(seeds.generator(7, *key).integers(2**63, size=2)) for key in KEYS.values()}
    assert len(states) == len(KEYS)


def test_spawn_keys_are_written_in_one_file():
    found = [p.name for p in PACKAGE.rglob("*.py") if "spawn_key" in p.read_text(encoding="utf-8")]
    assert found == ["seeds.py"]
