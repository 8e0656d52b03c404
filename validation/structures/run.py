"""How far surfaces of the same slopes scatter apart: four structures against three theories.

    python -m validation.structures.run --minutes 30     # goes on where it was stopped

Writes reports/atlas: atlas.csv (every albedo with its standard error), surfaces.csv (what
the surfaces realise), atlas.md and the figures. Surfaces are added, eight at a time,
where errors are farthest from TARGETS, until all are reached or time is over; finished
ones lie in reports/latest/atlas. Structures share their seeds: the same initial fields.
"""

import argparse
import csv
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from tqdm import tqdm

from microsurf import measure, predict
from microsurf.cli.save import rounded, save
from microsurf.files import whole_file
from microsurf.model import walk
from microsurf.results import detector
from microsurf.results.albedos import SELECTED
from microsurf.scene import STRUCTURES, Accuracy, Light, Material, Roughness, Scene, Surface
from microsurf.surface import surface_of, surface_statistics

from . import figures, text

Array = NDArray[np.float64]
Row = dict[str, Any]

REPORTS = Path(__file__).parents[2] / "reports"
OUT, KEPT = REPORTS / "atlas", REPORTS / "latest" / "atlas"
N, KD = 1.5, 0.8
GAMMAS = (1.75, 2.0, 4.0, 8.0, 40.0)
THETAS = (0.0, 30.0, 45.0, 60.0, 70.0, 80.0, 85.0)
QUANTITIES = ("total", "specular", "body", "mirror")
"""Albedo of all orders; order-1 specular and body; order-1 specular light within three
rings by three sectors about the mirror direction, where facets are nearly level: with the
same slopes its ratio to theory is that of G2."""
TARGETS = {"total": 0.003, "body": 0.003, "specular": 0.01}
"""Standard errors over surfaces, relative, at every θ_i."""
BATCH = 8
PATHS = 8000  # a surface and angle; making it costs as much as 50 000 of them
WALKS = {"smith-walk": 1_000_000, "vcavity-walk": 2_000_000}
ORDER_1 = ("smith", "smith-separable", "vcavity-walk")
ALL_ORDERS = ("smith-walk", "vcavity-walk")


@dataclass(frozen=True)
class StructureCase:
    """One kind of surface."""

    gamma: float
    sigma: float
    correlation: float
    structure: str

    @property
    def scene(self) -> Scene:
        """The scene of one batch."""
        return Scene(
            material=Material(N, (KD,)),
            roughness=Roughness(self.gamma, (self.sigma,)),
            surface=Surface(
                correlation=self.correlation, structure=self.structure, realisations=BATCH
            ),
            light=Light(THETAS),
            accuracy=Accuracy(PATHS),
        )

    @property
    def file(self) -> Path:
        """Where its albedos lie: an array (surfaces, THETAS, QUANTITIES)."""
        name = f"{self.gamma:g}-{self.sigma:g}-{self.correlation:g}-{self.structure}.npy"
        return KEPT / name

    @property
    def albedos(self) -> Array:
        """Those of finished surfaces."""
        if not self.file.exists():
            return np.empty((0, len(THETAS), len(QUANTITIES)))
        return np.asarray(np.load(self.file), dtype=np.float64)


CASES = tuple(
    StructureCase(gamma, sigma, length, structure)
    for gamma, sigma, length, structure in (
        *product(GAMMAS, (0.5,), (8.0,), STRUCTURES),
        *product((2.0,), (0.5,), (4.0, 16.0), STRUCTURES),
        *product((2.0,), (0.3,), (8.0,), STRUCTURES),
    )
)


def quantities(dataset: xr.Dataset, name: str) -> Array:
    """One of QUANTITIES by realisation and θ_i."""
    if name != "mirror":
        return np.asarray(dataset.microsurf.albedo(**SELECTED[name], n=N, kd=KD).isel(phi_i=0))
    first = dataset.flux.isel(phi_i=0, body_events=0).sel(order=1)
    middle = detector.SECTORS // 2
    columns = [
        first.isel(
            theta_i=k,
            theta_o=slice(max(detector.ring_of(theta) - 1, 0), detector.ring_of(theta) + 2),
            phi_o=slice(middle - 1, middle + 2),
        ).sum(("theta_o", "phi_o"))
        for k, theta in enumerate(THETAS)
    ]
    return np.stack([np.asarray(column) for column in columns], axis=-1)


def reported(name: str, theta: float) -> bool:
    """Whether a quantity has enough light: about the vertical three sectors have next to none."""
    return name != "mirror" or theta > 0


def means(albedos: Array) -> tuple[Array, Array]:
    """Mean over surfaces and its standard error, each (THETAS, QUANTITIES)."""
    return albedos.mean(axis=0), albedos.std(axis=0, ddof=1) / np.sqrt(len(albedos))


