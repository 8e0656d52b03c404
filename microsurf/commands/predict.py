"""microsurf predict: the theory alone."""

import csv
import sys
import time
from pathlib import Path
from typing import Any

import click
import numpy as np
from numpy.typing import NDArray

from .. import model, result, summary
from ..errors import InputError
from ..files import check_writable
from ..scene import Scene
from .options import PATH, as_json, compose, light, material, roughness
from .output import check_ending, show


@click.command("predict")
@click.argument("scene_file", type=PATH, required=False, metavar="[SCENE.toml]")
@roughness
@material
@light
@click.option("--model", "name", type=click.Choice(model.NAMES), default="smith", show_default=True)
@click.option("--directions", type=PATH, help="CSV of theta_i,phi_i,theta_o,phi_o in degrees.")
@click.option("--out", type=PATH, help="Write the result as FILE.nc.")
@as_json
def predict_command(
    scene_file: Path | None, name: str, directions: Path | None, out: Path | None, as_json: bool,
    **given: Any,
) -> None:  # fmt: skip
    """Print what the theory alone says.

    Example: microsurf predict --gamma 2 --sigma 0.5 --theta 60 --model smith
    """
    asked = compose(scene_file, **given)
    if directions is not None:
        if as_json:
            raise InputError("--directions: prints CSV; leave out --json")
        _print_directions(asked, name, directions)
        return
    if out is not None:
        check_ending(out, ".nc")
        check_writable(out)
    begin = time.perf_counter()
    predicted = model.predict(asked, name)
    seconds = time.perf_counter() - begin
    values = {
        "model": name,
        **summary.figures(predicted, asked.material.n, asked.material.kd),
        "lost": 0.0,
        "seconds": seconds,
    }
    if out is not None:
        result.save(predicted, out)
        values["file"] = str(out)
    show(values, as_json)


_COLUMNS = ("theta_i", "phi_i", "theta_o", "phi_o")


def _print_directions(asked: Scene, name: str, file: Path) -> None:
    angles = _read_directions(file)
    kd = asked.material.kd
    if len(kd) > 1:
        raise InputError(f"--kd = {list(kd)}: with --directions give one")
    i = np.stack([_direction(row[0], row[1]) for row in angles])
    o = np.stack([_direction(row[2], row[3]) for row in angles])
    specular, body = model.evaluate(asked, i, o, name)
    writer = csv.writer(sys.stdout, lineterminator="\n")
    writer.writerow([*_COLUMNS, "f_specular", "f_body", "f"])
    for row, s, b in zip(angles, specular, body, strict=True):
        writer.writerow([repr(float(v)) for v in (*row, s, b, s + b)])


def _direction(theta: float, phi: float) -> NDArray[np.float64]:
    t, p = np.radians(theta), np.radians(phi)
    return np.array([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])


def _read_directions(file: Path) -> NDArray[np.float64]:
    if not file.is_file():
        raise InputError(f"{file}: no such file; give a CSV with the columns {','.join(_COLUMNS)}")
    try:
        with file.open(encoding="utf-8-sig", newline="") as lines:
            rows = list(csv.DictReader(lines))
        angles = np.array([[float(row[c]) for c in _COLUMNS] for row in rows])
    except (KeyError, TypeError, ValueError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(
            f"{file}: not a CSV of numbers with the columns {','.join(_COLUMNS)} ({error})"
        ) from error
    if not len(angles):
        raise InputError(f"{file}: holds no directions")
    if (
        not np.isfinite(angles).all()
        or (angles[:, [0, 2]] < 0).any()
        or (angles[:, [0, 2]] >= 90).any()
    ):
        raise InputError(f"{file}: every theta must be 0 ≤ θ < 90 degrees, every angle a number")
    return angles
