"""A BSDF of the renderer Mitsuba 3 as a user BRDF: `from_mitsuba`.

Mitsuba is an extra, ``pip install 'microsurf[mitsuba]'``, imported here only when it is asked for.
Its BSDFs give f cosθ_o in float32; cosθ_o is divided out. A mirror (Dirac) part has no values: its
reflectance is integrated into the bin of the mirror direction.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...scene import Scene
from ..directions import direction
from .brdf import UserBrdf

Array = NDArray[np.float64]

OLDEST_LLVM = 19
"""Known to serve. With 15 a compiled variant aborts the process at its first kernel."""
_MISSING = "mitsuba is not installed: `pip install 'microsurf[mitsuba]'`"
_DEFAULT_VARIANT = "scalar_rgb"
_SAME = 1e-5
"""Relative difference of two sums of float32."""
_PROBES = 64


def load() -> Any:
    """Import the module mitsuba, with a variant set.

    Raises
    ------
    InputError
        If it is not installed, or its variant is compiled by an LLVM that is too old.

    """
    try:
        import mitsuba  # noqa: PLC0415 - an extra, which may be absent
    except ImportError as error:
        raise InputError(_MISSING) from error
    if mitsuba.variant() is None:
        mitsuba.set_variant(_DEFAULT_VARIANT)
    if str(mitsuba.variant()).startswith("llvm"):
        version = import_module("drjit").detail.llvm_version()[0]
        if version < OLDEST_LLVM:
            raise InputError(
                f"mitsuba compiles {mitsuba.variant()} by LLVM {version}, which may abort the "
                f"process; must be {OLDEST_LLVM} or newer: install Debian's libllvm19 and set "
                f"DRJIT_LIBLLVM_PATH to libLLVM.so.19.1, or set the variant {_DEFAULT_VARIANT}"
            )
    return mitsuba


def scalar() -> AbstractContextManager[None]:
    """Have the variant set in which single directions are evaluated, and the old one after."""
    mi = load()
    if mi.variant() == _DEFAULT_VARIANT:
        return nullcontext()
    context: AbstractContextManager[None] = mi.util.variant_context(_DEFAULT_VARIANT)
    return context


def from_mitsuba(bsdf: Any, *, name: str = "mitsuba", channel: int | None = None) -> UserBrdf:
    """Make a user BRDF of a BSDF of Mitsuba.

    Parameters
    ----------
    bsdf : mitsuba.BSDF
        As ``mitsuba.load_dict`` gives it, in the variant that is set: an rgb or mono one, not
        polarized. It reflects and does not transmit. Evaluated at the texture's middle.
    name : str
        What to call it in reports.
    channel : int or None
        Of a coloured one: 0, 1 or 2.

    Returns
    -------
    UserBrdf
        Its light is judged whole, against all orders. If it has a specular and a diffuse
        component that can be asked for separately, or the scene needs but the one it has, they
        are judged against order 1 too.

    Raises
    ------
    InputError
        If Mitsuba is not installed, or the BSDF is none that can be judged.

    """
    bridge = Bridge(bsdf, name, channel)
    return user_brdf(name, lambda _: bridge, lambda _: bridge.notes())


def user_brdf(
    name: str, bridge_of: Callable[[Scene], "Bridge"], notes: Callable[[Scene], list[str]]
) -> UserBrdf:
    """Make a user BRDF of what stands for each scene."""

    def f(i: Array, o: Array, scene: Scene) -> Array | tuple[Array, Array]:
        return bridge_of(scene).evaluate(i, o, scene)

    def mirror(i: Array, scene: Scene) -> float:
        return bridge_of(scene).mirror(i)

    return UserBrdf(name, f, takes_scene=True, whole=True, mirror=mirror, notes=notes)


class Bridge:
    """A BSDF of Mitsuba that is asked for values in NumPy.

    Parameters are those of `from_mitsuba`.
    """

    def __init__(self, bsdf: Any, name: str, channel: int | None = None) -> None:
        mi = load()
        self._bsdf, self._name, self._channel = bsdf, name, channel
        self._variant = mi.variant()
        if not isinstance(bsdf, mi.BSDF):
            raise InputError(
                f"--model {name}: is a {type(bsdf).__name__}, not a BSDF of Mitsuba's variant "
                f"{self._variant}; give a BSDF made while that is set"
            )
        colour = self._variant.rpartition("_")[2]
        if colour not in {"rgb", "mono"}:
            raise InputError(
                f"--model {name}: variant {self._variant}; must be an unpolarised rgb or mono one"
            )
        kinds = mi.BSDFFlags
        self._mirrors, self._glossy, self._diffuse = (
            int(kinds.DeltaReflection), int(kinds.GlossyReflection), int(kinds.DiffuseReflection),
        )  # fmt: skip
        flags = int(bsdf.flags())
        if flags & int(kinds.Transmission) or flags & int(kinds.Null):
            raise InputError(
                f"--model {name}: transmits light; must only reflect it, as the surfaces that are "
                "traced do"
            )
        self._kinds = flags & (self._mirrors | self._glossy), flags & self._diffuse
        self._separable = self._adds_up()

    def notes(self) -> list[str]:
        """Say what is done with a mirror."""
        if not self._kinds[0] & self._mirrors:
            return []
        what = "its mirror (a Dirac component) has no values f(i, o): its reflectance is put into"
        return [f"{self._name}: {what} the bin of the mirror direction"]

    def evaluate(self, i: Array, o: Array, scene: Scene) -> Array | tuple[Array, Array]:
        """Give f in sr⁻¹ at unit directions of shape (n, 3), by kind if the scene's are there."""
        needs = scene.requires
        complete = (self._kinds[0] or not needs.interface) and (
            self._kinds[1] or not needs.substrate
        )
        if not (self._separable and complete):
            return self._values(i, o)
        return self._values(i, o, self._glossy), self._values(i, o, self._diffuse)

    def mirror(self, i: Array) -> float:
        """Reflectance of the Dirac component at a direction of shape (3,); 0 without one."""
        if not self._kinds[0] & self._mirrors:
            return 0.0
        mi = load()
        with mi.util.variant_context(self._variant):
            context = _context(mi, self._mirrors)
            drawn, weight = self._bsdf.sample(context, _interaction(mi, i[None]), 0.5, [0.5, 0.5])
            o = np.array(drawn.wo, np.float64).ravel()
            if np.abs(o - i * [-1, -1, 1]).max() > _SAME:
                raise InputError(f"--model {self._name}: its Dirac component is no mirror")
            return float(self._one_channel(np.array(weight, np.float64).reshape(-1, 1))[0])

    def _values(self, i: Array, o: Array, mask: int | None = None) -> Array:
        mi = load()
        with mi.util.variant_context(self._variant):
            context, evaluate = _context(mi, mask), self._bsdf.eval
            if self._variant.startswith("scalar"):
                point, rows = _interaction(mi, i[:1]), []
                for one, other in zip(i.tolist(), o.tolist(), strict=True):
                    point.wi = one
                    # A plug-in written in Python takes no lists.
                    rows.append(list(evaluate(context, point, mi.Vector3f(other))))
                values = np.array(rows, np.float64).T
            else:
                out = mi.Vector3f(*o.T.astype(np.float32))
                values = np.array(evaluate(context, _interaction(mi, i), out), np.float64)
                values = np.broadcast_to(values.reshape(len(values), -1), (len(values), len(o)))
        return self._one_channel(values) / o[:, 2]

    def _one_channel(self, values: Array) -> Array:
        """Pick the channel of values of shape (channels, n)."""
        if self._channel is not None:
            if not 0 <= self._channel < len(values):
                raise InputError(f"channel = {self._channel}: must be 0 … {len(values) - 1}")
            return np.asarray(values[self._channel])
        if np.any(np.ptp(values, axis=0) > _SAME * np.abs(values).max(axis=0)):
            k = int(np.ptp(values, axis=0).argmax())
            shown = ", ".join(f"{v:.4g}" for v in values[:, k])
            raise InputError(
                f"--model {self._name}: is coloured, f cosθ_o = {shown}; give grey parameters, or "
                "in Python `from_mitsuba(bsdf, channel=…)`"
            )
        return np.asarray(values[0])

    def _adds_up(self) -> bool:
        """Whether the components can be asked for separately: not every plug-in minds the mask."""
        rng = np.random.default_rng(0)
        theta = np.arcsin(np.sqrt(rng.uniform(0, 0.95, (2, _PROBES))))
        i, o = direction(theta, rng.uniform(0, 2 * np.pi, (2, _PROBES)))
        whole, *parts = (self._values(i, o, m) for m in (None, self._glossy, self._diffuse))
        return bool(np.all(np.abs(sum(parts) - whole) <= _SAME * whole))


def _context(mi: Any, mask: int | None) -> Any:
    context = mi.BSDFContext()
    if mask is not None:
        context.type_mask = mask
    return context


def _interaction(mi: Any, i: Array) -> Any:
    """Points of a plane illuminated from i of shape (n, 3); one point in a scalar variant."""
    point = mi.SurfaceInteraction3f()
    point.sh_frame = mi.Frame3f(mi.Normal3f(0, 0, 1))
    point.n = mi.Normal3f(0, 0, 1)
    point.uv = mi.Point2f(0.5, 0.5)
    point.t = 1.0
    point.wi = i[0].tolist() if len(i) == 1 else mi.Vector3f(*i.T.astype(np.float32))
    return point
