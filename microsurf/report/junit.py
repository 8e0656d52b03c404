"""junit.xml: a suite for each scene, a case for each verdict and invariant.

The dialect that CI servers share (Jenkins' xunit schema): ``testsuites`` with ``tests``,
``failures``, ``errors`` and ``time`` in seconds, the same and ``skipped`` on each suite.
"""

import re
import xml.etree.ElementTree as ET
from typing import Any

from . import phrases

# All that XML 1.0 has a place for; half a surrogate pair is not.
_NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def to_junit(document: dict[str, Any]) -> str:
    """Write the document of report.json as JUnit's XML; unexpected is a failure."""
    root = ET.Element("testsuites", name="microsurf")
    for scene in phrases.suites(document):
        suite = ET.SubElement(root, "testsuite", name=_text(scene["name"]))
        cases = [
            (phrases.place(row), _failure(scene, row) if row["unexpected"] else "")
            for row in scene["comparisons"]
        ]
        for name, failure in [*cases, *phrases.invariants(scene)]:
            case = ET.SubElement(
                suite,
                "testcase",
                classname=_text(f"microsurf.{scene['name']}"),
                name=_text(name),
                time="0",
            )
            if failure:
                element = ET.SubElement(case, "failure", message=_text(failure), type="unexpected")
                element.text = _text(failure)
        _count(suite, scene["seconds"])
        suite.set("skipped", "0")
    _count(root, sum(scene["seconds"] for scene in document["scenes"]))
    ET.indent(root)
    text = ET.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="utf-8"?>\n{text}\n'


def _failure(scene: dict[str, Any], row: dict[str, Any]) -> str:
    more = phrases.finding(scene, row)
    return "; ".join(part for part in (phrases.verdict(row), more, row["why"]) if part)


def _count(element: ET.Element, seconds: float) -> None:
    element.set("tests", str(len(list(element.iter("testcase")))))
    element.set("failures", str(len(list(element.iter("failure")))))
    element.set("errors", "0")
    element.set("time", f"{seconds:.3f}")


def _text(value: str) -> str:
    return _NO_XML.sub("", value)
