"""Put the explorer together: one page that needs nothing beside it.

    python -m validation.explorer.page

Writes explorer.html to reports/explorer, from the scripts of this folder, traced.json and tiles
of surfaces that are generated here. The same inputs give the same bytes.
"""

import base64
import json
import re
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
from markupsafe import Markup

from microsurf import generate_surface
from microsurf.cli.save import save
from microsurf.model import MODELS

from .traced import OUT

FOLDER = Path(__file__).parent
SCRIPTS = ("theory.js", "relief.js", "page.js")
MASKINGS = ("smith", "smith-separable", "vcavity")
"""Models of `microsurf predict` that the page computes."""
GAMMAS = (1.65, 1.7, 1.75, 1.8, 1.9, 2.0, 2.25, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 8.0, 10.0, 15.0,
          25.0, 40.0, 100.0)  # fmt: skip
"""Stops of the slider of γ."""
LAST = len(GAMMAS) - 1
TILE_GAMMAS = (1.65, 1.75, 2.0, 2.5, 4.0, 10.0, 100.0)
SIDE, SEED = 80, 2
"""Cells a side of a tile, and the seed that all tiles share: from γ to γ their hills stay."""
START = {
    "gamma": 2.0, "sigma": 0.5, "n": 1.5, "kd": 0.8, "theta": 60.0, "masking": "smith",
}  # fmt: skip
CONTROLS = (
    {"name": "gamma", "label": "γ, tail of the slopes", "low": 0, "high": LAST, "step": 1},
    {"name": "sigma", "label": "σ, roughness", "low": 0.05, "high": 1.2, "step": 0.01},
    {"name": "n", "label": "n, relative index", "low": 1, "high": 2.5, "step": 0.01},
    {"name": "kd", "label": "Kd, substrate albedo", "low": 0, "high": 1, "step": 0.01},
    {"name": "theta", "label": "θ_i, incidence", "low": 0, "high": 85, "step": 1},
)  # fmt: skip


def tile(gamma: float) -> dict[str, Any]:
    """Heights at σ = 1 in cells, as 16-bit whole numbers of ``scale`` cells."""
    heights = generate_surface(gamma, 1.0, cells=SIDE, seed=SEED).heights
    scale = float(f"{np.abs(heights).max() / 32000:.6g}")
    whole = np.rint(heights / scale).astype("<i2")
    return {"gamma": gamma, "scale": scale, "data": base64.b64encode(whole.tobytes()).decode()}


def page() -> str:
    """Text of the page."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(FOLDER),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )

    def source(name: str) -> Markup:
        text = (FOLDER / name).read_text(encoding="utf-8")
        if re.search("</(script|style)|<!--", text, re.IGNORECASE):
            raise ValueError(f"{name}: holds what would end its element")
        return Markup(text)  # noqa: S704 - a script of this folder, which ends no element

    return environment.get_template("page.html.jinja").render(
        style=source("style.css"),
        scripts=[source(name) for name in SCRIPTS],
        controls=CONTROLS,
        maskings={key: MODELS[key].label for key in MASKINGS},
        data={
            "gammas": GAMMAS,
            "start": START,
            "side": SIDE,
            "tiles": [tile(gamma) for gamma in TILE_GAMMAS],
            "traced": json.loads((OUT / "traced.json").read_text(encoding="utf-8")),
        },
    )


def main() -> None:
    """Write the page."""
    save(OUT, {"explorer.html": page()})


if __name__ == "__main__":
    main()
