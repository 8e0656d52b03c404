"""The benchmark's tables and plots."""

import dataclasses
import json
import platform
from importlib.metadata import version
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from microsurf import memory
from microsurf.cli.save import save
from microsurf.report.figures.style import own_style

from .growth import GAMMA, SIGMA, THETA, Size
from .rows import Row
from .sides import RIVALS

FOLDER = Path(__file__).parents[2] / "reports" / "bench"
PACKAGES = ("microsurf", "mitsuba", "drjit", "embreex", "numba", "numpy")
# Okabe and Ito's palette: distinct to the colour-blind; markers say it again.
_STYLES = (("#0072B2", "o"), ("#D55E00", "s"), ("#E69F00", "^"))
_GROUPS = {
    "total albedo": "total albedo",
    "order 2": "albedo of order 2",
    "order-1 body lobe,\nmedian bin": "bins of the order-1 body lobe",
    "order-1 specular lobe,\nmedian bin": "bins of the order-1 specular lobe",
}
_METHOD = """\
Each side in a process of its own, on the same heights, n = 1.5, Kd = 0.8; speeds by the median of
turns taken one after the other, everything compiled before, in seconds of the processor, all
threads together: a busy machine hardly changes them. Ours pay for the mesh in each turn, Mitsuba
does not. Where we split a light ray into several paths, a path is not a whole one: light rays a
second say what comes in, efficiency says what comes out. Variances over independent batches of
262144 paths, 32 of ours and 96 of Mitsuba's (fewer with --quick), the same estimator for all;
intervals are 95 %, of the variances alone. An order is judged where 10 paths a batch or more reach
it on both sides, a bin where 3 do. Mitsuba is given origins stratified in our order, which its
packets of rays gain from more than we do; the plain way, with independent origins, and Embree's
default mode without robustness are shown beside it. Before all this both engines must agree with
Mitsuba: their albedos by order and kind on meshes of 256² cells of the same three kinds. Growth and
threads are by the clock: where the machine had other work, as in the run shown here, the speed-up
on two threads says nothing."""


def machine() -> dict[str, str | int]:
    """Processor, cores and versions: what the figures hang on."""
    processor = platform.processor() or platform.machine()
    information = Path("/proc/cpuinfo")
    if information.exists():
        for line in information.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                processor = line.split(":", 1)[1].strip()
                break
    return {
        "processor": processor,
        "cores": memory.cores(),
        "python": platform.python_version(),
        **{name: version(name) for name in PACKAGES},
    }


