"""Further sections of a report: budgets, invariants, what effects cost, the family of verdicts."""

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

from ..analysis import multiplicity
from ..analysis.error_budget import assemble
from ..analysis.error_budget.terms import TERMS
from ..analysis.self_test import SelfTest
from ..analysis.tradeoff.study import Tradeoff
from ..analysis.validation import Validation
from ..invariants import Invariant
from . import layers_section, stability_section
from .figures import error_budget, masking, pareto, pareto_all, user_brdf
from .figures.figure import Picture
from .section import Section, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_BUDGET = """Measured − predicted, split by substituting one thing after the other: the model's own
facets and masking by Smith's theory; STD by the slopes the surfaces have; what a finer mesh would
change; light lost; the masking of the real structure in place of Smith's, and what that makes of
later orders;
multiple scattering of the real structure{layers}. Terms add up to the difference (diamonds).
Whiskers and intervals are of 95 %. {refined}"""
_REFINED = """Mesh: the same relief on this mesh and on one twice as fine. Tile: what surfaces of
half the side differ by at the most, a bound that the other intervals do not hold."""
_IL = "; both layers in the place of IL facets, on the same interfaces (the IL assumption)"
_COARSE = "Mesh and tile were not measured (--no-refine): what they leave is in the other terms."
_CAPTION = (
    "Where the difference comes from, Kd = {kd:g}{phi}. Bars: terms; diamonds: what they add up "
    "to, with the noise of rays and surfaces. Not drawn: {hidden}."
)
_MASKING = (
    "Masking (G1) and masking with shadowing of mirror pairs (G2, 0 below the horizon) of the "
    "mesh's own facets, by slope: measured by shadow rays with 95 % intervals over surfaces "
    "(symbols), and by Smith's theory in the same bins (lines). Differences of opposite sign "
    "cancel in albedos."
)
_EXACT = 1e-6
"""Errors of rounding are not distinguished."""
_FRONTIER = """What each model costs on this scene and how far it is off, against what was
measured above ({reference}; that is uncertain by at most {known}, which is in every interval).
Explicit surfaces are not among them: they would share their realisations with the reference.
`microsurf tradeoff` runs them too, against a finer mesh."""
_FRONTIER_CAPTION = (
    "Error against processor time of an angle; the worst angle and Kd count, with the model's own "
    "noise. Bars: 95 %. Filled: the frontier; hollow: another is cheaper and better beyond doubt. "
    "Errors below 0.01 % and above 200 % are drawn there. "
    "Models only, no explicit surfaces: `microsurf tradeoff` has both."
)
_OVER_ALL = """Models on the {scenes} rough scenes of this report, each against its own measurement:
median and middle half over scenes. Cost is in that of the scene's cheapest model."""
_OVER_ALL_CAPTION = (
    "Error against relative cost of each model: medians over scenes (symbols), and the middle "
    "half of them (bars). Errors below 0.01 % and above 200 % are drawn there. Models only, no "
    "explicit surfaces: `microsurf tradeoff` has both."
)
_DARK = "This scene reflects no light: it has no verdicts, no lobes and no albedos."
_NO_FIGURE = "\n\nNo figure: there is no light to draw."
_INVARIANTS = """What must hold whatever the surface, each with its distance from holding and the
largest that is no fault. Those decided by chance alarm falsely in about one report of 10 000."""
_CHECKED = """Checked on {date} UTC with this version of microsurf on this kind of machine, and
remembered since: it depends on no scene. `microsurf validate --self-test` checks it now."""
_FAMILY = """The {comparisons} intervals are of 95 % each, not corrected for their number. A verdict
of holds or departs is wrong in {percent:g} % of cases at most: up to {wrong:.1f} of all, if every
truth lay at its margin (up to 4 % were measured for heavy tails on small tiles, where surfaces do
not differ normally: reports/calibration). {decided} are decided; {standing} of these stand also
if all intervals are widened so that 95 % of such reports hold no wrong one (Šidák 1967)."""


