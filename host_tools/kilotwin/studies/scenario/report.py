"""Scenarios for people, for programs and for CI services."""

from collections.abc import Sequence
from typing import Any

from kilotwin.files.junit import Case, Suite
from kilotwin.studies.scenario.judge import ScenarioVerdict
from kilotwin.studies.scenario.runner import Scenario


def row(scenario: Scenario, width: int = 0) -> str:
    """A row of a scenario that is over; below it what was not met."""
    state = "ok  " if not scenario.failures else "FAIL"
    met = len(scenario.verdicts) - len(scenario.failures)
    runs = f"{len(scenario.tasks)} run{'s' if len(scenario.tasks) > 1 else ''}"
    text = f"{state}  {scenario.name:<{width}}  {met} of {len(scenario.verdicts)} met, {runs}"
    return "\n".join([text, *(f"      {verdict.line()}" for verdict in scenario.failures)])


def look_text(scenario: Scenario) -> str:
    """The commands that show a run that failed."""
    return f"      look at it: kilotwin view {scenario.folder}"


def summary_text(scenarios: Sequence[Scenario]) -> str:
    """The last line."""
    failed = sum(bool(scenario.failures) for scenario in scenarios)
    number = len(scenarios)
    what = f"{number} scenario{'s' if number != 1 else ''}"
    return f"{what}, all met" if not failed else f"{what}, {failed} failed"


def as_dict(scenario: Scenario) -> dict[str, Any]:
    """For --json."""
    return {
        "scenario": scenario.name,
        "passed": not scenario.failures,
        "timed_out": scenario.timed_out,
        "runs": len(scenario.tasks),
        "verdicts": [verdict.as_dict() for verdict in scenario.verdicts],
        "folder": None if scenario.folder is None else str(scenario.folder),
    }


def suite(scenario: Scenario) -> Suite:
    """For JUnit: a case for each expectation."""
    look = "" if scenario.folder is None else f"\nlook at it: kilotwin view {scenario.folder}"
    return Suite(
        scenario.name, [_case(verdict, look) for verdict in scenario.verdicts], scenario.took_s
    )


def _case(verdict: ScenarioVerdict, look: str) -> Case:
    file, _, line = verdict.where.rpartition(":")
    named = (file, int(line)) if line.isdigit() else (verdict.where, None)
    if verdict.passed:
        return Case(verdict.expected, file=named[0], line=named[1])
    placed = next((one for one in verdict.blamed if one.file), None)
    if placed is not None:
        named = (placed.file, placed.line)
    return Case(verdict.expected, verdict.said, verdict.line() + look, *named)
