"""microsurf predict: the theory alone."""

import csv
import io
import time
from pathlib import Path
from typing import Any

import click
import numpy as np
from numpy.typing import NDArray

from .. import model
from ..errors import InputError
from ..files import check_writable
from ..results import albedos, datasets
from ..scene import Scene
from ..scene.layers import refuse, required
from .models import ListsModels, ModelKey
from .options import (
    INPUT,
    PATH,
    as_json,
    check_described,
    compose,
    light,
    material,
    roughness,
    say,
    seed,
)
from .output import check_ending, show, write


@click.command("predict", cls=ListsModels)
@click.argument("scene_file", type=INPUT, required=False, metavar="[SCENE.toml]")
@roughness
@material
@light
@click.option(
    "--model",
    "name",
    type=ModelKey(),
    default="smith",
    show_default=True,
    help="One of those below.",
)
@click.option(
    "--paths", type=int, help="Walks of a -walk: for each angle (default 1000000), or row (10000)."
)
@seed
@click.option("--directions", type=INPUT, help="CSV of theta_i,phi_i,theta_o,phi_o in degrees.")
@click.option("--out", type=PATH, help="Write the result as FILE.nc.")
@as_json
def predict_command(
    scene_file: Path | None, name: str, directions: Path | None, out: Path | None, as_json: bool,
    seed: int, **given: Any,
) -> None:  # fmt: skip
    """Print what the theory alone says: one bounce, or with a -walk all of them.

    Example: microsurf predict --gamma 2 --sigma 0.5 --theta 60 --model smith
    """
    if name != "flat":
        check_described(scene_file, given)
    scene = compose(scene_file, **given)
    _check_layers(scene, name)
    if scene_file and scene.surface.file is not None and given["sigma"] is None and name != "flat":
        _check_stated(scene_file, scene)
    if directions is not None:
        for option, used in (
            ("--json", as_json),
            ("--out", out is not None),
            ("--theta", given["theta"] is not None),
            ("--phi", given["phi"] is not None),
        ):
            if used:
                raise InputError(f"--directions: prints CSV of its own angles; leave out {option}")
        rng = np.random.default_rng(seed)
        _print_directions(scene, name, directions, given["paths"] or _WALKS, rng)
        return
    if out is not None:
        check_ending(out, ".nc")
        check_writable(out)
    begin = time.perf_counter()
    predicted = model.predict(scene, name, seed=seed, progress=True)
    seconds = time.perf_counter() - begin
    values = {
        "model": name,
        **albedos.figures(predicted),
        "lost": albedos.losses(predicted)["lost"] if "ended" in predicted else 0.0,
        "seconds": seconds,
    }
    if out is not None:
        datasets.save(predicted, out)
        values["file"] = str(out)
    show(values, as_json)


def _check_stated(file: Path, scene: Scene) -> None:
    """Refuse measured heights of a scene that states no slopes; say along which axes they are."""
    stated = Scene.read_with_tables(file)[1].get("roughness", {})
    if not {"gamma", "sigma"} <= set(stated):
        raise InputError(
            f"{file}: its surface is {scene.surface.file}, of unknown roughness; give "
            "--gamma and --sigma, or `microsurf validate` fits them"
        )
    rough = scene.roughness
    if not rough.isotropic:
        axes = f"σ = {rough.sigma_x:.3g} along x and {rough.sigma_y:.3g} along y"
        say([f"{file}: {axes}; `microsurf validate` turns them to the axes of the lay"])


def _check_layers(scene: Scene, name: str) -> None:
    if model.MODELS[name].layered:
        required(scene.layers, f"the model {name}")
    else:
        refuse(scene.layers, f"the model {name}")


_COLUMNS = ("theta_i", "phi_i", "theta_o", "phi_o")
_WALKS = 10_000  # for each row of --directions: some 1 % of f


def _print_directions(
    scene: Scene, name: str, file: Path, walks: int, rng: np.random.Generator
) -> None:
    angles = _read_directions(file)
    kd = scene.material.kd
    if len(kd) > 1:
        raise InputError(f"--kd = {list(kd)}: with --directions give one")
    theta_i, phi_i, theta_o, phi_o = np.radians(angles).T
    i, o = model.direction(theta_i, phi_i), model.direction(theta_o, phi_o)
    specular, body = model.Brdf(scene, name, walks).evaluate(i, o, rng)
    table = io.StringIO()
    writer = csv.writer(table, lineterminator="\n")
    writer.writerow([*_COLUMNS, "f_specular", "f_body", "f"])
    for row, s, b in zip(angles, specular, body, strict=True):
        writer.writerow([repr(float(v)) for v in (*row, s, b, s + b)])
    write(table.getvalue().rstrip("\n"))


def _read_directions(file: Path) -> NDArray[np.float64]:
    wanted = ",".join(_COLUMNS)
    _, rows = model.read_columns(file, wanted, _COLUMNS)
    if not rows:
        raise InputError(f"{file}: holds no directions; give at least one under {wanted}")
    return np.array([_angles(file, k, row) for k, row in enumerate(rows, 1)])


def _angles(file: Path, number: int, row: list[str]) -> list[float]:
    cells = [*row, *[""] * (len(_COLUMNS) - len(row))]
    return [_angle(file, number, c, cell) for c, cell in zip(_COLUMNS, cells, strict=True)]


def _angle(file: Path, number: int, column: str, cell: str) -> float:
    low, high = (0.0, 90.0) if column.startswith("theta") else (-360.0, 360.0)
    try:
        angle = float(cell)
    except ValueError:
        angle = float("nan")
    inside = low <= angle < high or (angle == high and column.startswith("phi"))
    if not inside:
        allowed = "0 ≤ θ < 90" if column.startswith("theta") else "−360 … 360"
        raise InputError(
            f"{file}: direction {number}, {column} = {cell!r}: must be {allowed} degrees"
        )
    return angle