def of_scene(entry: Validation, slug: str) -> list[Section]:
    """Sections of one scene, whose pictures are called by its slug."""
    sections = (
        _dark(entry),
        _user_brdf(entry, slug),
        layers_section.section(entry),
        _budget(entry, slug),
        _masking(entry, slug),
        _frontier(entry, slug),
        _left_out(entry),
        _invariants(entry.invariants, "What must hold here"),
    )
    return [section for section in sections if section is not None]


def of_all(entries: Sequence[Validation], checked: SelfTest) -> list[Section]:
    """Sections of the whole report; ``checked`` is what microsurf itself came to, and when."""
    when = _CHECKED.format(date=checked.date)
    sections = [
        _multiplicity(entries),
        _frontiers(entries),
        _invariants(checked.invariants, "What must hold whatever the scene", when),
    ]
    if checked.stability is not None:
        sections.append(stability_section.section(checked.stability, when))
    return [section for section in sections if section is not None]


def _dark(entry: Validation) -> Section | None:
    material = entry.scene.material
    if any(entry.measured.microsurf.albedo_by_order(kd=kd).any() for kd in material.kd):
        return None
    return Section("dark", "Nothing to show", _DARK)


def _user_brdf(entry: Validation, slug: str) -> Section | None:
    if entry.user_brdf is None:
        return None
    rows = user_brdf.rows(entry)
    caption = "The user BRDF's lobes beside the theory's and the measured ones."
    pictures = _pictures(f"{slug}-user-brdf", lambda: user_brdf.figure(entry), caption, rows)
    columns = ("quantity", "theta_i", "kd", "user_brdf", "model", "theory", "effect", "finding")
    beside_theory = [
        {key: row[key] for key in columns} for row in entry.user_brdf.as_json()["beside_theory"]
    ]
    return Section(
        "user-brdf",
        f"The user BRDF {entry.user_brdf.name}",
        "The verdicts of this scene are the user BRDF's. Here it is beside our own theory, so that "
        "a fault of the user BRDF is distinguished from a limit of the theory."
        + ("" if pictures else _NO_FIGURE),
        (Table("User BRDF / theory − 1", beside_theory),),
        pictures,
    )


def _budget(entry: Validation, slug: str) -> Section | None:
    if not entry.budget:
        return None
    rows = assemble.rows(entry.budget)
    kd, phi = entry.scene.material.kd[0], entry.scene.light.phi[0]
    first = [row for row in rows if row["kd"] == kd and row["phi_i"] == phi]
    drawn = error_budget.drawn_terms(first)
    there = {row["term"] for row in rows}
    hidden = [t for t in ("model", "slopes", "mesh", "losses", "masking", "multiple",
                          "il_assumption")
              if t in there and t not in drawn]  # fmt: skip
    several = len(entry.scene.light.phi) > 1
    caption = _CAPTION.format(
        kd=kd,
        phi=f", φ_i = {phi:g}°" if several else "",
        hidden=f"{', '.join(hidden)} (below 0.02 % everywhere)" if hidden else "nothing",
    )
    picture = Picture(f"{slug}-budget", error_budget.figure(first), caption, rows)
    table = Table(
        f"Terms in % of the prediction ± half their 95 % interval, Kd = {kd:g}; lobes and other Kd "
        "stand in the figure's CSV; a term that is not there is 0",
        _table(first),
    )
    text = _BUDGET.format(
        refined=_REFINED if "mesh" in there else _COARSE,
        layers=_IL if "il_assumption" in there else "",
    )
    return Section(
        "budget", "Where each difference comes from", text, (table,), (picture,), ("heitz2016",)
    )


def _masking(entry: Validation, slug: str) -> Section | None:
    if not entry.masking:
        return None
    drawn = masking.rows(entry.masking, entry.measured.sizes["realisation"])
    picture = Picture(f"{slug}-masking", masking.figure(drawn), _MASKING, drawn)
    return Section("masking", "Masking by facet slope", "", (), (picture,), ("smith1967",))


