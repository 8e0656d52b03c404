import json

import numpy as np

from microsurf.invariants import Invariant, as_rows, broken

EXACT = Invariant("books", "all is there", 1e-13, 1e-12, "rounding", {"seen": 3.0})


def test_a_value_at_the_tolerance_holds_and_no_number_does_not():
    at, above, none = (Invariant("a", "b", value, 1.0, "c") for value in (1.0, 1.1, np.nan))
    assert (at.holds, above.holds, none.holds) == (True, False, False)
    assert broken([EXACT, at, above]) == ["a: 1.1, must be ≤ 1 (b)"]


def test_rows_are_strict_json():
    lost = Invariant("a", "b", np.inf, 0.0, "c", {"x": np.inf, "y": np.float64(2)}, "no worker")
    rows = json.loads(json.dumps(as_rows([EXACT, lost]), allow_nan=False))
    assert [row["holds"] for row in rows] == [True, False]
    assert [row["value"] for row in rows] == [1e-13, None]
    assert rows[1]["figures"] == {"x": None, "y": 2.0}
    assert broken([lost])[0].endswith("(b); no worker")
