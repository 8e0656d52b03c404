"""Error of the closed form of the body integral against its quadrature: a table and a figure.

    python -m validation.figures.approximate_error          # writes both into reports/gallery
    python -m validation.figures.approximate_error --fit    # fits the constants of SPREAD again

At each incidence, over the hemisphere and weighted by the flux cosθ_o dω of a
Lambertian surface: the rms relative error of f_b, and the relative error of the albedo
∫ f_b cosθ_o dω.
"""

import argparse
from collections.abc import Callable
from itertools import product
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.optimize import least_squares

from microsurf.cli.save import save
from microsurf.model.directions import direction
from microsurf.model.single_scattering import body_closed_form, brdf
from microsurf.model.single_scattering.facets import Facets
from microsurf.report.figures.style import own_style

Array = NDArray[np.float64]

GAMMAS = (1.6, 2.0, 4.0, 1e6)
INDICES = (1.0, 1.33, 1.5, 2.5)
SIGMAS = (0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0)
THETAS = (0, 15, 30, 45, 60, 70, 75, 80, 85)
NODES = 16  # in sin²θ_o and in the azimuth, half a turn
REFINEMENT = 0.5  # of the quadrature: within 3e−4 of that at 1
GALLERY = Path(__file__).parents[2] / "reports" / "gallery"
COLUMNS = ("gamma", "n", "sigma", "theta_i", "rms_percent", "albedo_percent")


def hemisphere() -> tuple[Array, Array]:
    """Half the directions o (the other half mirrors it), and their parts of ∫ cosθ_o dω / π."""
    x, weight = np.polynomial.legendre.leggauss(NODES)
    rise, azimuth = np.meshgrid((1 + x) / 2, np.pi * (1 + x) / 2)
    theta = np.arcsin(np.sqrt(rise))
    return direction(theta, azimuth).reshape(-1, 3), np.outer(weight, weight).ravel() / 4


def errors(facets: Facets, theta_i: float) -> tuple[float, float]:
    """Rms relative error of f_b and relative error of the albedo, in %, at θ_i in degrees."""
    o, flux = hemisphere()
    i = np.broadcast_to(direction(np.radians(theta_i), 0.0), o.shape)
    exact = brdf.body(facets, i, o, REFINEMENT)
    value = body_closed_form.body(facets, i, o)
    rms = np.sqrt(np.sum(flux * (value / exact - 1) ** 2))
    return 100 * float(rms), 100 * float(np.sum(flux * value) / np.sum(flux * exact) - 1)


def table() -> list[tuple[float, ...]]:
    """Rows of COLUMNS."""
    rows: list[tuple[float, ...]] = []
    for gamma, n, sigma, theta in product(GAMMAS, INDICES, SIGMAS, THETAS):
        rows.append((gamma, n, sigma, theta, *errors(Facets(n, gamma, sigma, sigma), theta)))
    return rows


@own_style()
def heat_maps(rows: list[tuple[float, ...]]) -> Figure:
    """Rms relative error over σ and θ_i, a panel for each γ and n."""
    values = np.array(rows)[:, 4].reshape(len(GAMMAS), len(INDICES), len(SIGMAS), len(THETAS))
    figure = Figure(figsize=(9.0, 8.0), layout="constrained", dpi=110)
    panels = figure.subplots(len(GAMMAS), len(INDICES), sharex=True, sharey=True)
    for (g, gamma), (k, n) in product(enumerate(GAMMAS), enumerate(INDICES)):
        panel = panels[g, k]
        colours = panel.imshow(
            values[g, k].T, origin="lower", aspect="auto", cmap="cividis", vmin=0, vmax=6
        )
        name = r"10^6" if gamma == 1e6 else f"{gamma:g}"
        panel.set_title(rf"$\gamma = {name}$, $n = {n:g}$", fontsize=9)
        panel.set_xticks(range(0, len(SIGMAS), 2), [f"{s:g}" for s in SIGMAS[::2]])
        panel.set_yticks(range(len(THETAS)), [f"{t}" for t in THETAS], fontsize=8)
    figure.supxlabel(r"roughness $\sigma$", fontsize=10)
    figure.supylabel(r"incidence $\theta_i$ (°)", fontsize=10)
    figure.colorbar(
        colours, ax=panels, shrink=0.6, extend="max",
        label=r"rms relative error of $f_b$ over the hemisphere, flux-weighted (%)",
    )  # fmt: skip
    return figure


def fit() -> None:
    """Print the constants of SPREAD by least squares, and the rms residual."""
    theta = np.radians([0, 15, 30, 45, 60, 70, 78, 85])
    theta_i, theta_o, delta = (
        a.ravel() for a in np.meshgrid(theta, theta, np.radians(np.arange(0, 181, 30)))
    )
    i, o = direction(theta_i, 0.0), direction(theta_o, delta)
    weight = np.sqrt(i[:, 2] * np.sin(theta_i) * o[:, 2] * np.sin(theta_o))
    weight /= np.linalg.norm(weight)
    design = [
        (Facets(n, gamma, sigma, sigma), Facets(1.0, gamma, sigma, sigma))
        for gamma, sigma in product((2.0, 3.0, 8.0, np.inf), (0.05, 0.15, 0.5, 1.0))
        for n in (1.33, 1.5, 2.5)
    ]

    def quotient(body: Callable[..., Array], *more: object) -> list[Array]:
        """Mean of T T over the facets, apart from 1/(1 − r_e)."""
        return [body(facets, i, o, *more) / body(bare, i, o, *more) for facets, bare in design]

    exact = quotient(brdf.body, REFINEMENT)

    def residuals(constants: Array) -> Array:
        found = quotient(body_closed_form.body, body_closed_form.CosineSpread(*constants))
        off = [weight * (v / e - 1) for v, e in zip(found, exact, strict=True)]
        return np.asarray(np.concatenate(off) / np.sqrt(len(design)))

    best = least_squares(residuals, [1.0, 0.5, 0.0, 1.0], diff_step=1e-4)
    residual = 100 * np.linalg.norm(best.fun)
    print(body_closed_form.CosineSpread(*best.x.tolist()), f"rms residual {residual:.2f} %")  # noqa: T201


def main() -> None:
    """Write the table and the figure, or fit."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--fit", action="store_true", help="fit the constants of SPREAD")
    if parser.parse_args().fit:
        fit()
        return
    rows = table()
    cells = [[*row[:4], *(f"{v:.3f}" for v in row[4:])] for row in rows]
    named = [dict(zip(COLUMNS, row, strict=True)) for row in cells]
    pictures = {"approximate-error.png": heat_maps(rows)}
    save(GALLERY, {"approximate-error.csv": named, **pictures}, dpi=110)


if __name__ == "__main__":
    main()
