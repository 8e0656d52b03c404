"""One scene rendered by Mitsuba with ``roughplastic``, ``ilstd`` and a traced material.

    python -m validation.renderers.picture

Writes rendered.png to reports/renderers. The traced material is what `export` writes of explicit
surfaces; Mitsuba reads it without a plug-in. Wants the extra ``mitsuba``; two minutes with LLVM 19
(DRJIT_LIBLLVM_PATH), else many.
"""

import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from microsurf import measure, mitsuba
from microsurf.analysis.export import rgl
from microsurf.analysis.export.traced import of_result
from microsurf.cli.save import save
from microsurf.model.user_brdf.mitsuba_bsdf import load
from microsurf.report.figures.style import new_figure, own_style
from microsurf.results import datasets
from microsurf.scene import Accuracy, Light, Material, Roughness, Scene, Surface

from ..figures import srgb
from .run import OUT

SIZE = 300
SAMPLES = 256
ALPHA, N, KD = 0.5, 1.5, 0.8
COLOUR = (KD, 0.25, 0.12)
THETAS = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 80.0, 85.0, 88.0)
PATHS = 400_000
VARIANT = "llvm_ad_rgb"
GAIN = 1.1


def traced(folder: Path) -> Path:
    """Trace explicit surfaces of the same facets and export what leaves them, as RGL's file."""
    scene = Scene(
        material=Material(N, COLOUR),
        roughness=Roughness(2.0, (ALPHA,)),
        surface=Surface(realisations=4),
        light=Light(THETAS),
        accuracy=Accuracy(PATHS),
    )
    result, out = folder / "traced.nc", folder / "traced.bsdf"
    datasets.save(measure(scene, progress=True), result)
    rgl.write(of_result(result), out)
    return out


def materials(measured: Path) -> dict[str, dict[str, Any]]:
    """Same index, substrate and roughness: Mitsuba's, IL facets by theory, and as traced."""
    same = {"int_ior": N, "diffuse_reflectance": {"type": "rgb", "value": list(COLOUR)}}
    plastic = {
        "type": "roughplastic", "distribution": "ggx", "alpha": ALPHA, "ext_ior": 1.0,
        "nonlinear": True, **same,
    }  # fmt: skip
    facets = {"type": "ilstd", "sigma": ALPHA, **same}
    return {
        "roughplastic": plastic,
        "ilstd, order 1": {"gamma": 2.0, **facets},
        "ilstd, all orders": {"gamma": 2.0, "orders": "all", **facets},
        "traced surfaces": {"type": "measured", "filename": str(measured)},
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
    figure = new_figure(2.8, 10)
    for axes, (name, pixels) in zip(
        figure.subplots(1, len(pictures)), pictures.items(), strict=True
    ):
        axes.imshow(srgb.encode(GAIN * pixels))
        axes.set_title(name, fontsize=9)
        axes.axis("off")
    return figure


def main() -> None:
    """Render and write."""
    mi = load()
    mi.set_variant(VARIANT)
    mitsuba.register()
    with tempfile.TemporaryDirectory() as folder:
        scenes = {name: scene(mi, m) for name, m in materials(traced(Path(folder))).items()}
    pictures = {}
    for name, one in scenes.items():
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
