"""Pictures are all their files or none, the same bytes every time, and the CSV is what is drawn."""

import csv
import io
import os

import numpy as np
import pytest
from matplotlib import image
from matplotlib.figure import Figure

from microsurf.errors import InputError, MicrosurfError
from microsurf.report.figures import figure as picture
from microsurf.report.figures.figure import Picture, save
from microsurf.report.section import Section, Table

X = np.array([0.1, 1 / 3, 2e-7])


def made(name="a-picture", rows=None):
    figure = Figure(figsize=(3, 2), layout="constrained")
    axes = figure.subplots()
    axes.plot(X, X**2, marker="o", label="σ")
    axes.legend()
    rows = [{"x": x, "y": x**2} for x in X] if rows is None else rows
    return Picture(name, figure, "What it shows.", rows)


def test_a_small_vector_picture_is_kept_and_a_large_one_is_its_raster(tmp_path, monkeypatch):
    files = save(made(), tmp_path)
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir()} == {
        f"a-picture.{ending}": content for ending, content in files.items()
    }
    assert list(files) == ["svg", "png", "csv"]
    assert files["svg"].rstrip().endswith(b"</svg>")
    assert image.imread(tmp_path / "a-picture.png").shape[:2] == (400, 600)
    assert len(files["png"]) < len(files["svg"])
    monkeypatch.setattr(picture, "SMALL", 0)
    (tmp_path / "a-picture.svg").unlink()
    assert list(save(made(), tmp_path)) == ["png", "csv"]
    assert not (tmp_path / "a-picture.svg").exists()


def test_drawn_once_it_is_as_matplotlib_saves_it(tmp_path):
    files = save(made(), tmp_path)
    picture.write(made().figure, tmp_path / "saved.svg")
    assert files["svg"] == (tmp_path / "saved.svg").read_bytes()


def test_few_colours_are_close_to_all(tmp_path):
    """Letters, lines and their soft edges, beside the same in all colours."""
    drawn = made()
    save(drawn, tmp_path)
    drawn.figure.set_layout_engine("none")  # as it was laid out
    picture.write(drawn.figure, tmp_path / "all.png")
    few, full = (image.imread(tmp_path / name)[..., :3] for name in ("a-picture.png", "all.png"))
    assert np.abs(few - full).max() < 0.15
    assert np.abs(few - full).mean() < 0.003
    assert len(np.unique(few.reshape(-1, 3), axis=0)) <= picture.COLOURS


def test_the_same_picture_gives_the_same_bytes(tmp_path):
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        save(made(), tmp_path / folder)
    for file in (tmp_path / "one").iterdir():
        assert file.read_bytes() == (tmp_path / "two" / file.name).read_bytes(), file.name


def test_numbers_keep_all_their_digits():
    rows = list(csv.DictReader(io.StringIO(picture.as_csv(made().rows))))
    assert [float(row["x"]) for row in rows] == X.tolist()
    assert [float(row["y"]) for row in rows] == (X**2).tolist()


def test_columns_are_those_of_all_rows_and_what_is_missing_is_empty():
    text = picture.as_csv([{"a": 1, "b": np.float64(np.nan)}, {"a": np.int64(2), "c": 'x,"'}])
    assert text == 'a,b,c\n1,,\n2,,"x,"""\n'


@pytest.mark.parametrize("name", ["", "../up", "a/b", ".hidden", "a b", "a\0", "é", "x" * 200])
def test_names_that_are_none_of_a_file_are_refused(name):
    with pytest.raises(ValueError, match="name"):
        made(name)


def test_a_picture_without_numbers_is_refused():
    with pytest.raises(ValueError, match="numbers"):
        made(rows=[])


def test_all_or_nothing(tmp_path, no_room_for):
    save(made(), tmp_path)
    before = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    no_room_for(".csv")
    other = made(rows=[{"x": 9}])
    other.figure.axes[0].set_title("other")
    with pytest.raises(MicrosurfError, match="No space left"):
        save(other, tmp_path)
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == before


def test_a_folder_that_is_missing_or_locked_is_refused(tmp_path):
    with pytest.raises(InputError, match="does not exist"):
        save(made(), tmp_path / "missing")
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match=r"can't be written|does not exist"):
        save(made(), tmp_path / "file")
    locked = tmp_path / "locked"
    locked.mkdir(mode=0o500)
    if os.access(locked, os.W_OK):
        pytest.skip("whoever runs this may write anywhere")
    with pytest.raises(InputError, match="can't be written"):
        save(made(), locked)
    assert list(locked.iterdir()) == []


def test_cells_of_tables():
    table = Table("t", [{"a": 1}, {"b": None, "a": 2.0 / 3}], digits=3)
    assert table.columns == ["a", "b"]
    shown = [None, True, 123456, np.int64(123456), 2 / 3, np.float64(1e-9), "<b>"]
    assert [table.shown(value) for value in shown] == [
        "–", "yes", "123456", "123456", "0.667", "1e-09", "<b>",
    ]  # fmt: skip


def test_an_empty_line_ends_a_paragraph():
    assert Section("s", "S", "one\ntwo\n\n\nthree\n").paragraphs == ["one\ntwo", "three"]
