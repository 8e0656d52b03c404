"""A BRDF as a table: f on a regular grid of angles, interpolated linearly in o.

CSV with a header: theta_i, phi_i, theta_o, phi_o in degrees, and f, or f_specular and
f_body, in sr⁻¹. Each combination of the angles that occur stands once, in any order. One
phi_i means that only φ_o − φ_i matters. θ_o goes from 0 to at least 89 (held constant
beyond: 3e−4 of the hemisphere); φ_o all around, or with one phi_i half around, and is
then mirrored. Incidence is not interpolated: a scene's angles must be in the table.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

from ...errors import InputError
from ..csv_columns import read_columns

Array = NDArray[np.float64]

ANGLES = ("theta_i", "phi_i", "theta_o", "phi_o")
_SAME = 1e-4  # degrees
_LAST = 89.0
_WANTED = ",".join(ANGLES) + " and f (or f_specular,f_body)"


@dataclass(frozen=True)
class Table:
    """Values on a grid; called like any user BRDF.

    Attributes
    ----------
    name : str
        Of the file.
    theta_i, phi_i, theta_o, phi_o : array
        Angles in degrees, increasing; φ_o closed: its last is 360° (or, of half a circle,
        180°) after its first.
    values : array, shape (parts, theta_i, phi_i, theta_o, phi_o)
        f in sr⁻¹; parts are f, or f_specular and f_body.

    """

    name: str
    theta_i: Array
    phi_i: Array
    theta_o: Array
    phi_o: Array
    values: Array

    def __call__(self, i: Array, o: Array) -> Array | tuple[Array, ...]:
        """Values at directions of shape (n, 3); i must be among the table's."""
        interpolated = np.zeros((len(self.values), len(i)))
        theta = np.degrees(np.arctan2(np.hypot(i[:, 0], i[:, 1]), i[:, 2]))
        azimuth = np.degrees(np.arctan2(i[:, 1], i[:, 0]))
        t = _nearest(self.name, "theta_i", self.theta_i, theta)
        if len(self.phi_i) == 1:
            p, turned = np.zeros_like(t), azimuth - self.phi_i[0]
        else:
            p, turned = _nearest(self.name, "phi_i", self.phi_i, azimuth), np.zeros(len(i))
        theta_o = np.degrees(np.arctan2(np.hypot(o[:, 0], o[:, 1]), o[:, 2]))
        phi_o = (np.degrees(np.arctan2(o[:, 1], o[:, 0])) - turned - self.phi_o[0]) % 360
        if self._half:
            phi_o = np.minimum(phi_o, 360 - phi_o)
        places = np.stack([np.clip(theta_o, 0, self.theta_o[-1]), self.phi_o[0] + phi_o], axis=1)
        for pair in np.unique(np.stack([t, p], axis=1), axis=0):
            rows = (t == pair[0]) & (p == pair[1])
            for part, values in enumerate(self.values[:, pair[0], pair[1]]):
                grid = RegularGridInterpolator((self.theta_o, self.phi_o), values)
                interpolated[part, rows] = grid(places[rows])
        return tuple(interpolated) if len(interpolated) == 2 else interpolated[0]

    @property
    def _half(self) -> bool:
        return bool(self.phi_o[-1] - self.phi_o[0] < 270)

    def coarser(self) -> "Table":
        """Every second of θ_o and of φ_o, the ends kept: what it changes bounds the error."""
        t, p = (_every_second(len(axis)) for axis in (self.theta_o, self.phi_o))
        values = self.values[..., t, :][..., p]
        return Table(self.name, self.theta_i, self.phi_i, self.theta_o[t], self.phi_o[p], values)

    def require(self, theta: tuple[float, ...], phi: tuple[float, ...]) -> None:
        """Refuse incidences in degrees that it does not hold."""
        _nearest(self.name, "theta_i", self.theta_i, np.array(theta))
        if len(self.phi_i) > 1:
            _nearest(self.name, "phi_i", self.phi_i, np.array(phi))


def _every_second(count: int) -> NDArray[np.intp]:
    return np.unique(np.append(np.arange(0, count, 2), count - 1))


