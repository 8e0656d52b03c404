"""One scene rendered by Mitsuba with ``roughplastic`` and with ``ilstd``: a picture of both.

    python -m validation.renderers.picture

Writes rendered.png to reports/renderers. Wants the extra ``mitsuba``; a minute with LLVM 19
(DRJIT_LIBLLVM_PATH), else many.
"""

import sys
import time
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from microsurf import mitsuba
from microsurf.cli.save import save
from microsurf.model.user_brdf.mitsuba_bsdf import load
from microsurf.report.figures.style import new_figure, own_style

from .run import OUT

SIZE = 300
SAMPLES = 256
ALPHA, N, KD = 0.5, 1.5, 0.8
COLOUR = (KD, 0.25, 0.12)
VARIANT = "llvm_ad_rgb"
GAIN = 1.1


def materials() -> dict[str, dict[str, Any]]:
    """Same index, substrate and roughness: Mitsuba's, and interfaced-Lambertian facets."""
    same = {"int_ior": N, "diffuse_reflectance": {"type": "rgb", "value": list(COLOUR)}}
    plastic = {
        "type": "roughplastic", "distribution": "ggx", "alpha": ALPHA, "ext_ior": 1.0,
        "nonlinear": True, **same,
    }  # fmt: skip
    facets = {"type": "ilstd", "sigma": ALPHA, **same}
    return {
        f"roughplastic, GGX, α = {ALPHA:g}": plastic,
        f"ilstd, γ = 2 (GGX), σ = {ALPHA:g}": {"gamma": 2.0, **facets},
        f"ilstd, γ = 10⁴ (Beckmann), σ = {ALPHA:g}": {"gamma": 1e4, **facets},
    }


def scene(mi: Any, material: dict[str, Any]) -> Any:
    """A sphere of the material on a grey floor, under one lamp and a dim sky."""
    to_world = mi.ScalarTransform4f
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 6},
            "sensor": {
                "type": "perspective", "fov": 30,
                "to_world": to_world().look_at([0, -5, 1.6], [0, 0, 0.85], [0, 0, 1]),
                "film": {"type": "hdrfilm", "width": SIZE, "height": SIZE},
            },
            "ball": {"type": "sphere", "center": [0, 0, 1], "radius": 1, "bsdf": material},
            "floor": {
                "type": "rectangle", "to_world": to_world().scale(20),
                "bsdf": {"type": "diffuse", "reflectance": 0.4},
            },
            "lamp": {
                "type": "sphere", "center": [-4, 1.5, 4], "radius": 0.6,
                "emitter": {"type": "area", "radiance": 110.0},
            },
            "sky": {"type": "constant", "radiance": 0.25},
        }
    )  # fmt: skip


@own_style()
def side_by_side(pictures: dict[str, np.ndarray]) -> Figure:
    """A panel for each material."""
    figure = new_figure(3.3, 9)
    for axes, (name, pixels) in zip(
        figure.subplots(1, len(pictures)), pictures.items(), strict=True
    ):
        shown = np.clip(GAIN * pixels, 0, 1)
        srgb = np.where(shown < 0.0031308, 12.92 * shown, 1.055 * shown ** (1 / 2.4) - 0.055)
        axes.imshow(srgb)
        axes.set_title(name, fontsize=9)
        axes.axis("off")
    return figure


def main() -> None:
    """Render and write."""
    mi = load()
    mi.set_variant(VARIANT)
    mitsuba.register()
    pictures = {}
    for name, material in materials().items():
        one = scene(mi, material)
        begin = time.process_time()
        pictures[name] = np.array(mi.render(one, spp=SAMPLES))[..., :3]
        spent = time.process_time() - begin
        sys.stdout.write(
            f"{name}: {spent:.1f} s of processor time, mean {pictures[name].mean():.4f}\n"
        )
    OUT.mkdir(parents=True, exist_ok=True)
    save(OUT, {"rendered.png": side_by_side(pictures)}, dpi=110)


if __name__ == "__main__":
    main()
