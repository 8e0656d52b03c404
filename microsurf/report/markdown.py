"""report.md: what a pull request should show, the unexpected first, never longer than it takes."""

import re
from collections.abc import Iterable, Sequence
from typing import Any
from urllib.parse import quote

from . import phrases

Row = dict[str, Any]

LONGEST = 60_000
"""Characters; a comment on GitHub takes 65 536."""
_CELL = 400
_LEGEND = (
    "Effects are measured / predicted − 1 with 95 % intervals. *holds*: all of the interval "
    "lies within the margin; *departs*: all of it outside. Departing is no error unless the "
    "scene expects otherwise."
)
_LINES = {"unexpected": 60, "notes": 20, "moved": 40, "user_brdf": 40, "scenes": 100}
"""Rows of each table, so that the longest possible is below LONGEST."""


def to_markdown(document: Row) -> str:
    """Write the document of report.json as GitHub's Markdown, at most LONGEST characters."""
    scenes = phrases.suites(document)
    rows = [row for scene in scenes for row in scene["comparisons"]]
    count = sum(row["unexpected"] for row in rows) + sum(len(s["broken"]) for s in scenes)
    head = f"{count} unexpected" if count else "as expected"
    parts = [
        f"## microsurf: {head}",
        (
            f"{_many(len(rows), 'verdict')} on {_many(len(document['scenes']), 'scene')}: "
            f"{_counts(rows)}. "
            f"microsurf {_escaped(document['microsurf'])}, seed {document['seed']}. "
            "Figures and intervals: [report.html](report.html)."
        ),
        _unexpected(scenes),
        _notes(scenes),
        _moved(document.get("baseline")),
        _user_brdf(scenes),
        _scenes(scenes),
        _LEGEND,
    ]
    text = "\n\n".join(part for part in parts if part) + "\n"
    if len(text) > LONGEST:  # texts full of what must be escaped
        text = text[: LONGEST - 50].rpartition("\n")[0] + "\n\n… cut; see report.html\n"
    return text


def _unexpected(scenes: list[Row]) -> str:
    most = _LINES["unexpected"]
    bad = [(scene, row) for scene in scenes for row in scene["comparisons"] if row["unexpected"]]
    verdicts = [
        (
            _link(scene),
            phrases.place(row),
            f"**{row['verdict']}**, expected {_escaped(row['expected'].replace('|', ' or '))}",
            phrases.effect(row),
            f"±{100 * row['margin']:g} %",
            _escaped(phrases.finding(scene, row) or row["why"]),
        )
        for scene, row in bad[:most]
    ]
    texts = [(s, text) for s in scenes for _, text in phrases.invariants(s) if text]
    broken = [f"- {_link(s)}: **broken** – {_escaped(text)}" for s, text in texts[:most]]
    columns = ("scene", "quantity", "verdict", "effect", "margin", "why")
    parts = [_table(columns, verdicts, len(bad)), _list(broken, len(texts))]
    return "\n\n".join(part for part in parts if part)


def _notes(scenes: list[Row]) -> str:
    """What is to be known of the scenes' files."""
    lines = [f"- {_link(s)}: {_escaped(text)}" for s in scenes for text in s.get("notes", ())]
    return _list(lines[: _LINES["notes"]], len(lines))


def _moved(baseline: Row | None) -> str:
    if baseline is None:
        return ""
    table = [
        (_escaped(row["scene"]), phrases.place(row), phrases.moved(row), _percent(row))
        for row in baseline["moved"][: _LINES["moved"]]
    ]
    changed = [
        f"{row['scene']}: {phrases.place(row)}: {row['old']} → {row['new']}"
        for row in baseline["verdicts"]
    ]
    changed += [f"{word}: {text}" for word in ("appeared", "vanished") for text in baseline[word]]
    lines = [f"- {_escaped(text)}" for text in changed[: _LINES["moved"]]]
    parts = [
        f"### Against {_escaped(baseline['file'])}",
        (
            f"{len(baseline['moved'])} of {baseline['figures']} figures moved beyond their error "
            f"(family-wise level {baseline['level']:g}), "
            f"{_many(len(baseline['verdicts']), 'verdict')} changed."
        ),
        _table(("scene", "quantity", "figure", "by"), table, len(baseline["moved"])),
        _list(lines, len(changed)),
    ]
    return "\n\n".join(part for part in parts if part)