def _nearest(name: str, axis: str, grid: Array, angles: Array) -> NDArray[np.intp]:
    """Index in the grid of each angle; azimuths are the same after 360°."""
    away = np.abs(angles[:, None] - grid)
    if axis == "phi_i":
        away = np.abs((away + 180) % 360 - 180)
    if (away.min(axis=1) > _SAME).any():
        wrong = float(angles[away.min(axis=1).argmax()])
        held = ", ".join(f"{v:g}" for v in grid[:12]) + (" …" if len(grid) > 12 else "")
        raise InputError(
            f"{name}: has no {axis} = {wrong:g}, it has {held}; incidence is not interpolated: "
            "add it, or change the scene's light"
        )
    return np.asarray(away.argmin(axis=1))


def read_table(path: Path) -> Table:
    """Read a table, see the module's text.

    Raises
    ------
    InputError
        If it is not a CSV with these columns, not a full grid, or holds what no BRDF is.

    """
    names, rows = _read(path)
    axes, index = [], []
    for k, name in enumerate(ANGLES):
        low, high = (0.0, 90.0) if name.startswith("theta") else (-360.0, 360.0)
        outside = ~((rows[:, k] >= low) & (rows[:, k] <= high))
        if outside.any():
            line = int(outside.argmax()) + 1
            raise InputError(
                f"{path}: row {line}, {name} = {rows[line - 1, k]:g}: must be "
                f"{low:g} … {high:g} degrees"
            )
        axis, position = np.unique(np.round(rows[:, k], 6), return_inverse=True)
        axes.append(axis)
        index.append(position)
    shape = tuple(len(axis) for axis in axes)
    flat = np.ravel_multi_index(tuple(index), shape)
    if len(rows) != np.prod(shape) or len(np.unique(flat)) != len(rows):
        counts = " × ".join(f"{len(axis)} {name}" for axis, name in zip(axes, ANGLES, strict=True))
        raise InputError(
            f"{path}: {len(rows)} rows, {len(np.unique(flat))} of them different, for {counts}: "
            "must be a full grid, each combination once"
        )
    values = rows[:, len(ANGLES) :]
    wrong = ~(np.isfinite(values) & (values >= 0))
    if wrong.any():
        line, column = np.argwhere(wrong)[0]
        raise InputError(
            f"{path}: row {line + 1}, {names[column]} = {values[line, column]:g}: "
            "must be finite and ≥ 0"
        )
    grid = np.zeros((values.shape[1], len(rows)))
    grid[:, flat] = values.T
    return _closed(path, axes, grid.reshape(-1, *shape))


def _closed(path: Path, axes: list[Array], values: Array) -> Table:
    """Refuse what leaves part of the hemisphere unknown; put the first φ_o after the last."""
    theta_i, phi_i, theta_o, phi_o = axes
    if theta_o[0] > 0 or theta_o[-1] < _LAST or len(theta_o) < 3 or len(phi_o) < 3:
        raise InputError(
            f"{path}: {len(theta_o)} theta_o {theta_o[0]:g} … {theta_o[-1]:g} and {len(phi_o)} "
            f"phi_o: must be at least 3 each, theta_o from 0 to {_LAST:g} or more"
        )
    span, step = phi_o[-1] - phi_o[0], np.diff(phi_o).max()
    half = len(phi_i) == 1 and abs(span - 180) < _SAME and (phi_o[0] - phi_i[0]) % 180 < _SAME
    if abs(span - 360) > _SAME and not half:
        if span > 360 or 360 - span > 1.01 * step:
            raise InputError(
                f"{path}: phi_o {phi_o[0]:g} … {phi_o[-1]:g}: must go all around, or with one "
                "phi_i from it to 180 degrees beyond"
            )
        phi_o = np.append(phi_o, phi_o[0] + 360)
        values = np.concatenate([values, values[..., :1]], axis=-1)
    return Table(path.name, theta_i, phi_i, theta_o, phi_o, values)


def _read(path: Path) -> tuple[tuple[str, ...], Array]:
    """Columns of values, and all rows: four angles and the values."""
    choices = [(*ANGLES, *values) for values in (("f",), ("f_specular", "f_body"))]
    choice, rows = read_columns(path, _WANTED, *choices)
    if not rows:
        raise InputError(f"{path}: holds no rows; give a full grid under {_WANTED}")
    names = choices[choice]
    numbers = [_numbers(path, k, row, len(names)) for k, row in enumerate(rows, 1)]
    return names[len(ANGLES) :], np.array(numbers)


def _numbers(path: Path, number: int, row: list[str], count: int) -> list[float]:
    try:
        if len(row) == count:
            return [float(cell) for cell in row]
    except ValueError:
        pass
    raise InputError(
        f"{path}: row {number} is {','.join(row)[:80]!r}; must be numbers under its columns"
    )
