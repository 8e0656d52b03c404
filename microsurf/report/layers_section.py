"""The section of a report about a scene with two layers."""

from ..analysis.validation import Validation
from .section import Section, Table

_PAIR = """Measured are two explicit surfaces, an interface over a Lambertian substrate. Verdicts
are against theories of interfaced-Lambertian (IL) facets on the interface alone: where they depart
it may be by the IL assumption, whose part stands in the budget."""


def section(entry: Validation) -> Section | None:
    """What the pair is, what the atlas says of it, and its theory; None of one surface."""
    if not entry.layers:
        return None
    said = [entry.layers["il_assumption"][name]["text"] + "." for name in ("albedo", "lobe")]
    lines = [f"Does not apply to two layers: {text}." for text in entry.layers["left_out"]]
    pair = {name.replace("_", " "): value for name, value in entry.layers["pair"].items()}
    tables = [Table("The first realisation, lengths in cells", [pair])]
    for key, rows in entry.layers["theory"].items():
        shown = [
            {
                "quantity": row["quantity"], "θ_i (°)": row["theta_i"], "Kd": row["kd"],
                "measured": row["measured"], "predicted": row["predicted"],
                "measured / predicted − 1 (%)": 100 * row["effect"],
                "from (%)": 100 * row["low"], "to (%)": 100 * row["high"],
            }
            for row in rows
        ]  # fmt: skip
        tables.append(Table(f"Against {key}: layers that know nothing of each other", shown))
    text = "\n\n".join([_PAIR, *said, *lines])
    return Section("layers", "Two layers", text, tuple(tables), (), ("guo2018",))
