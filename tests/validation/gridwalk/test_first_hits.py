"""The exact engine and the grid walk name the same facets, at vertices and grazing too."""

from validation.gridwalk import first_hits


def test_engines_differ_in_ties_only(monkeypatch):
    """Negative control: the rows of the raised surface must differ by more."""
    monkeypatch.setattr(first_hits, "CELLS", 128)
    monkeypatch.setattr(first_hits, "SURFACES", ((2.0, 0.3), (1.75, 0.5)))
    rows = first_hits.rows(4000)
    assert [row["kind"] for row in rows if row["exact_beyond_ties"]] == ["control"] * 2
    assert not any(first_hits.broken(row) for row in rows)
    assert all(row["embree_beyond_rounding"] == 0 for row in rows if row["kind"] != "control")
    aimed = [row for row in rows if row["kind"] == "vertices"]
    assert all(float(row["embree_differs"]) > 1000 for row in aimed)  # vertices are met
