"""Widths of a report's 95 % intervals against those that another version reports.

    make widths    # of the reports in reports/before and reports/latest; --before, --after others

Both are folders of `microsurf validate`, of the same scenes and seed. Writes
reports/bench/widths.csv: for each scene and section the median of after / before over the
intervals of both, with the quartiles, and how many there are. Total: effects on the total albedo;
orders: albedos by order; lobes: specular and body lobes in the plane of incidence. Intervals
without width (of a flat surface) are left out.
"""

import argparse
import csv
from collections import defaultdict
from pathlib import Path

import numpy as np

from microsurf.cli.save import rounded, save

from .report import FOLDER

BEFORE, AFTER = Path("reports/before"), Path("reports/latest")

Widths = dict[tuple[str, ...], float]


def rows(path: Path) -> list[dict[str, str]]:
    """Rows of a figure's numbers."""
    with path.open(encoding="utf-8", newline="") as lines:
        return list(csv.DictReader(lines))


def widths(folder: Path, scene: str) -> dict[str, Widths]:
    """Width of each interval of what was measured, by section and what it is of."""
    sections: dict[str, Widths] = defaultdict(dict)
    for figure, section in (("effects", "total"), ("albedos", "orders"), ("lobes", "lobes")):
        for row in rows(folder / "figures" / f"{scene}-{figure}.csv"):
            low, high = (row.get(end) or row.get(f"{end}_percent") for end in ("low", "high"))
            is_total = section != "total" or row["quantity"] == "total"
            if row.get("source", "measured") == "measured" and low and high and is_total:
                keys = ("quantity", "order", "theta_i_deg", "phi_i_deg", "kd", "theta_o_deg")
                what = tuple(row.get(key, "") for key in keys)
                sections[section][what] = float(high) - float(low)
    return sections


def compare(before: Path, after: Path) -> list[dict[str, object]]:
    """Give a row for each scene and section that both reports have intervals of."""
    scenes = sorted(
        path.name[: -len("-effects.csv")] for path in after.glob("figures/*-effects.csv")
    )
    table: list[dict[str, object]] = []
    for scene in scenes:
        old, new = widths(before, scene), widths(after, scene)
        for section in new:
            both = [w for w in new[section] if old.get(section, {}).get(w, 0) > 1e-12]
            if both:
                ratios = [new[section][w] / old[section][w] for w in both]
                low, middle, high = np.quantile(ratios, (0.25, 0.5, 0.75))
                table.append(
                    {
                        "scene": scene, "section": section, "intervals": len(both),
                        "median": middle, "quartile_low": low, "quartile_high": high,
                    }
                )  # fmt: skip
    return table


def main() -> None:
    """Write the table and print it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--before", type=Path, default=BEFORE, help="report of the other version")
    parser.add_argument("--after", type=Path, default=AFTER, help="report of this version")
    parser.add_argument("--out", type=Path, default=FOLDER, help="folder to write into")
    arguments = parser.parse_args()
    written = rounded(compare(arguments.before, arguments.after), 3)
    save(arguments.out, {"widths.csv": written})
    for line in written:
        print(*line.values())  # noqa: T201


if __name__ == "__main__":
    main()
