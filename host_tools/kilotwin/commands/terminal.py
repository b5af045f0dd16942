"""Progress of runs and sweeps on stderr, their summaries and errors as text."""

import shlex
import sys
import time
from collections.abc import Callable
from pathlib import Path
from textwrap import shorten
from typing import TYPE_CHECKING, Any

import typer

from kilotwin.experiment.experiment import Experiment
from kilotwin.runs.causes import causes, listed
from kilotwin.runs.folder import PRINTS
from kilotwin.session.display import NO_VALUES, Display, Silent, Values
from kilotwin.units import counted, duration_text, seconds

if TYPE_CHECKING:
    from kilotwin.commands.bars import SweepBar

_LINE_EVERY_S = 10.0
_LISTED = 20
_STATES = 6
_DARK = "RGB(0,0,0)"
_PRINT_WIDTH = 60


def simulated(done_s: float, wall_s: float, duration_s: float) -> str:
    """How far a run is: `600 of 1,000 s in 2 s, 300 x real time`."""
    far = f"{done_s:,.0f} of {duration_s:,.0f} s in {wall_s:.0f} s"
    return f"{far}, {done_s / wall_s:,.0f} x real time"


def recorded(done_s: float, wall_s: float, duration_s: float) -> str:
    """How far a record of a table is, whose time is the wall's: `60 of 100 s recorded`."""
    return f"{done_s:,.0f} of {duration_s:,.0f} s recorded"


HowFar = Callable[[float, float, float], str]
"""Text of a progress line, by seconds done, wall time, and seconds in all."""


class Lines:
    """A plain line every ten seconds, for logs."""

    def __init__(self, how_far: HowFar = simulated) -> None:
        self._how_far = how_far
        self._began = self._shown = time.monotonic()
        self._duration_s = 0.0

    def note(self, text: str) -> None:
        """One line."""
        typer.echo(text, err=True)

    warn = note

    def start(self, experiment: Experiment, folder: Path) -> None:
        """Starts the clock."""
        self._began = self._shown = time.monotonic()
        self._duration_s = experiment.keys.duration_s

    def progress(
        self, tick: int, resting: dict[str, int], not_resting: int, metrics: Values = NO_VALUES
    ) -> None:
        """A line if it is time for one."""
        now = time.monotonic()
        if now - self._shown < _LINE_EVERY_S:
            return
        self._shown = now
        robots = robots_now(resting, not_resting, metrics)
        wall_s, done_s = now - self._began, seconds(tick)
        left_s = wall_s * (self._duration_s - done_s) / done_s if done_s > 0 else 0.0
        far = f"{self._how_far(done_s, wall_s, self._duration_s)}, {left_s:.0f} s left"
        self.note(f"{far}; {robots}" if robots else far)

    def stop(self) -> None:
        """Nothing to tidy up."""


def display(quiet: bool, how_far: HowFar = simulated) -> Display:
    """A live bar on a terminal, a line now and then elsewhere, nothing if `quiet`."""
    if quiet:
        return Silent()
    if not sys.stderr.isatty():
        return Lines(how_far)
    from kilotwin.commands.bars import Bar

    return Bar(how_far)


class SweepLines:
    """Plain lines about a sweep: every ten seconds, and when a trial fails."""

    def __init__(self) -> None:
        self._shown = time.monotonic()
        self._trials = self._failed = 0

    def note(self, text: str) -> None:
        """One line."""
        typer.echo(text, err=True)

    def start(self, trials: int, done: int) -> None:
        """Nothing yet."""
        self._trials = trials

    def progress(self, done: int, failed: int, left_s: float, last: str) -> None:
        """A line if it is time for one, or for bad news."""
        now = time.monotonic()
        if now - self._shown < _LINE_EVERY_S and failed == self._failed:
            return
        self._shown, self._failed = now, failed
        self.note(sweep_now(done, self._trials, failed, left_s) + f"; last: {last}")

    def stop(self) -> None:
        """Nothing to tidy up."""


class SweepSilent(SweepLines):
    """Shows nothing."""

    def note(self, text: str) -> None:
        """Nothing."""


def sweep_display(quiet: bool) -> "SweepLines | SweepBar":
    """A live bar on a terminal, a line now and then elsewhere, nothing if `quiet`."""
    if quiet:
        return SweepSilent()
    if not sys.stderr.isatty():
        return SweepLines()
    from kilotwin.commands.bars import SweepBar

    return SweepBar()


def sweep_done(done: int, trials: int) -> str:
    """`trials` is 0 where only a time ends them."""
    return f"{done} of {trials} trials" if trials else f"{done} trials"


def sweep_now(done: int, trials: int, failed: int, left_s: float) -> str:
    bad = f", {failed} failed" if failed else ""
    return f"{sweep_done(done, trials)}{bad}, {duration_text(left_s)} left"


def robots_now(resting: dict[str, int], not_resting: int, metrics: Values = NO_VALUES) -> str:
    """`black 52, white 44, not resting 4, spread 0.21`."""
    sites = [f"{name} {count}" for name, count in resting.items()]
    robots = [f"not resting {not_resting}"] if sites else []
    values = [f"{name} {value:.4g}" for name, value in metrics.items() if value is not None]
    return ", ".join([*sites, *robots, *values])


