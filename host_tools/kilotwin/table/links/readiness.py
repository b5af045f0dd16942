"""Judges, for an experiment, what a grid says of itself: ready, to be looked at, or not ready.

Pure: `preflight` asks, this reads the answers.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from enum import StrEnum

from kilotwin.experiment.spec.grid_layout import Layout, Module
from kilotwin.experiment.spec.kconf import Content
from kilotwin.files.headers import ALL_ROBOTS
from kilotwin.table.can.protocol import BusHealth, Health, ModuleState
from kilotwin.table.grid.health_text import MANY_ERRORS
from kilotwin.table.grid.in_turn import is_held
from kilotwin.table.links.robot_link import Report
from kilotwin.table.links.roll_call import WITHOUT_UID, colour_of, volts

MODULES = "modules"
"""The line with the modules that answer."""

# More names than this do not help to read a line; --json has all.
_MOST_NAMES = 8
_AT_REST = {ModuleState.INIT, ModuleState.IDLE, ModuleState.SETUP}
_WRITES = {ModuleState.WAITING_FOR_BOOTPAGE, ModuleState.BOOTLOADING_KILOBOTS}


class GridVerdict(StrEnum):
    """Consequence of a finding for an experiment that is to begin."""

    READY = "ready"
    LOOK = "look"
    """It can begin, but may not be what is wanted; or it is not known."""
    NOT_READY = "not ready"


class NotAsked(StrEnum):
    """Why robots were not asked; for people."""

    UNWANTED = ""
    BUS_DOWN = "not asked, since a bus is down"
    NO_MODULE = "not known: only modules with Kilotwin's firmware ask robots"
    RUNNING = "not known: modules run, and ask no robots meanwhile"


@dataclass(frozen=True)
class Seen:
    """Answers of a grid. Modules on a bus that is down are among the silent ones."""

    layout: Layout
    names: Sequence[str]
    """The buses' names, as the user gave them."""
    down: Mapping[int, str]
    silent: Sequence[Module]
    health: Mapping[Module, Health]
    bus_health: Mapping[Module, BusHealth]
    robots: Mapping[int, Report] | NotAsked


@dataclass(frozen=True)
class Wanted:
    """Needs of an experiment."""

    configuration: Mapping[Module, Content]
    robots: int
    answering: bool
    """Whether its robots have Kilotwin's runtime, and so answer questions."""
    all_asked: bool = True
    """Whether robots are asked until no new one answers; else the number is a part of them."""


@dataclass(frozen=True)
class Finding:
    """A line of the table."""

    what: str
    verdict: GridVerdict
    found: str
    remedy: str = ""
    modules: tuple[Module, ...] = ()
    """Those that the remedy is for; likewise the uids of robots."""
    robots: tuple[int, ...] = ()
    concerns_record: bool = True
    """Whether `record` is to tell it: it is a fault, and set-up does not put it right."""


def judge(seen: Seen, wanted: Wanted) -> list[Finding]:
    """All findings, in the order of the table."""
    found = [_buses(seen), _modules(seen)]
    if seen.health:
        found += [_firmware(seen), _states(seen), _configurations(seen, wanted)]
    elif len(seen.silent) < seen.layout.columns * seen.layout.rows:
        told = "original modules do not say their build, state and configuration"
        found.append(Finding("firmware", GridVerdict.LOOK, told, concerns_record=False))
    if seen.robots is NotAsked.UNWANTED:
        return found
    if isinstance(seen.robots, NotAsked):
        return [
            *found,
            Finding("robots", GridVerdict.LOOK, str(seen.robots), concerns_record=False),
        ]
    return [*found, *_robots(seen.robots, wanted)]


def is_ready(findings: Iterable[Finding]) -> bool:
    """Whether nothing stands against the experiment."""
    return all(finding.verdict is not GridVerdict.NOT_READY for finding in findings)


def as_dict(findings: Sequence[Finding]) -> dict[str, object]:
    """For --json."""
    lines = [{k: v for k, v in asdict(one).items() if k != "concerns_record"} for one in findings]
    return {"ready": is_ready(findings), "findings": lines}