def need(case: StructureCase) -> float:
    """Largest error over its target; ∞ for a case not begun."""
    albedos = case.albedos
    if not len(albedos):
        return np.inf
    mean, error = means(albedos)
    off = [
        (error / mean)[:, QUANTITIES.index(name)].max() / target for name, target in TARGETS.items()
    ]
    return float(max(off))


def add_surfaces(case: StructureCase) -> None:
    """Trace one more batch."""
    done = case.albedos
    traced = measure(case.scene, seed=len(done) // BATCH, workers=2)
    more = np.stack([quantities(traced, name) for name in QUANTITIES], axis=-1)
    with whole_file(case.file) as temporary, temporary.open("wb") as stream:
        np.save(stream, np.concatenate([done, more]))


def theory(gamma: float, sigma: float) -> Iterator[Row]:
    """Rows of every theory; walks err by their numbers, which a binomial distribution bounds."""
    scene = StructureCase(gamma, sigma, 8.0, STRUCTURES[0]).scene
    for model in dict.fromkeys((*ORDER_1, *ALL_ORDERS)):
        walks = WALKS.get(model)
        found = walk(scene, model, walks=walks, seed=1) if walks else predict(scene, model)
        for name in QUANTITIES:
            if model not in (ALL_ORDERS if name == "total" else ORDER_1):
                continue
            for theta, value in zip(THETAS, quantities(found, name)[0], strict=True):
                if not reported(name, theta):
                    continue
                error = np.sqrt(value * (1 - value) / walks) if walks else 0.0
                yield {
                    "gamma": gamma, "sigma": sigma, "correlation": "", "source": model,
                    "theta_i": theta, "quantity": name, "value": value, "error": error,
                    "surfaces": 0,
                }  # fmt: skip


def measured(case: StructureCase) -> Iterator[Row]:
    """Rows of one kind of surface."""
    albedos = case.albedos
    mean, error = means(albedos)
    for (k, theta), (j, name) in product(enumerate(THETAS), enumerate(QUANTITIES)):
        if not reported(name, theta):
            continue
        yield {
            "gamma": case.gamma, "sigma": case.sigma, "correlation": case.correlation,
            "source": case.structure, "theta_i": theta, "quantity": name,
            "value": mean[k, j], "error": error[k, j], "surfaces": len(albedos),
        }  # fmt: skip


def of_surface(case: StructureCase) -> Row:
    """What the first surface of a case realises, and the largest errors of its albedos."""
    made = surface_statistics(surface_of(case.scene, 0, 0), case.gamma, case.sigma)
    mean, error = means(case.albedos)
    return {
        "gamma": case.gamma, "sigma": case.sigma, "correlation": case.correlation,
        "structure": case.structure, "surfaces": len(case.albedos),
        **{
            f"{name}_error_percent": 100 * max(
                error[k, j] / mean[k, j] for k, theta in enumerate(THETAS) if reported(name, theta)
            )
            for j, name in enumerate(QUANTITIES)
        },
        "ks": made["ks"], "quantile_0.999": made["quantiles"]["0.999"],
        "slope_height": made["height_slope"]["height"],
        "slope_distance": made["height_slope"]["distance"],
    }  # fmt: skip


def read(path: Path) -> list[Row]:
    """Rows of a table, numbers as numbers; none if it is not there."""
    if not path.exists():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        return [
            {key: value if key in ("source", "quantity") else float(value or "nan")
             for key, value in row.items()}
            for row in csv.DictReader(file)
        ]  # fmt: skip


def write(path: Path, rows: list[Row]) -> None:
    """Write a table, six digits a number."""
    save(path.parent, {path.name: rounded(rows, 6)})


def main() -> None:
    """Trace until the targets or the time are reached, then write tables and figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=30, help="of tracing; 0 draws again")
    until = time.monotonic() + 60 * parser.parse_args().minutes
    for folder in (OUT, KEPT):
        folder.mkdir(parents=True, exist_ok=True)
    with tqdm(desc="batches of surfaces", disable=None) as bar:
        while time.monotonic() < until:
            worst = max(CASES, key=need)
            if need(worst) <= 1:
                break
            add_surfaces(worst)
            bar.update()
    theories = KEPT / "theory.csv"
    if not theories.exists():
        pairs = dict.fromkeys((case.gamma, case.sigma) for case in CASES)
        write(theories, [row for pair in tqdm(pairs, "theories", disable=None)
                         for row in theory(*pair)])  # fmt: skip
    done = [case for case in CASES if len(case.albedos)]
    write(OUT / "surfaces.csv", [of_surface(case) for case in done])
    known = [row for case in done for row in measured(case)]
    write(OUT / "atlas.csv", known + read(theories))
    figures.write(read(OUT / "atlas.csv"), OUT)
    text.write(read(OUT / "atlas.csv"), OUT)


if __name__ == "__main__":
    main()
