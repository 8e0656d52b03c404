"""Units by silence, slopes that no surface has, seams of a period that is none."""

import numpy as np
import pytest
from judge import rate

from microsurf.errors import InputError
from microsurf.scene import Scene, Surface
from microsurf.surface import (
    Heightfield,
    generate_surface,
    notes_on_file,
    surface_of,
    write_surface,
)
from microsurf.surface.plausibility import assumed, hints, require_traceable


@pytest.mark.parametrize("factor", [1e-9, 1e-7, 1e5, 1e12])
def test_slopes_that_can_not_be_traced_are_refused(factor):
    h = generate_surface(2.0, 0.5, cells=32, seed=1)
    with pytest.raises(InputError, match=r"h\.npy: its median slope.*spacing \(1\).*same unit"):
        require_traceable(Heightfield(h.heights * factor), "h.npy")


@pytest.mark.parametrize("sigma", [1e-6, 1e-3, 0.5, 1000.0])
@pytest.mark.parametrize("gamma", [1.65, 2.0, np.inf])
def test_every_roughness_a_scene_may_have_passes(gamma, sigma):
    require_traceable(generate_surface(gamma, sigma, cells=64, seed=1), "h")


@pytest.mark.parametrize(("factor", "word"), [(1e-4, "flat"), (100.0, "steep")])
def test_slopes_of_another_unit_are_pointed_out(factor, word):
    h = generate_surface(2.0, 0.5, cells=128, seed=1)
    (note,) = hints(Heightfield(h.heights * factor), "h")
    assert f"very {word}" in note
    assert "same unit" in note


def test_flat_heights_are_a_mirror():
    assert hints(Heightfield(np.zeros((8, 8))), "h") == []


def test_a_needle_and_a_cliff_on_a_plane_are_no_fault_of_units():
    needle, cliff = np.zeros((64, 64)), np.zeros((64, 64))
    needle[32, 32] = 1e4
    cliff[:, 16:48] = 1e5
    for heights in (needle, cliff):
        (note,) = hints(Heightfield(heights), "h")
        assert "very steep" in note


def test_a_seam_is_seen_in_a_cut_map_and_a_tilt():
    """A map cut from a surface meets itself where heights know nothing of each other."""
    h = generate_surface(2.0, 0.5, cells=256, seed=1)
    cut = Heightfield(h.heights[:100, :100])
    notes = hints(cut, "cut")
    assert len(notes) == 2
    assert "seam in x" in notes[0]
    assert "boundary mirror" in notes[0]
    assert hints(Heightfield(cut.heights, boundary="mirror"), "cut") == []
    (tilt,) = hints(Heightfield(h.heights + 0.3 * np.arange(256)), "tilt")
    assert "seam in x" in tilt
    (tilt,) = hints(Heightfield(h.heights + 0.3 * np.arange(256)[:, None]), "tilt")
    assert "seam in y" in tilt


@pytest.mark.parametrize("cells", [64, 128])
def test_generated_surfaces_have_no_seam(judge, cells):
    """Once in as many surfaces as there are lines; against the mean it was 1 in 20 at 64²."""
    made = (
        generate_surface(2.0, 0.5, cells=cells, seed=judge.seed(s), iterations=3) for s in range(60)
    )
    notes = [note for h in made for note in hints(h, "h")]
    judge.keeps(rate(len(notes), 120, 0.0, 1 / cells))
    assert all("seam" in note for note in notes)


def test_seams_of_small_cuts_are_seen(judge):
    """Negative control: at most 2 % of them are missed."""
    made = (generate_surface(2.0, 0.5, cells=64, seed=s, iterations=3).heights for s in range(40))
    notes = [note for h in made for note in hints(Heightfield(h[:45, :45]), "cut")]
    judge.catches(rate(len(notes), 80, 0.0, 1 / 45))
    assert len(notes) > 70


def test_a_grating_has_no_seam_where_its_walls_are_as_steep():
    """The wall on the seam is one of many."""
    rough = 0.01 * np.random.default_rng(3).random((64, 64))
    assert hints(Heightfield(np.where(np.arange(64) // 8 % 2, 1.0, 0.0) + rough), "h") == []


def test_bare_heights_say_what_is_taken(tmp_path):
    path = str(tmp_path / "h.npy")
    assert assumed(Surface()) == []
    assert assumed(Surface(file="h.npz")) == []
    assert assumed(Surface(file=path, spacing=0.1, boundary="mirror")) == []
    (note,) = assumed(Surface(file=path))
    assert "spacing 1 " in note
    assert "periodic" in note
    (note,) = assumed(Surface(file=path, spacing=0.1))
    assert "spacing 1 " not in note
    assert "periodic" in note


def test_a_scenes_file_is_looked_at(tmp_path):
    """In metres with a spacing of 1 it would be a mirror; with its own it is a surface."""
    h = generate_surface(2.0, 0.5, cells=128, spacing=1e-8, seed=1)
    path = tmp_path / "h.npy"
    write_surface(h, path)
    with pytest.raises(InputError, match="same unit"):
        surface_of(Scene(surface=Surface(file=str(path))), 0, 0)
    known = Surface(file=str(path), spacing=1e-8, boundary="periodic")
    assert notes_on_file(Scene(surface=known)) == []
    assert notes_on_file(Scene()) == []


def test_where_a_surface_comes_from_and_its_voids_are_said(tmp_path):
    heights = np.random.default_rng(91).normal(size=(40, 50))
    filled = np.zeros((40, 50), dtype=bool)
    filled[5:15, 10:40] = True
    write_surface(Heightfield(heights, 2.0, "mirror", filled=filled), tmp_path / "s.x3p")
    notes = notes_on_file(Scene(surface=Surface(file=str(tmp_path / "s.x3p"))))
    assert "x3p read by x3pio" in notes[0]
    assert "pixel 2 × 2 µm" in notes[0]
    assert "15.00% of its points were not measured: filled" in notes[1]