def summary_text(summary: dict[str, Any]) -> str:
    """The end of `kilotwin run` in a few lines."""
    lines = [
        f"{summary['experiment']}, seed {summary['seed']}: "
        f"{summary['simulated_s']:,.0f} s simulated in {summary['wall_s']:.1f} s "
        f"({summary['robot_s_per_cpu_s']:,} robot-seconds per CPU-second)"
    ]
    rows = [("robots", _states_text(summary["states"])), *_resting_rows(summary)]
    rows += _failed_rows(summary)
    rows += _fault_rows(summary)
    rows += _metric_rows(summary)
    rows += _print_rows(summary)
    rows += _environment_rows(summary)
    rows += _report_rows(summary)
    if "coverage" in summary:
        rows.append(("coverage", summary["coverage"]["text"]))
    rows.append(("result hash", summary["result_hash"]))
    rows.append(("run folder", shown_path(Path(summary["run_folder"]))))
    width = max(len(label) for label, _ in rows)
    lines += [f"  {label:<{width}}  {value}" for label, value in rows]
    if "coverage" in summary:
        lines.append(coverage_text(summary["coverage"]))
    return "\n".join(lines)


def _states_text(states: dict[str, int]) -> str:
    """`6 RGB(0,3,0), 4 RGB(3,0,0)`, the most first."""
    most = sorted(states.items(), key=lambda state: -state[1])
    shown = [f"{count} {'off' if name == _DARK else name}" for name, count in most[:_STATES]]
    left = sum(count for _, count in most[_STATES:])
    return ", ".join([*shown, *([f"{left} others"] if left else [])])


