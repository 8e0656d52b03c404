"""The surfaces a scene asks for, one for each realisation."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

from .. import memory, seeds
from ..errors import InputError
from ..scene import Scene, Surface
from .detrend import level
from .heightfield import Heightfield
from .io import read_surface
from .plausibility import assumed, hints, origin, require_traceable
from .synthesis import generate_surface


def realisation_seed(seed: int, realisation: int) -> int:
    """Seed of one realisation: unrelated to those of other realisations and other seeds.

    The recipe of the surface holds it, so `generate_surface` makes the same again.
    """
    return seeds.derived(seed, seeds.SURFACES, realisation)


def surfaces_of(scene: Scene, seed: int = 0) -> Iterator[Heightfield]:
    """Read the scene's file, or generate its realisations one after the other.

    Raises
    ------
    InputError
        If the file can't be used or its slopes can't be traced, or a surface would not fit
        into memory.

    """
    count = scene.surface.realisations if scene.surface.file is None else 1
    for realisation in range(count):
        yield surface_of(scene, seed, realisation)


def all_surfaces_of(scene: Scene, seed: int = 0, workers: int | None = None) -> list[Heightfield]:
    """All that `surfaces_of` gives, made side by side as far as memory goes."""
    if scene.surface.file is not None:
        return list(surfaces_of(scene, seed))
    with ThreadPoolExecutor(memory.at_once(scene.surface.cells**2, workers)) as pool:
        return list(pool.map(partial(surface_of, scene, seed), range(scene.surface.realisations)))


def notes_on_file(scene: Scene) -> list[str]:
    """What is taken for granted of the scene's file, how it was read, what hints at a mistake.

    Empty for generated surfaces. Raises as `surfaces_of`.
    """
    surface = scene.surface
    if surface.file is None:
        return []
    return notes_on_surface(surface, surface_of(scene, 0, 0))


def notes_on_surface(surface: Surface, h: Heightfield) -> list[str]:
    """`notes_on_file` of one that was read and levelled."""
    name = str(surface.file)
    return assumed(surface) + origin(h, name) + hints(h, name)


def surface_of(scene: Scene, seed: int, realisation: int) -> Heightfield:
    """One realisation alone; a file has only one. Raises as `surfaces_of`."""
    wanted = scene.surface
    if wanted.file is not None:
        surface = level(read_asked(wanted), wanted.level)
        require_traceable(surface, wanted.file)
        return surface
    if wanted.boundary == "mirror" or wanted.level != "none":
        raise InputError(
            "surface.boundary and surface.level are for a surface.file; "
            "a generated surface is periodic and level"
        )
    memory.require(wanted.cells**2, memory.EXACT_BYTES_PER_CELL, f"surface.cells = {wanted.cells}")
    return generate_surface(
        scene.roughness.gamma,
        scene.roughness.sigma_x,
        scene.roughness.sigma_y,
        cells=wanted.cells,
        correlation=wanted.correlation,
        structure=wanted.structure,
        spacing=square_spacing(wanted),
        seed=realisation_seed(seed, realisation),
    )


def read_asked(surface: Surface) -> Heightfield:
    """Read the file of a scene's surface, not levelled. Raises as `read_surface`."""
    spacing = surface.spacing
    return read_surface(
        Path(str(surface.file)),
        (spacing[0], spacing[-1]) if isinstance(spacing, tuple) else spacing,
        surface.boundary,
        channel=surface.channel,
        voids=surface.voids,
        height_unit=surface.height_unit,
        void_value=surface.void_value,
    )


def square_spacing(surface: Surface) -> float:
    """Return the spacing of a generated surface; raise InputError if two are given."""
    if isinstance(surface.spacing, tuple):
        raise InputError(
            f"surface.spacing = {surface.spacing}: generated cells are square; give one number"
        )
    return surface.spacing or 1.0