def line(finding: Finding) -> str:
    """A finding by itself."""
    told = f"{finding.what}: {finding.found}"
    return f"{told}; {finding.remedy}" if finding.remedy else told


def text(findings: Sequence[Finding]) -> str:
    """The table, and its result."""
    rows = [("", "verdict", "found", "what to do")]
    rows += [(one.what, str(one.verdict), one.found, one.remedy) for one in findings]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]
    return "\n".join([*lines, "ready" if is_ready(findings) else "not ready"])


def _buses(seen: Seen) -> Finding:
    count = len(seen.names)
    if seen.down:
        why = "; ".join(f"{seen.names[bus]}: {text}" for bus, text in sorted(seen.down.items()))
        found = f"{count - len(seen.down)} of {count} work; {why}"
        return Finding("buses", GridVerdict.NOT_READY, found, "see to the adapter and the bus")
    bad = [
        module
        for module, bus in sorted(seen.bus_health.items())
        if max(bus.transmit_errors, bus.receive_errors) >= MANY_ERRORS
    ]
    if bad:
        found = f"{count} work; many errors at {_names(bad)}"
        remedy = "see to plugs and to the bus's two terminations"
        return Finding("buses", GridVerdict.LOOK, found, remedy, tuple(bad))
    return Finding("buses", GridVerdict.READY, f"{count} of {count} work")


def _modules(seen: Seen) -> Finding:
    all_ = seen.layout.columns * seen.layout.rows
    found = f"{all_ - len(seen.silent)} of {all_} answer"
    if not seen.silent:
        return Finding(MODULES, GridVerdict.READY, found)
    if len(seen.silent) == all_:
        remedy = "see to power and plugs, or name other buses by --can"
    else:
        remedy = "see to their power and plugs; one in its boot loader: kilotwin flash modules"
    silent = tuple(seen.silent)
    return Finding(
        MODULES, GridVerdict.NOT_READY, f"{found}; silent: {_names(silent)}", remedy, silent
    )


def _firmware(seen: Seen) -> Finding:
    """Modules that differ from most. One that does not say it has the original firmware."""
    builds = Counter(bus.version for bus in seen.bus_health.values())
    usual = max(builds, key=lambda build: (builds[build], build), default=None)
    others = {m: bus.version for m, bus in sorted(seen.bus_health.items()) if bus.version != usual}
    found = ", ".join(f"{count} of version {build}" for build, count in sorted(builds.items()))
    told_of = {*seen.silent, *seen.bus_health}
    mute = [module for module in seen.layout.modules() if module not in told_of]
    if others or mute:
        parts = [found, f"{len(mute)} do not say" if mute else ""]
        odd = tuple(sorted([*others, *mute]))
        told = f"{', '.join(filter(None, parts))}: {_names(odd)}"
        verdict = GridVerdict.NOT_READY if others else GridVerdict.LOOK
        return Finding("firmware", verdict, told, "kilotwin flash modules", odd)
    return Finding("firmware", GridVerdict.READY, found)


def _states(seen: Seen) -> Finding:
    counts = Counter(answer.state for answer in seen.health.values())
    found = ", ".join(f"{count} {state.name}" for state, count in sorted(counts.items()))
    writing = _where(seen, lambda answer: answer.state in _WRITES)
    if writing:
        remedy = "wait until the robots' program is written, or kilotwin grid idle"
        told = f"{found}: {_names(writing)}"
        return Finding("states", GridVerdict.LOOK, told, remedy, writing, concerns_record=False)
    odd = _where(seen, lambda answer: answer.state not in _AT_REST)
    if odd:
        told = f"{found}: {_names(odd)}"
        remedy = "record stops them; or kilotwin grid idle"
        return Finding("states", GridVerdict.LOOK, told, remedy, odd, concerns_record=False)
    return Finding("states", GridVerdict.READY, found)