def _resting_rows(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """Robots at rest on each site, and elsewhere; none without sites."""
    rows = []
    for name, count in summary["resting"].items():
        informed = summary["informed"].get(name, 0)
        note = f"   ({informed} robots are informed for it)" if informed else ""
        rows.append((f"resting on {name}", f"{count:5d}{note}"))
    return [*rows, ("not resting", f"{summary['not_resting']:5d}")] if rows else []


def _failed_rows(summary: dict[str, Any]) -> list[tuple[str, str]]:
    failed = {event["robot"] for event in summary["robots_failed"]}
    return [("failed", f"{len(failed)} of {summary['robots']} robots: see below")] if failed else []


def _fault_rows(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """Robots that failed because [[faults.robot]] says so: `2 dead, 1 stuck`."""
    faults = summary.get("faults", {})
    told = ", ".join(f"{number} {kind}" for kind, number in sorted(faults.items()))
    return [("faults of robots", told)] if told else []


def _print_rows(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """How many prints there were, the last one, and where they are."""
    prints = summary.get("prints", {})
    if not prints.get("number"):
        return []
    last = shorten(prints["last"]["text"], _PRINT_WIDTH, placeholder=" ...")
    folder = shown_path(Path(summary["run_folder"]) / PRINTS)
    return [("prints", f'{counted(prints["number"], "line")}, the last "{last}": {folder}/')]


def next_text(summary: dict[str, Any], *, seen: bool) -> str:
    """A line that says what to type next; `seen`: the run has been in the browser."""
    folder = shlex.quote(shown_path(Path(summary["run_folder"])))
    if summary["robots_failed"]:
        return f"to see where robots failed, type: kilotwin view {folder}"
    if seen:
        return f"to have it as a video, type: kilotwin plot video {folder} -o run.gif"
    return f"to see it, type: kilotwin view {folder}"


def coverage_text(told: dict[str, Any]) -> str:
    """A row for each file, and where the report is."""
    return f"{told['files']}\n  {told['folder']}/index.html"


def _metric_rows(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """Metrics at the end, with their units."""
    rows = []
    for name, measured in summary.get("metrics", {}).items():
        value = measured["value"]
        shown = "no value" if value is None else f"{value:.5g} {measured['unit']}".rstrip()
        if name in summary.get("metrics_failed", {}):
            shown = "failed"
        rows.append((name, f"{shown:>5}"))
    return rows


def _environment_rows(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """Words that an environment has told robots, if there is one, and how late."""
    told = summary.get("environment")
    if told is None:
        return []
    rows = [("words sent", f"{told['sent']:,} of {told['asked']:,}, {told['replaced']:,} replaced")]
    if uncovered := told.get("uncovered"):
        rows.append(("not covered", f"{uncovered:,} words: their robots are below no controller"))
    if late := told["latency_s"]:
        rows.append(("latency", f"{late['mean']:.2f} s, 95 % within {late['p95']:.2f} s"))
    if told.get("heard") is not None:
        rows.append(("frames heard", f"{100 * told['heard']:.1f} %"))
    return rows


def _report_rows(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """How many reports of robots the host of a grid got."""
    if "grid" not in summary:
        return []
    reports = summary["grid"]["reports"]
    none = "none: robots report by kilob_tracking(), or a message of type TRACKING"
    return [("reports of robots", f"{reports:5,d}" if reports else none)]


def environment_record_text(summary: dict[str, Any]) -> str:
    """The end of `kilotwin record --via` in a few lines."""
    poses = summary["poses"]
    seen = summary["robots"] - len(poses["never_seen"])
    lines = [
        f"{summary['experiment']}: {summary['recorded_s']:,.0f} s recorded, "
        f"{seen} of {summary['robots']} robots seen"
    ]
    rows = [("lines of poses", f"{poses['lines']:,}, {poses['bad_lines']:,} of no use")]
    rows += _environment_rows(summary)
    if poses["never_seen"]:
        uids = ", ".join(map(str, poses["never_seen"][:_LISTED]))
        rows.append(("never seen", f"{uids}{' ...' * (len(poses['never_seen']) > _LISTED)}"))
    rows.append(("run folder", shown_path(Path(summary["run_folder"]))))
    width = max(len(label) for label, _ in rows)
    return "\n".join([*lines, *(f"  {label:<{width}}  {value}" for label, value in rows)])


def record_text(summary: dict[str, Any]) -> str:
    """The end of `kilotwin record` in a few lines."""
    grid = summary["grid"]
    lines = [
        f"{summary['experiment']}: {summary['recorded_s']:,.0f} s recorded, "
        f"{grid['reports']:,} reports of {summary['robots']} robots"
    ]
    rows = _resting_rows(summary)
    rows.append(("polls without answer", f"{grid['polls_missed']:5d} of {grid['polls']:,}"))
    rows.append(("run folder", shown_path(Path(summary["run_folder"]))))
    rows.append(("reports as .kilodat", shown_path(Path(grid["kilodat"]))))
    width = max(len(label) for label, _ in rows)
    lines += [f"  {label:<{width}}  {value}" for label, value in rows]
    return "\n".join(lines)


def bus_troubles_text(grid: dict[str, Any]) -> str:
    """A line per bus that was down at the end, and what to do if robots may drive on."""
    lines = [f"{bus['name']} is down: {bus['what']}" for bus in grid["buses_down"]]
    if left := grid["not_idle"]:
        buses = " ".join(f"--can {name}" for name in grid["buses"])
        lines.append(
            f"ROBOTS MAY BE DRIVING ON: those of {', '.join(left)} could not be told to stop. "
            f"Switch the table off; or see to the bus, then type: kilotwin grid idle {buses} "
            f"--size {grid['size']}"
        )
    return "\n".join(lines)


def module_troubles_text(failed: list[dict[str, Any]]) -> str:
    """A line per cause that modules failed for; mostly empty."""
    lines = [f"{counted(len(failed), 'module')} failed:"] if failed else []
    found: dict[str, list[str]] = {}
    for module in failed:
        found.setdefault(module["what"], []).append("-".join(map(str, module["module"])))
    lines += [f"{what}: {listed('module', whose)}" for what, whose in found.items()]
    return "\n".join(_few(lines, "manifest.json"))


def _undefined_row(cause: dict[str, Any], kind: str) -> str:
    """`undefined behaviour at walk.c:42 in loop(): ...: robot 3 and 4 more (walk), from tick 9`.

    `kind`: "robot" or "module".
    """
    more = f" and {cause[f'{kind}s'] - 1} more" if cause[f"{kind}s"] > 1 else ""
    who = f"{kind} {cause[f'first_{kind}']}{more}"
    return f"{cause['what']}: {who} ({cause['program']}), from tick {cause['first_tick']}"


def _few(lines: list[str], file: str) -> list[str]:
    """A heading and its first rows; where the rest is."""
    left = len(lines) - 1 - _LISTED
    return lines if left <= 0 else [*lines[:-left], f"and {left} other causes; {file} has them all"]


def troubles_text(summary: dict[str, Any]) -> str:
    """A line per cause that robots failed for, and a word on busy-waits; mostly empty."""
    failed = summary["robots_failed"]
    busy = summary["events"].get("busy_wait", 0)
    spoiled = [f"metric {name}: {why}" for name, why in summary.get("metrics_failed", {}).items()]
    lines = [f"{counted(len(failed), 'robot')} failed:"] if failed else []
    lines = _few([*lines, *(cause.text("robot") for cause in causes(failed))], "events.jsonl")
    if modules := module_troubles_text(summary.get("grid", {}).get("modules_failed", [])):
        lines.append(modules)
    grid = summary.get("grid", {})
    lines += [_undefined_row(one, "robot") for one in summary.get("undefined", [])]
    lines += [_undefined_row(one, "module") for one in grid.get("undefined", [])]
    lines += spoiled
    if busy:
        lines.append(f"{counted(busy, 'warning')} of busy-waiting: see events.jsonl")
    notes = summary["events"].get("note", 0)
    if notes:
        lines.append(f"{counted(notes, 'note')} on what programs do: see events.jsonl")
    lines += summary.get("notes", [])
    return "\n".join(lines)


def shown_path(path: Path) -> str:
    """Relative to the current folder where that is shorter."""
    here = Path.cwd()
    return str(path.relative_to(here) if path.is_relative_to(here) else path)
