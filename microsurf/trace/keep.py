"""Finished pieces on disk, each written whole or not at all, so that a killed run goes on.

What is there is checked against the run by the text of its scene, its seed and its
surfaces. A piece that can't be read is traced again.
"""

import hashlib
import json
import shutil
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path

import numpy as np

from .. import __version__
from ..errors import InputError, MicrosurfError
from ..files import whole_file
from ..scene import Scene
from ..scene_file import to_toml
from .paths import Tally
from .pieces import PIECE, Piece, Source

_RUN = "run.json"


class Keep:
    """A folder of finished pieces of one run.

    Raises
    ------
    InputError
        If it holds pieces and ``resume`` is false, or those of another run.

    """

    def __init__(
        self,
        folder: Path,
        scene: Scene,
        sources: Sequence[Source] | None,
        seed: int,
        *,
        resume: bool,
    ) -> None:
        self._folder = folder
        run = {
            "microsurf": __version__,
            "piece": PIECE,
            "seed": seed,
            "scene": to_toml(scene),
            "surfaces": None if sources is None else [source.name for source in sources],
        }
        self._run = hashlib.sha256(json.dumps(run).encode()).hexdigest()
        note = folder / _RUN
        if note.is_file() or (folder.is_dir() and any(folder.iterdir())):
            if not resume:
                raise InputError(
                    f"{folder}: holds finished pieces of a run that was not finished; "
                    "add --resume to go on with it, or remove the folder to begin again"
                )
            if _read(note) != self._run:
                raise InputError(
                    f"{folder}: holds pieces of another run (another scene, seed, surface or "
                    "version); resume that one with its own options, or remove the folder"
                )
            return
        try:
            folder.mkdir(exist_ok=True)
        except OSError as error:
            raise InputError(
                f"{folder}: can't be made ({error.strerror}); choose another place"
            ) from error
        with whole_file(note) as temporary:
            temporary.write_text(json.dumps({"run": self._run, **run}, indent=1), encoding="utf-8")

    def _path(self, piece: Piece) -> Path:
        name = f"{piece.source.realisation:05d}-{piece.angle:05d}-{piece.number:08d}.npz"
        return self._folder / name

    def save(self, piece: Piece, tally: Tally) -> None:
        """Write what a piece came to. Raises MicrosurfError if there is no room for it."""
        place = np.flatnonzero(tally.energy)
        arrays = {f.name: getattr(tally, f.name) for f in fields(Tally)}
        arrays |= {
            "energy": tally.energy.ravel()[place],
            "place": place,
            "shape": np.array(tally.energy.shape),
        }
        with whole_file(self._path(piece)) as temporary:
            np.savez(temporary, **arrays)

    def load(self, piece: Piece) -> Tally | None:
        """What a piece came to, if it is there."""
        path = self._path(piece)
        if not path.is_file():
            return None
        try:
            with np.load(path, allow_pickle=False) as found:
                arrays = {f.name: found[f.name] for f in fields(Tally)}
                energy = np.zeros(found["shape"])
                energy.ravel()[found["place"]] = arrays["energy"]
        except Exception:  # noqa: BLE001 - numpy and zipfile raise anything for a damaged file
            return None
        return Tally(**{**arrays, "energy": energy})

    def clear(self) -> None:
        """Remove the folder: the whole result is there."""
        try:
            shutil.rmtree(self._folder)
        except OSError as error:
            raise MicrosurfError(
                f"{self._folder}: could not be removed ({error.strerror}); remove it yourself"
            ) from error


def _read(note: Path) -> str | None:
    try:
        found = json.loads(note.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return found.get("run") if isinstance(found, dict) else None
