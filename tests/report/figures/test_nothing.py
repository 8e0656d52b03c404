"""Every figure of nothing, and of zeros, says so: no error, no empty axes, no NaN."""

import ast
import warnings
from pathlib import Path

import numpy as np
import pytest

from microsurf.analysis.convergence.study import Convergence
from microsurf.report import figures
from microsurf.report.figures import (
    albedo_by_order,
    convergence,
    error_budget,
    lobes,
    masking,
    overview,
    pareto,
    pareto_all,
    stability,
    surface,
    user_brdf,
    verdicts,
)  # fmt: skip
from microsurf.report.figures.figure import write
from microsurf.scene import Roughness, Scene
from microsurf.stability import Stability
from microsurf.surface import Heightfield

PLACE = {"theta_i": 30.0, "phi_i": 0.0, "kd": 0.0, "quantity": "total"}
ZERO = {"value": 0.0, "difference": 0.0, "low": 0.0, "high": 0.0, "deviation": 0.0}
FLAT = surface.rows(Heightfield(np.zeros((8, 8))), Scene())
MASKED = {"g1": 0.0, "g2": 0.0, "g1_se": 0.0, "g2_se": 0.0, "g1_smith": 0.0, "g2_smith": 0.0}
COST = {
    "quantity": "albedo", "rung": "smith", "model": "smith", "seconds": 1.0, "seconds_low": 1.0,
    "seconds_high": 1.0, "error": 0.0, "error_low": 0.0, "error_high": 0.0, "dominated_by": None,
}  # fmt: skip
LOBE = {
    "source": "smith", "quantity": "total", "theta_i_deg": 0.0, "phi_i_deg": 0.0, "kd": 0.0,
}  # fmt: skip


class NoUserBrdf:
    """An entry without a user BRDF."""

    user_brdf = None


EMPTY = {
    "albedo_by_order.figure": lambda: albedo_by_order.figure([]),
    "convergence.draw": lambda: convergence.draw(Convergence(), "dark"),
    "error_budget.figure": lambda: error_budget.figure([]),
    "lobes.figure": lambda: lobes.figure([]),
    "masking.figure": lambda: masking.figure([]),
    "overview.figure": lambda: overview.figure([]),
    "pareto.figure": lambda: pareto.figure([], "dark"),
    "pareto_all.scenes": lambda: pareto_all.scenes({}),
    "pareto_all.over_all": lambda: pareto_all.over_all([]),
    "stability.figure": lambda: stability.figure(Stability([], [], [], [], 0.0), "facet"),
    "surface.figure": lambda: surface.figure([], 2.0, "cells"),
    "user_brdf.figure": lambda: user_brdf.figure(NoUserBrdf()),
    "verdicts.figure": lambda: verdicts.figure([]),
}
ZEROS = {
    "convergence.draw": lambda: convergence.draw(
        Convergence(
            mesh=[PLACE | ZERO | {"correlation": 8}],
            realisations=[PLACE | ZERO | {"realisations": 1, "groups": 4}],
            rays=[PLACE | ZERO | {"paths": 9, "repeats": 4}],
        ),
        "dark",
    ),
    "error_budget.figure": lambda: error_budget.figure([
        PLACE | {"term": "noise", "predicted": 0.0} | dict.fromkeys(
            ("relative_value", "relative_low", "relative_high"))
    ]),
    "lobes.figure": lambda: lobes.figure(
        [LOBE | {"theta_o_deg": float(t), "brdf_per_sr": 0.0} for t in (-1, 0, 1)]
    ),
    "masking.figure": lambda: masking.figure(
        masking.rows([{"theta_i": 0.0, "rho_low": 0.0, "rho_high": None} | MASKED], 4)
    ),
    "pareto.figure": lambda: pareto.figure([COST]),
    "pareto_all.scenes": lambda: pareto_all.scenes(
        {"a": [COST], "b": [COST | {"quantity": "peak"}]}
    ),
    "surface.figure": lambda: surface.figure(FLAT, 2.0, "cells"),
    "surface.figure, Beckmann": lambda: surface.figure(
        surface.rows(Heightfield(np.ones((4, 4))), Scene(roughness=Roughness(1e9, (0.5,)))),
        2.0, "cells",
    ),
}  # fmt: skip
OF_A_RESULT = {"lobes_of_results.figure", "surface_fit.figure", "brdf_fit.figure", "style.nothing"}
"""Of these there is always a file, which refuses to be empty: see their own tests."""


def drawn(figure, folder):
    """Render it; neither warnings nor NaN are let through. Returns its words."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for ending in ("svg", "png"):
            write(figure, folder / f"x.{ending}")
    assert "nan" not in (folder / "x.svg").read_text(encoding="utf-8").lower().split('"')
    legends = [t for axes in (figure, *figure.axes) for x in [getattr(axes, "legends", [])]
               for legend in x for t in legend.get_texts()]  # fmt: skip
    panels = [axes.get_legend() for axes in figure.axes if axes.get_legend()]
    texts = [*figure.texts, *(t for axes in figure.axes for t in axes.texts), *legends]
    return " ".join(t.get_text() for t in [*texts, *(t for p in panels for t in p.get_texts())])


@pytest.mark.parametrize("name", EMPTY)
def test_a_figure_of_nothing_says_so(name, tmp_path):
    assert "nothing to show: " in drawn(EMPTY[name](), tmp_path)


@pytest.mark.parametrize("name", ZEROS)
def test_a_figure_of_zeros_is_drawn(name, tmp_path):
    assert drawn(ZEROS[name](), tmp_path)


def test_no_figure_is_forgotten():
    made = set()
    for path in Path(figures.__file__).parent.glob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        made |= {
            f"{path.stem}.{node.name}"
            for node in tree.body
            if isinstance(node, ast.FunctionDef)
            and any("own_style" in ast.unparse(d) for d in node.decorator_list)
        }
    assert made - OF_A_RESULT == set(EMPTY)