@own_style()
def write(folder: Path, rows: list[Row], sizes: list[Size], threads: dict[int, float]) -> None:
    """Write bench.json, bench.csv, bench.md and the plots into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    about = machine()
    table = [{**_rounded(row), "verdict": row.verdict} for row in rows]
    content = {
        "machine": about,
        "rows": table,
        "growth": [_rounded(size) for size in sizes],
        "speed_up": {str(count): round(gain, 3) for count, gain in threads.items()},
    }
    save(
        folder,
        {
            "bench.json": json.dumps(content, ensure_ascii=False) + "\n",
            "bench.csv": table,
            "bench.md": _page(about, rows, sizes, threads),
            "ratios.png": ratios(rows),
            "growth.png": growth(sizes),
        },
        dpi=100,
    )


def _rounded(item: Row | Size) -> dict[str, object]:
    """Return its fields, floats to four digits."""
    return {
        key: float(f"{value:.4g}") if isinstance(value, float) else value
        for key, value in dataclasses.asdict(item).items()
    }


def _page(
    about: dict[str, str | int], rows: list[Row], sizes: list[Size], threads: dict[int, float]
) -> str:
    judged = [row for row in rows if row.target is not None]
    met = sum(row.verdict == "met" for row in judged)
    conclusion = (
        f"**{met} of {len(judged)} targets met,** "
        f"{sum(row.verdict == 'undecided' for row in judged)} undecided, "
        f"{sum(row.verdict == 'missed' for row in judged)} missed. Ratios are those of the exact "
        "engine over the other; efficiency is 1/(variance × time)."
    )
    lines = [
        "# The exact engine, Embree and Mitsuba 3 on the same meshes",
        "",
        conclusion,
        "",
        *_table(
            ("what", "target", "worst", "median", "best", "met"),
            [_summary(quantity, judged) for quantity in dict.fromkeys(r.quantity for r in judged)],
        ),
        "",
        "![Ratios](ratios.png)",
        "",
        "![Growth](growth.png)",
        "",
        "## How it was done",
        "",
        _METHOD,
        "",
        ", ".join(f"{key} {value}" for key, value in about.items()),
        "",
        "## Every row",
        "",
    ]
    for case in dict.fromkeys(row.case for row in rows):
        of_case = [row for row in rows if row.case == case]
        lines += [
            f"### {case}",
            "",
            *_table(
                ("θ (°)", "what", "ratio", "95 %", "ours", "theirs", "unit", "target", ""),
                [_cells(row) for row in of_case],
            ),
            "",
        ]
    lines += [
        f"## Growth: γ = {GAMMA:g}, σ = {SIGMA:g}, θ = {THETA:g}°",
        "",
        *_table(
            ("cells a side", "µs a path", "bytes a cell, peak", "synthesis (s)", "in all (s)"),
            [
                (
                    f"{size.cells}",
                    f"{size.microseconds_per_path:.2f}",
                    f"{size.bytes_per_cell:.0f}",
                    f"{size.synthesis_seconds:.1f}",
                    f"{size.seconds:.1f}",
                )
                for size in sizes
            ],
        ),
        "",
        *_table(
            ("threads", "speed-up"),
            [(f"{count}", f"{gain:.2f}") for count, gain in threads.items()],
        ),
    ]
    return "\n".join(lines) + "\n"


def _table(head: tuple[str, ...], body: list[tuple[str, ...]]) -> list[str]:
    return [f"| {' | '.join(line)} |" for line in (head, ("---",) * len(head), *body)]


def _target(row: Row) -> str:
    return "" if row.target is None else f"{'≤' if row.at_most else '≥'} {row.target:g}"


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.3g}"


def _summary(quantity: str, judged: list[Row]) -> tuple[str, ...]:
    """One line for a quantity over all cases."""
    rows = [row for row in judged if row.quantity == quantity]
    ratios = sorted((row.ratio for row in rows), reverse=rows[0].at_most)
    verdicts = [row.verdict for row in rows]
    counts = ", ".join(
        f"{verdicts.count(word)} {word}"
        for word in ("met", "undecided", "missed")
        if word in verdicts
    )
    middle = float(np.median(ratios))
    return (
        quantity, _target(rows[0]), _number(ratios[0]), _number(middle), _number(ratios[-1]), counts
    )  # fmt: skip


def _cells(row: Row) -> tuple[str, ...]:
    interval = "" if row.low is None else f"{_number(row.low)} … {_number(row.high)}"
    bins = f" ({row.bins})" if row.bins > 1 else ""
    return (
        _number(row.theta), row.quantity + bins, _number(row.ratio), interval,
        _number(row.ours), _number(row.theirs), row.unit, _target(row), row.verdict,
    )  # fmt: skip


def _plain(axes: Axes) -> None:
    axes.grid(visible=True, color="#dddddd", linewidth=0.5)
    axes.spines[["top", "right"]].set_visible(False)


def ratios(rows: list[Row]) -> Figure:
    """Efficiency of the exact engine over each rival in the nine cases, of what matters most."""
    figure = Figure(figsize=(9, 5.6), layout="constrained")
    panels = figure.subplots(len(RIVALS), len(_GROUPS), sharex=True, sharey=True)
    for line, rival in zip(panels, RIVALS.values(), strict=True):
        for panel, (title, name) in zip(line, _GROUPS.items(), strict=True):
            quantity = f"efficiency over {rival}: {name}"
            _ratio_panel(panel, title, [row for row in rows if row.quantity == quantity])
        line[0].set_ylabel(f"efficiency over {rival}")
        line[0].set_yscale("log")
        axis = line[0].yaxis
        axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter(NullFormatter())
    figure.supxlabel("incidence θ (°)", fontsize=10)
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=4, fontsize=8, frameon=False)
    return figure


def _ratio_panel(panel: Axes, title: str, found: list[Row]) -> None:
    angles = sorted({row.theta for row in found if row.theta is not None})
    for k, case in enumerate(dict.fromkeys(row.case for row in found)):
        of_case = [row for row in found if row.case == case]
        colour, marker = _STYLES[k]
        value = np.array([row.ratio for row in of_case])
        low = np.array([row.ratio if row.low is None else row.low for row in of_case])
        high = np.array([row.ratio if row.high is None else row.high for row in of_case])
        panel.errorbar(
            [angles.index(row.theta or 0.0) + 0.15 * (k - 1) for row in of_case], value,
            yerr=(value - low, high - value), color=colour, marker=marker, linestyle="none",
            markersize=5, capsize=2, linewidth=1, label=case,
        )  # fmt: skip
    for target in [row.target for row in found[:1] if row.target is not None]:
        panel.axhline(target, color="#000000", linestyle="--", linewidth=1, label="target")
    panel.axhline(1, color="#888888", linewidth=0.8)
    panel.set_title(title, fontsize=9)
    panel.set_xticks(range(len(angles)), [f"{theta:g}" for theta in angles])
    panel.set_xlim(-0.5, len(angles) - 0.5)
    _plain(panel)


def growth(sizes: list[Size]) -> Figure:
    """Time a path and memory a cell with the number of cells."""
    figure = Figure(figsize=(7, 3), layout="constrained")
    left, right = figure.subplots(1, 2)
    draw = (
        (left, [s.microseconds_per_path for s in sizes], "µs a path", "Time a path"),
        (right, [s.bytes_per_cell for s in sizes], "bytes a cell", "Peak memory"),
    )
    for k, (axes, values, unit, title) in enumerate(draw):
        colour, marker = _STYLES[k]
        axes.plot([s.cells**2 for s in sizes], values, color=colour, marker=marker)
        axes.set_xscale("log")
        axes.set_xlabel("cells")
        axes.set_ylabel(unit)
        axes.set_title(title, fontsize=10)
        _plain(axes)
    left.set_ylim(bottom=0)
    right.set_yscale("log")
    right.axhline(400, color="#000000", linestyle="--", linewidth=1, label="target at 2048²")
    right.legend(fontsize=8, frameon=False)
    return figure
