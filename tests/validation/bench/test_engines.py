"""Both engines answer every question of the table on the same surface."""

from types import SimpleNamespace

from validation.bench import engines
from validation.bench.run import Mesh


def test_a_row_for_each_question_and_angle(monkeypatch):
    monkeypatch.setattr(engines, "FULL", SimpleNamespace(meshes=(Mesh(2.0, 0.3, 32),)))
    monkeypatch.setattr(engines, "TURNS", 2)
    rows = engines.rows(200)
    assert len({(row["kind"], row["theta"]) for row in rows}) == len(rows) == 9
    for row in rows:
        assert 0 < row["low"] <= row["high"]
        assert row["ratio"] == row["embree_ns"] / row["exact_ns"]