def _configurations(seen: Seen, wanted: Wanted) -> Finding:
    named = {m: answer for m, answer in seen.health.items() if m in wanted.configuration}
    if not wanted.configuration:
        return Finding("configuration", GridVerdict.READY, "the experiment has none")
    right = [
        m
        for m, answer in named.items()
        if is_held(wanted.configuration[m], answer.config_size, answer.config_crc)
    ]
    none = [m for m, answer in sorted(named.items()) if not answer.config_size]
    another = [m for m in sorted(named) if m not in right and m not in none]
    if not none and not another:
        found = f"{len(right)} hold the experiment's"
        return Finding("configuration", GridVerdict.READY, found)
    parts = [f"{len(right)} hold the experiment's"]
    if another:
        parts.append(f"{len(another)} another: {_names(another)}")
    if none:
        where = f": {_names(none)}" if len(none) < len(named) else ""
        parts.append(f"{len(none)} none{where}")
    remedy = "record sets them up; or kilotwin grid setup EXP"
    odd = tuple(sorted([*another, *none]))
    told = ", ".join(parts)
    return Finding("configuration", GridVerdict.LOOK, told, remedy, odd, concerns_record=False)


def _robots(robots: Mapping[int, Report], wanted: Wanted) -> Iterator[Finding]:
    count = len(robots)
    found = f"{count} of {wanted.robots} awake"
    if not robots:
        if not wanted.answering:
            told = "none answers; those with the original runtime never do"
            remedy = "see their lights: kilotwin grid send voltage"
            yield Finding("robots", GridVerdict.LOOK, told, remedy)
            return
        remedy = "lay them on the table, and kilotwin robots wakeup"
        yield Finding("robots", GridVerdict.NOT_READY, found, remedy)
        return
    loading = tuple(uid for uid, robot in sorted(robots.items()) if robot.in_loader)
    if loading:
        told = f"{found}; in their boot loader: {_some(loading)}"
        yield Finding(
            "robots", GridVerdict.NOT_READY, told, "kilotwin flash robots", robots=loading
        )
    elif ALL_ROBOTS in robots:
        yield Finding("robots", GridVerdict.LOOK, WITHOUT_UID, "kilotwin calibrate uid")
    elif count < wanted.robots and wanted.all_asked:
        remedy = "type this again; if they still do not answer: kilotwin robots wakeup"
        yield Finding("robots", GridVerdict.LOOK, found, remedy)
    elif count > wanted.robots:
        yield Finding("robots", GridVerdict.LOOK, found, "take some away, or set swarm.size")
    else:
        told = found if wanted.all_asked else f"{found}, as far as they were asked"
        yield Finding("robots", GridVerdict.READY, told)
    yield _batteries(robots)


def _batteries(robots: Mapping[int, Report]) -> Finding:
    readings = {uid: robot.voltage for uid, robot in sorted(robots.items())}
    known = {uid: reading for uid, reading in readings.items() if reading is not None}
    if not known:
        return Finding("batteries", GridVerdict.LOOK, "no robot says its voltage")
    colours = {uid: colour_of(reading) for uid, reading in known.items()}
    found = f"{volts(min(known.values())):.2f} to {volts(max(known.values())):.2f} V"
    for colour, verdict in (("red", GridVerdict.NOT_READY), ("yellow", GridVerdict.LOOK)):
        low = tuple(uid for uid in known if colours[uid] == colour)
        if low:
            told = f"{found}; {colour}: {_some(low)}"
            return Finding("batteries", verdict, told, "charge these robots", robots=low)
    return Finding("batteries", GridVerdict.READY, found)


def _where(seen: Seen, holds: Callable[[Health], bool]) -> tuple[Module, ...]:
    return tuple(module for module, answer in sorted(seen.health.items()) if holds(answer))


def _names(modules: Sequence[Module]) -> str:
    return _some([f"{x}-{y}" for x, y in modules])


def _some(names: Sequence[object]) -> str:
    shown = ", ".join(map(str, names[:_MOST_NAMES]))
    more = len(names) - _MOST_NAMES
    return f"{shown} and {more} more" if more > 0 else shown