def _frontier(entry: Validation, slug: str) -> Section | None:
    if entry.frontier is None:
        return None
    rows = _frontier_rows(entry.frontier)
    reference = entry.frontier.reference
    known = ", ".join(
        f"{100 * max(v, _EXACT):.2g} % ({name})" for name, v in reference.half_width.items()
    )
    text = _FRONTIER.format(reference=reference.text.removeprefix("reference: "), known=known)
    pictures = _pictures(f"{slug}-frontier", lambda: pareto.figure(rows), _FRONTIER_CAPTION, rows)
    text += "" if pictures else _NO_FIGURE
    return Section("frontier", "Speed against accuracy", text, (), pictures)


def _frontiers(entries: Sequence[Validation]) -> Section | None:
    tables = {e.name: _frontier_rows(e.frontier) for e in entries if e.frontier is not None}
    rows = pareto_all.medians(tables)
    scenes = max((row["scenes"] for row in rows), default=0)
    if scenes < 2:  # of one it says what stands at the scene
        return None
    text = _OVER_ALL.format(scenes=scenes)
    picture = Picture("frontiers", pareto_all.over_all(rows), _OVER_ALL_CAPTION, rows)
    return Section("frontiers", "Speed against accuracy", text, (), (picture,))


def _frontier_rows(tradeoff: Tradeoff) -> list[dict[str, Any]]:
    """Rows of `pareto.rows` without what a report does not measure."""
    left_out = ("seconds_evaluation", "bytes", "bytes_basis")
    return [
        {key: value for key, value in row.items() if key not in left_out}
        for row in pareto.rows(tradeoff)
    ]


def _pictures(
    name: str, draw: Callable[[], "Figure"], caption: str, rows: Sequence[dict[str, Any]]
) -> tuple[Picture, ...]:
    """A picture, or none if it would hold no number: the section's text and tables stay."""
    return (Picture(name, draw(), caption, rows),) if rows else ()


def _table(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """A line for each quantity (no lobes) and angle, a column for each term that is not 0."""
    lines: dict[tuple[Any, ...], dict[str, Any]] = {}
    ends = ("relative_low", "relative_high")
    loud = {row["term"] for row in rows if any(row[end] for end in ends)}
    for row in rows:
        if row["relative_value"] is None or row["quantity"].count(" ") > 1:
            continue
        key = row["quantity"], row["theta_i"]
        empty = {"quantity": key[0], "θ_i (°)": f"{key[1]:g}"}
        line = lines.setdefault(key, empty | {t: "" for t in TERMS if t in loud})
        if row["term"] not in loud:
            continue
        half = 50 * (row["relative_high"] - row["relative_low"])
        line[row["term"]] = f"{100 * row['relative_value']:+.2f} ± {half:.2f}".replace("-", "−")
    return list(lines.values())


def _left_out(entry: Validation) -> Section | None:
    if not entry.left_out:
        return None
    rows = [
        {
            "left out": row["effect"],
            "θ_i (°)": row["theta_i"],
            "Kd": row["kd"],
            "albedo without": row["without"],
            "with all": row["with_all"],
            "error (%)": 100 * row["error"],
            "from (%)": 100 * row["low"],
            "to (%)": 100 * row["high"],
        }
        for row in entry.left_out
    ]
    text = (
        "This scene leaves effects out on purpose. Measured on the same surfaces with all of them:"
    )
    return Section("left-out", "What leaving out costs", text, (Table("Total albedo", rows),))


def _invariants(invariants: Iterable[Invariant], title: str, when: str = "") -> Section | None:
    rows = [
        {
            "what": row.name,
            "statement": row.statement,
            "value": row.value,
            "tolerance": row.tolerance,
            "holds": bool(row.holds),
            "basis": row.basis,
        }
        for row in invariants
    ]
    if not rows:
        return None
    text = "\n\n".join(filter(None, (_INVARIANTS, when)))
    return Section("invariants", title, text, (Table("Invariants", rows, digits=2),))


def _multiplicity(entries: Sequence[Validation]) -> Section | None:
    comparisons = [row for entry in entries for row in entry.comparisons]
    if not comparisons:
        return None
    family = multiplicity.multiplicity_of(comparisons)
    text = _FAMILY.format(
        comparisons=family.comparisons,
        percent=100 * family.error_rate,
        decided=family.decided,
        wrong=family.expected_wrong,
        standing=family.standing,
    )
    return Section("family", "How many verdicts may be wrong", text)
