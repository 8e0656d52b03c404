"""Part of a surface rendered by Mitsuba: light between facets is followed to its end.

Its facets are Mitsuba's ``plastic`` with its nonlinear term: a flat interface over a
Lambertian substrate, as the facets of this package. Each of PASSES is cut at white before
their mean is taken, so that no single bright path stays as a speck. Wants the extra ``mitsuba``.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from microsurf.model.user_brdf.mitsuba_bsdf import load

from ..mitsuba.meshes import mesh_of
from . import srgb

Array = NDArray[np.float64]

SIZE = (840, 600)
"""Width and height in pixels."""
PASSES, SAMPLES = 16, 24
"""And paths for each pixel of a pass."""
VARIANT = "scalar_rgb"
"""It needs no LLVM."""
SUN_RADIUS = 9.0
"""Of the lamp, in degrees."""
SUN, SKY = (4.4, 4.1, 3.6), (0.13, 0.16, 0.22)
"""Irradiance of a face that looks at the lamp, and radiance of the sky."""


def block(heights: Array) -> tuple[Array, NDArray[np.int64]]:
    """Vertices, shape (…, 3), and triangles of a relief with walls down to a floor.

    Heights [y, x] in cells; x and y are centred, the cells are split as those of the package.
    """
    rows, columns = heights.shape
    y, x = np.mgrid[:rows, :columns]
    top = np.stack([x - (columns - 1) / 2, y - (rows - 1) / 2, heights], axis=-1).reshape(-1, 3)
    number = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1])
    faces = [np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, b, c), (a, c, d))]
    rim = np.concatenate([number[0], number[1:, -1], number[-1, -2::-1], number[-2:0:-1, 0]])
    low = top[rim] * [1, 1, 0] + [0, 0, heights.ravel()[rim].min() - 5]
    below = len(top) + np.arange(len(rim))
    later, later_below = np.roll(rim, -1), np.roll(below, -1)
    faces += [np.stack([rim, below, later_below], axis=-1)]
    faces += [np.stack([rim, later_below, later], axis=-1)]
    return np.concatenate([top, low]), np.concatenate(faces)


def render(heights: Array, theta: float, n: float, kd: float) -> Array:
    """Picture in sRGB on white, shape (height, width, 3) in 0 … 1; light at θ degrees from +x."""
    mi = load()
    mi.set_variant(VARIANT)
    side = float(max(heights.shape))
    tall = np.radians(theta)
    towards = np.array([np.sin(tall), 0.0, np.cos(tall)])
    far, middle = 20 * side, float(heights.mean())
    radius = far * np.tan(np.radians(SUN_RADIUS))
    lamp = np.array(SUN) / (np.pi * np.sin(np.radians(SUN_RADIUS)) ** 2)
    frame = mi.ScalarTransform4f
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 32, "hide_emitters": True},
            "sensor": {
                "type": "perspective", "fov": 22.5,
                "to_world": frame().look_at(
                    [-1.45 * side, -2.55 * side, 2.25 * side + middle],
                    [0, 0, middle - 0.08 * side], [0, 0, 1],
                ),
                "film": {
                    "type": "hdrfilm", "width": SIZE[0], "height": SIZE[1],
                    "pixel_format": "rgba", "rfilter": {"type": "gaussian"},
                },
            },
            "relief": _mesh(mi, *block(heights), n, kd),
            "lamp": {
                "type": "sphere", "center": (far * towards).tolist(), "radius": radius,
                "emitter": {"type": "area", "radiance": {"type": "rgb", "value": lamp.tolist()}},
            },
            "sky": {"type": "constant", "radiance": {"type": "rgb", "value": list(SKY)}},
        }
    )  # fmt: skip
    pixels = np.zeros((SIZE[1], SIZE[0], 4))
    for seed in range(PASSES):
        pixels += np.clip(np.array(mi.render(scene, spp=SAMPLES, seed=seed)), 0, 1) / PASSES
    alpha = pixels[..., 3:]
    return np.asarray(srgb.encode(pixels[..., :3]) * alpha + 1 - alpha)


def _mesh(mi: Any, vertices: Array, faces: NDArray[np.int64], n: float, kd: float) -> Any:
    bsdf = mi.load_dict(
        {
            "type": "twosided",
            "facet": {
                "type": "plastic", "int_ior": n, "ext_ior": 1.0, "nonlinear": True,
                "diffuse_reflectance": {"type": "rgb", "value": [kd, kd, kd]},
            },
        }
    )  # fmt: skip
    return mesh_of(mi, "relief", vertices, faces, bsdf)
