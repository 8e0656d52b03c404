"""What a report says in one line of a verdict, an invariant or a figure that moved."""

from collections.abc import Iterator
from typing import Any

from ..results.albedos import QUANTITIES

Row = dict[str, Any]


def place(row: Row) -> str:
    """Name a quantity and its incidence."""
    name = QUANTITIES.get(row["quantity"], row["quantity"])
    return f"{name}, θ_i = {row['theta_i']:g}°, φ_i = {row['phi_i']:g}°, Kd = {row['kd']:g}"


def effect(row: Row) -> str:
    """Measured over predicted − 1 with its interval, in per cent."""
    return f"{100 * row['effect']:+.2f} % ({100 * row['low']:+.2f} … {100 * row['high']:+.2f})"


def verdict(row: Row) -> str:
    """Say what was found and what was expected of one comparison."""
    return (
        f"{row['verdict']}, expected {row['expected']}: measured {row['measured']:.5g} ± "
        f"{row['standard_error']:.2g}, {row['model']} {row['predicted']:.5g}, {effect(row)}, "
        f"margin ±{100 * row['margin']:g} %"
    )


def finding(scene: Row, row: Row) -> str:
    """What a user BRDF's comparison says beside the theory's; empty without a user BRDF."""
    for other in (scene.get("user_brdf") or {}).get("beside_theory", []):
        if all(other[key] == row[key] for key in ("quantity", "theta_i", "phi_i", "kd")):
            return f"{100 * other['effect']:+.2f} % from {other['model']}: {other['finding']}"
    return ""


def moved(row: Row) -> str:
    """Say how a figure moved against the baseline."""
    beyond = "" if row["z"] is None else f", z = {row['z']:+.1f}, p = {row['p_holm']:.1e} (Holm)"
    return f"{row['figure']} {row['old']:.5g} → {row['new']:.5g}{beyond}"


def invariants(scene: Row) -> Iterator[tuple[str, str]]:
    """Name of each invariant of a scene and what is broken about it, empty if it holds.

    What is wrong with a user BRDF follows.
    """
    texts = iter(scene["broken"])
    for row in scene["invariants"]:
        yield row["name"], "" if row["holds"] else next(texts)
    for number, text in enumerate(texts, 1):
        yield f"user BRDF {number}", text


def suites(document: Row) -> list[Row]:
    """Scenes, and as one more what must hold whatever the scene, if it was looked at."""
    lasting = {
        "name": "invariants",
        "comparisons": [],
        "invariants": document["invariants"],
        "broken": document["broken"],
        "user_brdf": None,
        "seconds": 0.0,
    }
    return [*document["scenes"], *([lasting] if document["invariants"] else [])]


def unexpected(document: Row) -> list[str]:
    """One line for each verdict that was not expected and each broken invariant."""
    lines = []
    for scene in suites(document):
        for row in scene["comparisons"]:
            if row["unexpected"]:
                more = finding(scene, row)
                text = f"{scene['name']}: {place(row)}: {verdict(row)}"
                lines.append(f"{text}; user BRDF {more}" if more else text)
        lines += [f"{scene['name']}: {text}" for _, text in invariants(scene) if text]
    return lines


def movements(document: Row) -> list[str]:
    """One line for each figure that moved, verdict that changed, scene that came or went."""
    baseline = document["baseline"]
    if baseline is None:
        return []
    return [
        (
            f"against {baseline['file']}: {len(baseline['moved'])} of {baseline['figures']} "
            f"figures moved beyond their error, {len(baseline['verdicts'])} verdicts changed"
        ),
        *(f"moved: {row['scene']}: {place(row)}: {moved(row)}" for row in baseline["moved"]),
        *(
            f"changed: {row['scene']}: {place(row)}: {row['old']} → {row['new']}"
            for row in baseline["verdicts"]
        ),
        *(f"{word}: {text}" for word in ("appeared", "vanished") for text in baseline[word]),
    ]
