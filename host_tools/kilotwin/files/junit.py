"""JUnit XML, as CI services read it: suites of cases, each passed or failed with a message."""

import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from kilotwin.errors import InputError, cause_of

# Characters that XML 1.0 cannot hold at all.
_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


@dataclass(frozen=True)
class Case:
    """`failure`: a line that says what is wrong, "" if it passed; `detail` stands below it."""

    name: str
    failure: str = ""
    detail: str = ""
    file: str = ""
    line: int | None = None


@dataclass(frozen=True)
class Suite:
    """Cases that took `time_s` together."""

    name: str
    cases: Sequence[Case]
    time_s: float = 0.0


def write_junit(file: Path, suites: Sequence[Suite]) -> None:
    """Writes the file; InputError if it cannot be written."""
    root = ET.Element("testsuites", name="kilotwin")
    for suite in suites:
        failures = sum(bool(case.failure) for case in suite.cases)
        node = ET.SubElement(
            root,
            "testsuite",
            name=_plain(suite.name),
            tests=str(len(suite.cases)),
            failures=str(failures),
            errors="0",
            time=f"{suite.time_s:.3f}",
        )
        for case in suite.cases:
            each = suite.time_s / len(suite.cases)
            about = {"classname": _plain(suite.name), "name": _plain(case.name)}
            if case.file:
                about["file"] = _plain(case.file)
            if case.line is not None:
                about["line"] = str(case.line)
            made = ET.SubElement(node, "testcase", {**about, "time": f"{each:.3f}"})
            if case.failure:
                failure = ET.SubElement(made, "failure", message=_plain(case.failure))
                failure.text = _plain(case.detail or case.failure)
    ET.indent(root)
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        ET.ElementTree(root).write(file, encoding="utf-8", xml_declaration=True)
    except OSError as error:
        raise InputError(f"--junit {file}: {cause_of(error)}; name another file") from None


def _plain(text: str) -> str:
    return _NOT_XML.sub("?", text)
