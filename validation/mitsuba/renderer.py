"""The same measurement by Mitsuba 3: a rival for the benchmark, a second engine for the tests.

Variant ``llvm_ad_rgb``, one period of a heightfield as a triangle mesh with face normals,
``plastic`` facets (``nonlinear``: then they are interfaced-Lambertian facets), paths of
light by BSDF sampling in one vectorised loop, wrapped round the period in that loop. Of two
explicit layers the interface is a ``dielectric`` and the substrate ``diffuse``.

Written to be as fast as its user could make it. Measured on two cores with AVX-512:

* a symbolic loop (one kernel for the whole path) beats an evaluated one, compacted
  between bounces, by 1.2 to 1.7, and as one path a lane it is as fast as lanes that start
  a new path when one ends;
* origins in the order of a Morton curve, stratified as microsurf's are, beat independent
  ones by 2.2 to 2.7: packets of 16 rays stay together (``ordered=False`` is the plain way);
* Embree gets the hint that rays are not coherent, and would gain nothing from another;
* Embree's robust mode, as microsurf's: without it is 1.2 times as fast, and up to 1e−5 of
  the paths fall through edges. The margin of one cell beyond each edge and the small step
  off the facet (`loop.OFFSET`) are microsurf's too, and cost nothing.

Mitsuba needs LLVM: install Debian's libllvm19 and set DRJIT_LIBLLVM_PATH to libLLVM.so.19.1.
"""

from dataclasses import dataclass
from types import ModuleType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from microsurf.errors import MicrosurfError
from microsurf.model.user_brdf import mitsuba_bsdf
from microsurf.physics import fresnel
from microsurf.surface import Heightfield
from microsurf.surface.layers import LayeredMesh

from .meshes import mesh_of, tile_triangles
from .period import Period

Array = NDArray[np.float64]

LOST = ("below", "behind", "wrapped")
BATCH = 2**20
"""Paths of one launch: fewer leave the kernel's start to be paid, more gain nothing."""


def load() -> ModuleType:
    """Return the module mitsuba with its variant set.

    Raises
    ------
    MicrosurfError
        If Mitsuba is not installed, or has no LLVM that it can use.

    """
    try:
        mitsuba_bsdf.load().set_variant("llvm_ad_rgb")
    except ImportError as error:
        raise MicrosurfError(
            "mitsuba finds no LLVM: install Debian's libllvm19 and set DRJIT_LIBLLVM_PATH to "
            "libLLVM.so.19.1"
        ) from error
    module: ModuleType = mitsuba_bsdf.load()  # which looks at the LLVM of this variant
    return module


@dataclass(frozen=True)
class Traced:
    """What paths came to.

    Attributes
    ----------
    flux : ndarray, shape (orders, kinds, rings, sectors)
        Part of the incident power that leaves into each bin of `microsurf.results.datasets`.
    lost : dict
        Paths lost, by cause: beneath the tile, onto a triangle's back, round the period
        too often.

    """

    flux: Array
    lost: dict[str, int]


def same_body(n: float, kd: float) -> float:
    """Reflectance that gives Mitsuba's plastic the body term of an IL facet of index n.

    Mitsuba takes the inner diffuse reflectance r_i from a polynomial fit (8e−4 of the
    body light off at n = 1.5): Kd' / (1 − Kd' r_fit) = Kd / (1 − Kd r_i) undoes that.
    """
    inner = 1 - float(fresnel.external_diffuse_transmittance(n)) / n**2
    fitted = float(load().fresnel_diffuse_reflectance(1 / n)[0])
    strength = kd / (1 - kd * inner)
    return strength / (1 + strength * fitted)


class MitsubaTile:
    """One period of a periodic heightfield, ready to be traced.

    Parameters
    ----------
    surface : Heightfield
        Periodic.
    n : float
        Relative index of the facets, > 1.
    reflectance : float
        ``diffuse_reflectance`` of the plastic, 0 … 1.
    robust : bool
        Embree's robust mode.

    """

    def __init__(
        self, surface: Heightfield, n: float, reflectance: float, *, robust: bool = True
    ) -> None:
        if surface.boundary != "periodic":
            raise ValueError("surface: must be periodic")
        heights = (surface.heights - surface.heights.mean()) / surface.spacing
        plastic = {
            "type": "plastic",
            "int_ior": n,
            "ext_ior": 1.0,
            "nonlinear": True,
            "diffuse_reflectance": {"type": "rgb", "value": reflectance},
        }
        self._prepare([(heights, plastic)], robust=robust)

    @classmethod
    def layered(cls, pair: LayeredMesh, n: float, kd: float) -> Self:
        """Two surfaces instead: a dielectric interface over a diffuse substrate."""
        if pair.interface.aspect != 1 or pair.interface.flipped.any():
            raise ValueError("pair: must have square cells, cut from (x, y) to (x+1, y+1)")
        tile = cls.__new__(cls)
        diffuse = {"type": "diffuse", "reflectance": {"type": "rgb", "value": kd}}
        dielectric = {"type": "dielectric", "int_ior": n, "ext_ior": 1.0}
        tile._prepare(  # noqa: SLF001 - its own
            [(pair.interface.heights, dielectric), (pair.substrate.heights, diffuse)], robust=True
        )
        return tile

    def _prepare(self, surfaces: list[tuple[Array, dict[str, Any]]], *, robust: bool) -> None:
        """Build the scene of surfaces, each heights in cells and a BSDF, the highest first."""
        mi = load()
        meshes = {}
        for k, (heights, bsdf) in enumerate(surfaces):
            vertices, faces = tile_triangles(heights)
            meshes[f"surface_{k}"] = mesh_of(mi, f"{k}", vertices, faces, mi.load_dict(bsdf))
        (top, _), (bottom, _) = surfaces[0], surfaces[-1]
        rows, columns = top.shape
        self._period = Period(rows, columns, float(bottom.min()), float(top.max()))
        self._scene = mi.load_dict(
            {"type": "scene", "embree_use_robust_intersections": robust, **meshes}
        )
        self._sampler = mi.load_dict({"type": "independent"})

    def trace(self, theta: float, paths: int, seed: int, *, ordered: bool = True) -> Traced:
        """Follow ``paths`` paths of light from (θ, φ = 0), θ in degrees.

        Parameters
        ----------
        theta : float
            0 ≤ θ < 90.
        paths : int
            A power of two from 2⁸ to 2²⁴, one launch.
        seed : int
            Of Mitsuba's independent sampler.
        ordered : bool
            Origins stratified along a Morton curve, instead of independent.

        """
        load()
        from .loop import follow  # noqa: PLC0415 - its types need the variant

        bits = paths.bit_length() - 1
        if paths != 2**bits or not 8 <= bits <= 24:
            raise ValueError(f"paths = {paths}: must be a power of two from 2^8 to 2^24")
        self._sampler.seed(int(np.random.SeedSequence(seed).generate_state(1)[0]), paths)
        bins, lost = follow(self._scene, self._sampler, self._period, theta, bits, ordered=ordered)
        return Traced(bins / paths, dict(zip(LOST, lost, strict=True)))
