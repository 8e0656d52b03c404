"""Processor time until an error is reached, surfaces included: what users wait for.

    make bench                                     # runs this too; writes reports/bench/times.csv
    python -m validation.bench.time_to_error --against OTHER/.venv/bin/microsurf   # and another's

`measure` is run as a command with few and with many surfaces. The difference of their processor
times (all threads) is what each surface takes, synthesis and mesh included; what is left is the
start. The variance of one surface comes from the scatter between the many. Together they say when
a standard error is reached: start + (time of one surface) · (variance of one) / error². Few paths
a surface are cheap where surfaces differ more than rays do, many where they do not, so each number
of paths has a row: who asks for an error gets about the cheapest (`--standard-error` chooses it).
Each command's figures are of the same seed; intervals are those of the variance of so many
surfaces.
"""

import argparse
import json
import resource
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray
from scipy import stats
from tqdm import tqdm

from microsurf.cli.save import rounded, save
from microsurf.stats.intervals import CONFIDENCE

from .report import FOLDER
from .sides import EMBREE, EXACT, KD, N

MATERIALS = ((8.0, 0.7), (2.0, 0.3), (1.75, 0.3))
"""γ and σ."""
THETA, PATHS = 60.0, (2**14, 2**16, 2**18)
FEW, MANY = 4, 24
ALBEDO_ERROR, LOBE_ERROR = 1e-3, 0.02
"""Of the total albedo; of the median bin of the order-1 body lobe, relative to itself."""
BRIGHT = 0.01
"""Bins are counted that have this part of the brightest one's flux."""


@dataclass(frozen=True)
class Run:
    """One command: its processor time in seconds, and squared standard errors of one surface."""

    seconds: float
    albedo: float
    lobe: float


def run(command: list[str], gamma: float, sigma: float, paths: int, realisations: int) -> Run:
    """Measure so many surfaces by a command; its arguments follow."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "measured.nc"
        numbers = {
            "gamma": gamma, "sigma": sigma, "n": N, "kd": KD, "theta": THETA, "paths": paths,
            "realisations": realisations,
        }  # fmt: skip
        options = [text for name, value in numbers.items() for text in (f"--{name}", f"{value:g}")]
        options[options.index("--paths") + 1] = str(paths)
        before = _processor_time()
        answer = subprocess.run(  # noqa: S603 - of whoever runs the benchmark
            [*command, *options, "--json", "--out", str(path)],
            check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        seconds = _processor_time() - before
        with xarray.open_dataset(path) as result:
            body = result.flux.sel(order=1, body_events=1).isel(theta_i=0, phi_i=0)
            flux = body.values.reshape(realisations, -1)
    mean = flux.mean(0)
    bright = mean > BRIGHT * mean.max()
    relative = flux[:, bright].var(0, ddof=1) / mean[bright] ** 2
    albedo = realisations * json.loads(answer.stdout)["albedo_se"] ** 2
    return Run(seconds, albedo, float(np.median(relative)))


def _processor_time() -> float:
    """Of all children that have ended, in seconds."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def row(name: str, command: list[str], gamma: float, sigma: float, paths: int) -> dict[str, object]:
    """Times of one command, material and number of paths; compiled before."""
    run(command, gamma, sigma, paths, 2)
    few, many = (run(command, gamma, sigma, paths, count) for count in (FEW, MANY))
    surface = (many.seconds - few.seconds) / (MANY - FEW)
    start = few.seconds - FEW * surface
    low, high = ((MANY - 1) / end for end in stats.chi2.interval(CONFIDENCE, MANY - 1)[::-1])
    return {
        "gamma": gamma,
        "sigma": sigma,
        "paths": paths,
        "command": name,
        "start_s": start,
        "surface_s": surface,
        "albedo_s": surface * many.albedo / ALBEDO_ERROR**2,
        "lobe_s": surface * many.lobe / LOBE_ERROR**2,
        "variance_low": low,
        "variance_high": high,
    }


def main() -> None:
    """Write the table and print it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--against", type=Path, help="microsurf's command of another version")
    parser.add_argument("--out", type=Path, default=FOLDER, help="folder to write into")
    arguments = parser.parse_args()
    ours = [str(Path(sys.executable).with_name("microsurf")), "measure"]
    commands = {name: [*ours, "--engine", name] for name in (EXACT, EMBREE)}
    if arguments.against:
        commands["other version"] = [str(arguments.against), "measure"]
    cases = [
        (*material, paths, name) for material in MATERIALS for paths in PATHS for name in commands
    ]
    table = [
        row(name, commands[name], gamma, sigma, paths)
        for gamma, sigma, paths, name in tqdm(cases, unit=" cases", disable=None)
    ]
    arguments.out.mkdir(parents=True, exist_ok=True)
    written = rounded(table, 3)
    save(arguments.out, {"times.csv": written})
    for line in written:
        print(*line.values())  # noqa: T201


if __name__ == "__main__":
    main()
