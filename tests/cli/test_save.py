"""Files of one run: all of them or none."""

import json

import pytest
from matplotlib.figure import Figure

from microsurf.cli.save import save


def test_each_content_in_its_format(tmp_path):
    contents = {
        "a.png": Figure(), "a.pdf": Figure(), "a.md": "σ\n", "a.json": {"x": 0.1},
        "a.csv": [{"x": 0.1, "y": None}, {"x": 2, "y": "σ"}],
    }  # fmt: skip
    save(tmp_path, contents, dpi=50)
    assert {path.name for path in tmp_path.iterdir()} == set(contents)
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "a.pdf").read_bytes().startswith(b"%PDF")
    assert (tmp_path / "a.md").read_bytes() == "σ\n".encode()
    assert json.loads((tmp_path / "a.json").read_text()) == {"x": 0.1}
    assert (tmp_path / "a.csv").read_bytes() == "x,y\n0.1,\n2,σ\n".encode()


def test_the_last_one_that_fails_leaves_none(tmp_path):
    with pytest.raises(ValueError, match="JSON"):
        save(tmp_path, {"a.md": "text", "a.json": {"x": float("nan")}}, dpi=50)
    assert list(tmp_path.iterdir()) == []
