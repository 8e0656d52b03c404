import json

import pytest

from microsurf.invariants import as_rows, broken, false_alarms, global_invariants


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 1])
def test_everything_holds(seed):
    found = global_invariants(seed)
    assert broken(found) == []
    assert len({row.name for row in found}) == len(found) == 19
    by_chance = [row for row in found if row.basis.startswith("largest |z|")]
    assert len(by_chance) <= false_alarms.TESTS
    json.dumps(as_rows(found), allow_nan=False)
