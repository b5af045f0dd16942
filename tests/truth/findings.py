"""Findings on the claims of a paper: each claim has lines of evidence, and a verdict by them.

A claim that a sweep has not the trials for is left open.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

HOLDS, MISSED, OPEN = "holds", "missed", "open"


@dataclass(frozen=True)
class Finding:
    """One line of evidence for a claim."""

    claim: str
    about: str
    number: str
    verdict: str


Findings = list[Finding]


def verdicts(findings: Iterable[Finding]) -> dict[str, str]:
    """By claim: missed if one of its findings is, open if one is missing, else holds."""
    found: dict[str, list[str]] = {}
    for finding in findings:
        found.setdefault(finding.claim, []).append(finding.verdict)
    return {
        claim: next((verdict for verdict in (MISSED, OPEN) if verdict in several), HOLDS)
        for claim, several in found.items()
    }


def as_dict(readings: Mapping[str, Findings]) -> dict[str, Any]:
    """The --json object: verdicts and findings of one reading, or of several by reading."""
    several = {
        reading: {
            "verdicts": verdicts(findings),
            "findings": [vars(finding) for finding in findings],
        }
        for reading, findings in readings.items()
    }
    return {"readings": several} if len(several) > 1 else next(iter(several.values()))


def report_text(readings: Mapping[str, Findings]) -> str:
    """A table in Markdown, and a line per claim; of several readings a line each."""
    if len(readings) > 1:
        return _readings_text(readings)
    (findings,) = readings.values()
    lines = ["| claim | about | here [95 % interval] | verdict |", "|---|---|---|---|"]
    lines += [f"| ({f.claim}) | {f.about} | {f.number} | {f.verdict} |" for f in findings]
    return "\n".join([*lines, "", _summary(findings)])


def _readings_text(readings: Mapping[str, Findings]) -> str:
    """Only what there are trials for; what misses stands in bold."""
    columns = list(
        dict.fromkeys(
            (finding.claim, finding.about)
            for findings in readings.values()
            for finding in findings
            if finding.verdict != OPEN
        )
    )
    numbers = [f"({claim}) {count}" for count, (claim, _) in enumerate(columns, 1)]
    lines = [f"| reading | {' | '.join(numbers)} | verdicts |", "|---" * (len(columns) + 2) + "|"]
    for reading, findings in readings.items():
        found = {(finding.claim, finding.about): finding for finding in findings}
        cells = [_cell(found.get(column)) for column in columns]
        lines.append(f"| {reading} | {' | '.join(cells)} | {_summary(findings)} |")
    about = [f"{n}: {text}" for n, (_, text) in zip(numbers, columns, strict=True)]
    return "\n".join([*lines, "", *about, "", "Bold: missed."])


def _cell(finding: Finding | None) -> str:
    if finding is None:
        return "no trials"
    return f"**{finding.number}**" if finding.verdict == MISSED else finding.number


def _summary(findings: Iterable[Finding]) -> str:
    return ", ".join(f"({claim}) {verdict}" for claim, verdict in verdicts(findings).items())


def verdict(holds: bool) -> str:
    """The verdict of a line of evidence that decides."""
    return HOLDS if holds else MISSED


def left_open(claim: str, about: str, number: str = "no trials") -> Finding:
    """A line of evidence that decides nothing."""
    return Finding(claim, about, number, OPEN)
