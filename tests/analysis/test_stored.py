"""What is stored comes back with its types and bits, or not at all."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
import xarray as xr

from microsurf.analysis import stored
from microsurf.analysis.error_budget.terms import TermEstimate
from microsurf.scene import Roughness, Scene
from microsurf.scene.expectation import Expectation


@dataclass(frozen=True)
class Foreign:
    """A dataclass of another package."""

    value: int


def there_and_back(value, tmp_path):
    stored.save(tmp_path / "a.npz", "key", value)
    return stored.load(tmp_path / "a.npz", "key")[0]


@pytest.mark.parametrize(
    "value",
    [
        None,
        True,
        10**30,
        0.1,
        math.inf,
        "γ\n",
        [1, [2.0, ()], (None, "x")],
        {"a": 1, 0.5: {("b", 2.0): []}},
        TermEstimate(1.0, 2.0),
        [Scene(roughness=Roughness(2.0, (0.1, 0.2)), expect={"total": Expectation()})],
    ],
)
def test_plain_values(value, tmp_path):
    found = there_and_back(value, tmp_path)
    assert found == value
    assert repr(found) == repr(value)


def test_arrays_to_the_bit(tmp_path):
    sparse = np.zeros((50, 4))
    sparse[3, 1], sparse[7, 2], sparse[9, 0] = -0.0, np.nan, 1 / 3
    dense = np.random.default_rng(0).standard_normal((3, 2, 5)).transpose(2, 0, 1)
    value = {
        "sparse": sparse, "dense": dense, "none": np.zeros((0, 3)), "text": np.array(["a", "bc"]),
        "flags": np.array([True, False]), "whole": np.arange(3), "one": np.float64(0.1),
        "count": np.int64(7), "zero": np.array(0.0), "nought": np.float64(0),
    }  # fmt: skip
    found = there_and_back(value, tmp_path)
    for name, expected in value.items():
        assert type(found[name]) is type(expected)
        assert found[name].dtype == expected.dtype
        assert found[name].shape == expected.shape
        assert found[name].tobytes() == expected.tobytes()


def test_datasets(tmp_path):
    value = xr.Dataset(
        {"flux": (("x", "kind"), np.eye(2), {"units": "1"})},
        {"x": ("x", [0.5, 1.5], {"units": "degree"}), "kind": ["a", "b"], "w": ("x", [1, 2])},
        {"seed": 2**70, "seconds": 0.25, "scene": "…"},
    )
    found = there_and_back(value, tmp_path)
    xr.testing.assert_identical(found, value)
    assert list(found.coords) == list(value.coords)
    assert found.kind.dtype == value.kind.dtype


def test_what_does_not_fit_is_not_believed(tmp_path):
    path = tmp_path / "a.npz"
    assert stored.load(path, "key") is None
    stored.save(path, "key", {"x": np.arange(100.0)})
    assert stored.load(path, "key") is not None
    assert stored.load(path, "other key") is None
    renamed = path.rename(tmp_path / "b.npz")
    assert stored.load(renamed, "key") is None
    whole = renamed.rename(path).read_bytes()
    rng = np.random.default_rng(1)
    for _ in range(100):
        place = int(rng.integers(len(whole)))
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 1 << 3]) + whole[place + 1 :])
        found = stored.load(path, "key")  # a byte that says nothing, or nothing to believe
        assert found is None or found[0]["x"].tobytes() == np.arange(100.0).tobytes()
        path.write_bytes(whole[:place])
        assert stored.load(path, "key") is None


@pytest.mark.parametrize("value", [Foreign, object(), {1, 2}, np.array([None]), b"x"])
def test_what_can_not_be_stored_is_refused(value, tmp_path):
    with pytest.raises(TypeError, match="stored"):
        stored.save(tmp_path / "a.npz", "key", [value])
    assert list(tmp_path.iterdir()) == []


def test_only_dataclasses_of_ours_are_called(tmp_path):
    stored.save(tmp_path / "a.npz", "key", Foreign(1))
    assert stored.load(tmp_path / "a.npz", "key") is None


def test_what_would_not_fit_into_memory_is_not_read(tmp_path, monkeypatch):
    stored.save(tmp_path / "a.npz", "key", np.arange(1e5))
    monkeypatch.setattr("microsurf.memory.available", lambda: 1e5)
    assert stored.load(tmp_path / "a.npz", "key") is None
