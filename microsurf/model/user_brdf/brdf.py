"""A user BRDF in a model's place: a Python callable or a table, checked wherever it is asked.

A callable ``f(i, o)`` takes unit directions of shape (n, 3) towards the light and the
detector, both above the horizon, in float64, and gives the BRDF in sr⁻¹, cosine not
included. What it returns says which orders it holds:

* a pair ``(f_specular, f_body)``, shape (n,) each: order 1, without interreflection;
* one array, shape (n,): all orders and kinds together.

If one of its parameters is called ``scene`` it is given the `Scene`, with one Kd.
"""

import contextlib
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError, real_array
from ...scene import Scene
from ..directions import direction
from .table import Table

Array = NDArray[np.float64]

ALL, SPECULAR, BODY = "all", "specular", "body"
SMOOTHEST = 1e-4
"""Smallest σ whose spike about the mirror direction is resolved, see `bin_integrals`."""
_PROBES = 64
_MOST = 1e30
"""Largest f in sr⁻¹ that its sums over directions can hold; spikes of σ = 1e-6 have 1e12."""
_RECIPROCITY = 1e-3
"""Relative difference of f(i, o) and f(o, i) that is the BRDF's and not its rounding's."""
_LINE = 200


@dataclass(frozen=True)
class UserBrdf:
    """A BRDF to be tested, by the name it was given.

    Attributes
    ----------
    name : str
        As on the command line.
    function : callable
        ``f(i, o)`` or ``f(i, o, scene=…)``, see the module's text.
    takes_scene : bool
        Whether it has a parameter ``scene``.
    table : Table or None
        Where the values come from a file.
    whole : bool
        Whether a pair is all the light that the material sends back: then its sum is held
        against all orders too.
    mirror : callable or None
        ``mirror(i, scene)``, reflectance of a mirror beside the values, at i of shape (3,).
    notes : callable or None
        ``notes(scene)``, what to say of it on a scene, in lines.

    """

    name: str
    function: Callable[..., Any]
    takes_scene: bool = False
    table: Table | None = None
    whole: bool = False
    mirror: Callable[[Array, Scene], float] | None = None
    notes: Callable[[Scene], list[str]] | None = None

    def remarks(self, scene: Scene) -> list[str]:
        """What to say of it on a scene, each line once, whatever the number of Kd."""
        if self.notes is None:
            return []
        return list(dict.fromkeys(text for one in _one_each(scene) for text in self.notes(one)))

    def evaluate(self, i: Array, o: Array, scene: Scene) -> dict[str, Array]:
        """Values at directions of shape (n, 3): of "specular" and "body", or of "all".

        Raises
        ------
        InputError
            If it fails, or gives anything but finite values ≥ 0, one for each direction.

        """
        more = {"scene": scene} if self.takes_scene else {}
        try:
            # Copies: a callable may work in place. What it prints must not get into --json.
            with contextlib.redirect_stdout(sys.stderr):
                returned = self.function(i.copy(), o.copy(), **more)
        except InputError:
            raise
        except (Exception, SystemExit) as error:
            raise InputError(
                f"--model {self.name}: {type(error).__name__} at {len(i)} directions: "
                f"{str(error)[:_LINE]}; mend the callable"
            ) from error
        pair = isinstance(returned, tuple | list) and len(returned) == 2
        parts = dict(zip((SPECULAR, BODY), returned, strict=True)) if pair else {ALL: returned}
        return {part: self._checked(part, values, i, o) for part, values in parts.items()}

    def _checked(self, part: str, values: Any, i: Array, o: Array) -> Array:
        array = real_array(f"--model {self.name}: {part} f", values)
        if array.shape != (len(i),):
            raise InputError(
                f"--model {self.name}: gave {array.dtype} of shape {array.shape} for {len(i)} "
                f"directions; must be real numbers of shape ({len(i)},), or a pair of such arrays "
                "(f_specular, f_body)"
            )
        array = array.astype(np.float64)
        wrong = ~((array >= 0) & (array <= _MOST))
        if wrong.any():
            k = int(np.flatnonzero(wrong)[0])
            where = f"i = {_shown(i[k])}, o = {_shown(o[k])}"
            raise InputError(
                f"--model {self.name}: {part} f = {array[k]:.4g} sr⁻¹ at {where}; "
                f"must be from 0 to {_MOST:g}"
            )
        return array


def _shown(w: Array) -> str:
    return "(" + ", ".join(f"{c:.6g}" for c in w) + ")"


def has_values(scene: Scene) -> bool:
    """Whether values f(i, o) can describe a scene: no mirror and no spike as narrow."""
    smooth = scene.surface.file is None and min(scene.roughness.sigma) < SMOOTHEST
    return not (smooth and scene.requires.interface)


def examine(brdf: UserBrdf, scene: Scene) -> list[str]:
    """Ask a user BRDF at some directions, before anything is traced for it.

    Returns
    -------
    list of str
        What no BRDF may be, in words: not reciprocal. (Of a table only what it holds
        could tell, so it is not asked.)

    Raises
    ------
    InputError
        If its values are no BRDF's, change from call to call, or if the scene is one
        that no values f(i, o) can stand for.

    """
    kds = scene.material.kd
    if len(kds) > 1 and not brdf.takes_scene:
        raise InputError(
            f"--model {brdf.name}: knows no Kd and material.kd = {list(kds)}; give the scene "
            "one, or the callable a parameter `scene`"
        )
    if not has_values(scene):
        sigma = min(scene.roughness.sigma)
        raise InputError(
            f"--model {brdf.name}: roughness.sigma = {sigma:g} with an interface "
            f"makes a spike that no sum over f(i, o) holds; must be ≥ {SMOOTHEST:g}, or n = 1"
        )
    if brdf.table is not None:
        brdf.table.require(scene.light.theta, scene.light.phi)
        return []
    return [text for one in _one_each(scene) for text in _asked(brdf, one)]


def _one_each(scene: Scene) -> list[Scene]:
    """The scene with each of its Kd alone."""
    return [replace(scene, material=replace(scene.material, kd=(kd,))) for kd in scene.material.kd]


def _asked(brdf: UserBrdf, scene: Scene) -> list[str]:
    """Ask both ways at some directions, twice; the scene has one Kd."""
    rng = np.random.default_rng(0)
    theta = np.arcsin(np.sqrt(rng.uniform(0, 0.99, (2, _PROBES))))
    i, o = direction(theta, rng.uniform(0, 2 * np.pi, (2, _PROBES)))
    forth, again, back = (brdf.evaluate(*pair, scene) for pair in ((i, o), (i, o), (o, i)))
    broken = []
    for part, values in forth.items():
        if not np.array_equal(values, again[part]):
            raise InputError(
                f"--model {brdf.name}: {part} f changes from call to call; must be "
                "deterministic: seed it, or give its mean"
            )
        size = np.maximum(values, back[part])
        off = np.abs(values - back[part]) / np.where(size > 0, size, 1)
        if off.max() > _RECIPROCITY:
            k = int(off.argmax())
            broken.append(
                f"reciprocity: {part} f(i, o) = {values[k]:.5g} and f(o, i) = {back[part][k]:.5g} "
                f"sr⁻¹ at i = {_shown(i[k])}, o = {_shown(o[k])}, must agree to {_RECIPROCITY:g}"
            )
    return broken
