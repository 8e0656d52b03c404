"""Lobes of any results in one figure: each with its own material, and a label of its own."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from ...errors import InputError
from ...model.registry import Line
from ...scene import Scene
from . import lobes
from .style import SourceStyle, as_text, source_style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LINES: tuple[Line, ...] = (
    "-", "--", "-.", ":", (0, (6, 1, 1, 1, 1, 1)), (0, (9, 3)), (0, (1, 4)), (0, (5, 6)),
)  # fmt: skip
"""Declared apart by eye; more are not."""


@dataclass(frozen=True)
class _Result:
    """A result, the file it is from, its own scene, and the Kd it is drawn with."""

    file: str
    dataset: xr.Dataset
    scene: Scene
    kd: float

    @property
    def model(self) -> str:
        """Of a prediction; ``measured`` of a measurement."""
        measured = self.dataset.attrs["source"] == "measurement"
        return lobes.MEASURED if measured else str(self.dataset.attrs["model"])

    @property
    def of(self) -> dict[str, str]:
        """What it is of, as labels say it."""
        scene = self.scene
        sigmas = (scene.roughness.sigma_x, scene.roughness.sigma_y)
        return {
            "Kd": f"{self.kd:g}",
            "n": f"{scene.material.n:g}",
            "k": f"{scene.material.k:g}",
            "γ": f"{scene.roughness.gamma:g}",
            "σ": " × ".join(f"{sigma:g}" for sigma in dict.fromkeys(sigmas)),
        }


def figure(datasets: Mapping[str, xr.Dataset], kd: float | None = None) -> "Figure":
    """Draw lobes in the plane of incidence, keys are files; see `lobes.figure`.

    Each result has the material of its own scene and the first of its Kd, if ``kd`` is
    not given. Labels say what differs: Kd, n, k, γ, σ, or else the file.

    Raises
    ------
    InputError
        If there are two measurements, if angles of incidence differ, or if there are
        more predictions than there are different lines.

    """
    results = [_result(file, dataset, kd) for file, dataset in datasets.items()]
    _check(results)
    labels = _labels(results)
    styles: dict[str, SourceStyle] = {}
    drawn: list[dict[str, Any]] = []
    taken: set[tuple[bool, Line]] = set()
    for label, result in zip(labels, results, strict=True):
        if result.model == lobes.MEASURED:
            styles[lobes.MEASURED] = source_style(lobes.MEASURED)._replace(label=label)
            drawn += lobes.rows(result.dataset, {}, result.scene, result.kd)
        else:
            of = source_style(result.model)
            styles[result.file] = of._replace(line=_line(result, of.line, taken), label=label)
            drawn += lobes.rows(None, {result.file: result.dataset}, result.scene, result.kd)
    return lobes.figure(drawn, styles)


def _result(file: str, dataset: xr.Dataset, kd: float | None) -> _Result:
    scene = Scene.from_toml(dataset.attrs["scene"])
    return _Result(file, dataset, scene, scene.material.kd[0] if kd is None else kd)


def _check(results: Sequence[_Result]) -> None:
    first = results[0].dataset
    for result in results:
        if not np.array_equal(result.dataset.theta_i, first.theta_i):
            raise InputError(
                f"{result.file}: its angles of incidence are not those of the first file"
            )
        phi, wanted = (float(dataset.phi_i[0]) for dataset in (result.dataset, first))
        if phi != wanted:
            raise InputError(
                f"{result.file}: its first azimuth of incidence, {phi:g}°, is not that of the "
                f"first file, {wanted:g}°; only the first is drawn"
            )
    count = sum(result.model == lobes.MEASURED for result in results)
    if count > 1:
        raise InputError(f"{count} measurements: give one, with any number of predictions")


def _labels(results: Sequence[_Result]) -> list[str]:
    """Name each result by its model and what tells it from the others, no two the same."""
    of = [result.of for result in results]
    differing = [key for key in of[0] if len({words[key] for words in of}) > 1]
    labels = [
        ", ".join(
            [source_style(result.model).label, *(f"{key} = {words[key]}" for key in differing)]
        )
        for result, words in zip(results, of, strict=True)
    ]
    count = Counter(labels)
    files = _short([result.file for result in results])
    return [
        f"{label} ({as_text(file)})" if count[label] > 1 else label
        for label, file in zip(labels, files, strict=True)
    ]


def _short(files: Sequence[str]) -> list[str]:
    """Cut paths to the last parts that still tell all of them apart."""
    parts = [PurePath(file).parts for file in files]
    for count in range(1, max(map(len, parts))):
        short = [str(PurePath(*part[-count:])) for part in parts]
        if len(set(short)) == len(files):
            return short
    return list(files)


def _line(result: _Result, usual: Line, taken: set[tuple[bool, Line]]) -> Line:
    """Give the line of the model, or another one if a result of the same colours has it."""
    all_orders = result.dataset.sizes["order"] > 1
    for line in (usual, *_LINES):
        if (all_orders, line) not in taken:
            taken.add((all_orders, line))
            return line
    raise InputError(f"{result.file}: more than {len(_LINES)} predictions look alike; give fewer")