def _percent(row: Row) -> str:
    return f"{100 * row['difference'] / row['old']:+.2f} %" if row["old"] else "–"


def _user_brdf(scenes: list[Row]) -> str:
    """The user BRDF against the theory: nothing without one."""
    tried = [(s, row) for s in scenes if s["user_brdf"] for row in s["user_brdf"]["beside_theory"]]
    if not tried:
        return ""
    table = [
        (
            _link(scene),
            phrases.place(row),
            f"{row['user_brdf']:.5g}",
            f"{row['theory']:.5g}",
            f"{100 * row['effect']:+.2f} % ({100 * row['low']:+.2f} … {100 * row['high']:+.2f})",
            f"{row['user_brdf_verdict']} / {row['theory_verdict']}",
            _escaped(row["finding"]),
        )
        for scene, row in tried[: _LINES["user_brdf"]]
    ]
    name = tried[0][0]["user_brdf"]["name"]
    columns = (
        "scene", "quantity", "user BRDF", "theory", "user BRDF / theory − 1",
        "verdicts: user BRDF / theory", "finding",
    )  # fmt: skip
    return f"### {_escaped(name)} against the theory\n\n" + _table(columns, table, len(tried))


def _scenes(scenes: list[Row]) -> str:
    table = []
    # What is unexpected first, then in the order of the scenes.
    for scene in sorted(scenes, key=lambda s: not _bad(s))[: _LINES["scenes"]]:
        rows = scene["comparisons"]
        largest = max(rows, key=lambda row: abs(row["effect"]), default=None)
        table.append(
            (
                ("✗ " if _bad(scene) else "✓ ") + _link(scene),
                _counts(rows),
                "–" if largest is None else f"{phrases.effect(largest)}: {phrases.place(largest)}",
                f"{scene['seconds']:.0f} s",
            )
        )
    columns = ("scene", "verdicts", "largest effect", "time")
    return "### Scenes\n\n" + _table(columns, table, len(scenes))


def _bad(scene: Row) -> bool:
    return bool(scene["broken"]) or any(row["unexpected"] for row in scene["comparisons"])


def _counts(rows: list[Row]) -> str:
    words: dict[str, int] = {}
    for row in rows:
        words[row["verdict"]] = words.get(row["verdict"], 0) + 1
    return ", ".join(f"{count} {word}" for word, count in words.items()) or "none"


def _many(count: int, noun: str) -> str:
    return f"{count} {noun}{'' if count == 1 else 's'}"


def _link(scene: Row) -> str:
    return f"[{_escaped(scene['name'])}](report.html#{quote(scene['name'][:_CELL])})"


def _table(columns: Iterable[str], rows: Sequence[tuple[str, ...]], total: int) -> str:
    """Rows as they are; ``total`` is how many there would have been."""
    if not rows:
        return ""
    names = list(columns)
    lines = [names, ["---"] * len(names), *rows]
    return _shortened([f"| {' | '.join(line)} |" for line in lines], total - len(rows))


def _list(lines: list[str], total: int) -> str:
    return _shortened(lines, total - len(lines))


def _shortened(lines: list[str], left: int) -> str:
    more = [f"\n… and {left} more in report.html"] if left > 0 else []
    return "\n".join([*lines, *more])


_SPECIAL = re.compile(r"([\\`*_{}\[\]()|~$^])")


def _escaped(text: str) -> str:
    """Text that is text in Markdown: no markup, no tag, no link, no mention, one line."""
    plain = "".join(c if c.isprintable() else " " for c in text[:_CELL])
    if len(text) > _CELL:
        plain += " …"
    plain = plain.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    plain = _SPECIAL.sub(r"\\\1", plain)
    # GitHub makes links of these after the Markdown is done: a space of no width parts them.
    return re.sub(r"(?<=@)|(?=://)|(?<=www)(?=\.)", "\u200b", plain)
