"""Runs a program on an emulated ATmega328P and here, with the same inputs, and measures it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from kilotwin.programs.image.image import Image
from kilotwin.programs.image.image_size import RAM_BYTES
from kilotwin.programs.native.guest import Guest
from kilotwin.programs.port import bounds, paired_run
from kilotwin.programs.port.disassembly import Disassembly, Place
from kilotwin.programs.port.findings import Finding, Weight
from kilotwin.programs.port.machine_code import STACK_RESERVE
from kilotwin.programs.port.paired_run import Measured, PairedRun
from kilotwin.programs.port.roles import Roles
from kilotwin.programs.port.twin import Ear
from kilotwin.units import CYCLES_PER_S, TICK_CYCLES, TICK_S, ticks

# A tick and a bit: an interrupt between two lines of loop() may put a decision off until the next.
SLACK_S = 0.04
# Neither 0 nor 1: programs give those a role of their own.
UID = 7
# Wall time that a trial may take: many times what it does, for a program that stands still.
_LEAST_LIMIT_S, _LIMIT_PER_S = 120.0, 10.0
_TAKE_LESS = (
    "look for what malloc() gives and free() never gets back, take less, or take an array of a "
    "fixed length: malloc() leaves 32 bytes to the stack as it is when it is called, no more"
)


@dataclass(frozen=True)
class Trial:
    """How long to run the program, and with which luck."""

    seconds: float = 60
    seed: int = 1
    ear: Ear | None = None
    """Messages as a robot of a run received them; without them the seed draws messages."""


@dataclass(frozen=True)
class LongestCall:
    """Longest call of one function; `cycles` 0: it never came back. Interrupts in between count."""

    function: str
    place: Place | None
    calls: int
    cycles: int
    tick: int

    @property
    def ms(self) -> float:
        """How long, in milliseconds."""
        return 1000 * self.cycles / CYCLES_PER_S

    def text(self) -> str:
        """function(): ms (cycles), at the tick."""
        if not self.cycles:
            return f"{self.function}(): {'does not come back' if self.calls else 'never called'}"
        return f"{self.function}(): {self.ms:.3g} ms ({self.cycles:,} cycles) at tick {self.tick:,}"

    def as_dict(self) -> dict[str, Any]:
        """For --json."""
        return {
            "function": self.function,
            "file": self.place.file if self.place else None,
            "line": self.place.line if self.place else None,
            "calls": self.calls,
            "cycles": self.cycles,
            "tick": self.tick,
        }


@dataclass(frozen=True)
class Outcome:
    """Results of a trial. Ticks count from power-up."""

    ticks: int
    seed: int
    heard: int
    compared: int
    """Decisions (LED, motors, messages) that were the same."""
    worst_lag_s: float
    stack_bytes: int
    stack_in: str
    """The function that ran when the stack was at its deepest."""
    stack_place: Place | None
    room_bytes: int
    """Left between variables, or heap, and stack; below 0: they overlap."""
    heap_bytes: int
    """Bytes that malloc() had taken by then."""
    loops: tuple[LongestCall, ...]
    callbacks: tuple[LongestCall, ...]
    ticks_lost: int
    difference: tuple[int, str] | None
    """The first: its tick, and what here and what on the robot."""
    avr_failure: str
    native_failure: str
    prints: tuple[tuple[int, str], ...] = ()
    """Its prints here: tick and text."""
    sent: int = 0
    """Frames of the chip."""
    sent_badly: int = 0
    """Those with a wrong checksum."""
    hummed_s: float = 0
    """So long its motors were on while neither turned."""
    carried: dict[int, int] = field(default_factory=dict)
    """Ticks by the address of a sum (numbers.py) that did not fit."""

    def as_dict(self) -> dict[str, Any]:
        """For --json."""
        return {
            "seconds": round(self.ticks * TICK_S, 3),
            "ticks": self.ticks,
            "seed": self.seed,
            "messages_heard": self.heard,
            "decisions_same": self.compared,
            "worst_lag_s": self.worst_lag_s,
            "stack_bytes": self.stack_bytes,
            "stack_deepest_in": self.stack_in,
            "stack_room_bytes": self.room_bytes,
            "heap_bytes": self.heap_bytes,
            "loop": [call.as_dict() for call in self.loops],
            "callbacks": [call.as_dict() for call in self.callbacks],
            "ticks_lost": self.ticks_lost,
            "first_difference": (
                {"tick": self.difference[0], "what": self.difference[1]}
                if self.difference
                else None
            ),
            "robot_failure": self.avr_failure or None,
            "native_failure": self.native_failure or None,
        }

    def lines(self) -> Iterator[str]:
        """For people."""
        where = f" ({self.stack_place.file}:{self.stack_place.line})" if self.stack_place else ""
        ran = f"{self.ticks * TICK_S:.1f} s on the robot and here"
        heap = f", with {self.heap_bytes:,} taken by malloc()" if self.heap_bytes else ""
        yield f"  ran    {ran}, {self.heard:,} messages received"
        yield (
            f"  stack  {self.stack_bytes:,} bytes at its deepest, in {self.stack_in}(){where}; "
            f"{self.room_bytes:,} were left{heap}"
        )
        for call in (*self.loops, *self.callbacks):
            yield f"  {call.text()}"
        yield f"  ticks  {self.ticks_lost or 'none'} lost of {self.ticks:,}"
        apart = f"{1000 * self.worst_lag_s:.1f} ms apart at most"
        then = ", then they differ" if self.difference else ""
        yield f"  {self.compared:,} decisions are the same on the robot and here, {apart}{then}"


def run(
    trial: Trial,
    guest: Guest,
    image: Image,
    code: Disassembly,
    roles: Roles,
    *,
    to_difference: bool = False,
    sums: Sequence[tuple[int, bool]] = (),
) -> Outcome:
    """Runs the program, confined; errors as of paired_run.run.

    With `to_difference`, no further than to the first one. `sums`: as of PairedRun.
    """
    loops, callbacks = sorted(roles.loop), sorted(roles.in_interrupts)
    entries = {
        code.functions[name].instructions[0].address: name
        for name in (*loops, *callbacks)
        if name in code.functions
    }
    wanted = paired(
        trial,
        guest,
        image,
        follow=list(entries),
        sums=list(sums),
        waits=waits(code, roles),
        to_difference=to_difference,
    )
    measured = paired_run.run(wanted, _limit_s(trial))
    return _outcome(trial, measured, code, {name: entry for entry, name in entries.items()}, roles)


def callers(
    trial: Trial, guest: Guest, image: Image, entries: Sequence[int]
) -> dict[int, dict[int, int]]:
    """Where functions of the image were called from in a run, by their entries: addresses, and the
    tick of the first call. Errors as of paired_run.run."""
    wanted = paired(trial, guest, image, follow=list(entries), waits=False)
    watched = paired_run.run(wanted, _limit_s(trial)).watched
    return {} if watched is None else watched.callers


def _limit_s(trial: Trial) -> float:
    return _LEAST_LIMIT_S + _LIMIT_PER_S * trial.seconds


def paired(trial: Trial, guest: Guest, image: Image, **more: Any) -> PairedRun:
    """The order for a trial; `more` of its fields: `follow` and `waits` at least."""
    return PairedRun(
        name=guest.name,
        guest=str(guest.file),
        elf=str(image.elf),
        seed=trial.seed,
        uid=UID if trial.ear is None else trial.ear.uid,
        slack_s=SLACK_S,
        heard=[] if trial.ear is None else list(trial.ear.heard),
        ticks=ticks(trial.seconds),
        **more,
    )


def waits(code: Disassembly, roles: Roles) -> bool:
    """Whether the program calls delay(), itself or by what it calls; kilo_start() does anyway."""
    main = code.functions.get("main")
    callees = {callee for _, callee in main.calls} if main else set()
    return "delay" in code.reached_from((callees | roles.setup | roles.loop) - {"kilo_start"})


def _outcome(
    trial: Trial, measured: Measured, code: Disassembly, entries: dict[str, int], roles: Roles
) -> Outcome:
    watched = measured.watched
    assert watched is not None

    def longest(names: frozenset[str]) -> tuple[LongestCall, ...]:
        found = []
        for name in sorted(names & entries.keys()):
            calls, cycles, tick = watched.calls[entries[name]]
            place = code.functions[name].instructions[0].place
            found.append(LongestCall(name, place, calls, cycles, tick))
        return tuple(found)

    function, place = code.at(watched.deepest_at)
    difference = measured.difference
    return Outcome(
        measured.tick,
        trial.seed,
        measured.received,
        measured.compared,
        measured.worst_lag_s,
        watched.stack_bytes,
        function,
        place,
        watched.room_bytes,
        RAM_BYTES - code.ram_bytes - watched.stack_bytes - watched.room_bytes,
        longest(roles.loop),
        longest(roles.in_interrupts),
        watched.ticks_lost,
        (difference.tick, difference.text) if difference else None,
        measured.avr_failure,
        measured.native_failure,
        tuple(measured.native_prints),
        measured.chip_sent,
        measured.chip_sent_badly,
        measured.hummed_s,
        watched.sums,
    )


def findings(outcome: Outcome) -> Iterator[Finding]:
    """Findings of it, but for a difference: see retrial."""
    yield from _memory(outcome)
    yield from _time(outcome)
    yield from bounds.findings(outcome.prints)
    if outcome.native_failure:
        yield Finding(
            "fails-here",
            Weight.FAILS,
            f"it stops on this computer: {outcome.native_failure}",
            "mend that first; `kilotwin run` shows it as well",
        )


def _memory(outcome: Outcome) -> Iterator[Finding]:
    deepest = f"the stack got {outcome.stack_bytes:,} bytes deep, in {outcome.stack_in}()"
    # The heap is to blame wherever the stack was just then.
    heap = outcome.heap_bytes
    under = f"the {heap:,} bytes that malloc() took" if heap else "the variables"
    place = None if heap else outcome.stack_place
    if outcome.room_bytes < 0:
        do = "make calls less deep, local arrays smaller, or a recursion a loop"
        yield Finding(
            "stack-meets-data",
            Weight.FAILS,
            f"{deepest}, at tick {outcome.ticks:,}, and lies on {under}",
            _TAKE_LESS if heap else do,
            place,
        )
    elif outcome.room_bytes < STACK_RESERVE:
        do = "make arrays smaller or of smaller types, or calls less deep"
        yield Finding(
            "stack-meets-data",
            Weight.WARNS,
            f"{deepest}; only {outcome.room_bytes:,} bytes were left between it and {under}",
            _TAKE_LESS if heap else do,
            place,
        )
    if outcome.avr_failure:
        yield Finding(
            "stops",
            Weight.FAILS,
            f"the robot cannot go on: {outcome.avr_failure}",
            "look for a write beyond an array, or a stack that is too deep",
        )


def _time(outcome: Outcome) -> Iterator[Finding]:
    slow = [call for call in outcome.callbacks if call.cycles > TICK_CYCLES]
    for call in slow:
        yield Finding(
            "long-callback",
            Weight.WARNS,
            f"{call.function}() took {call.ms:.0f} ms, in which the robot's clock stands and "
            f"no message is received; {outcome.ticks_lost:,} of {outcome.ticks:,} ticks were lost",
            "note in the callback what has come, and do the work in loop()",
            call.place,
        )
    if outcome.ticks_lost and not slow:
        yield Finding(
            "ticks-lost",
            Weight.WARNS,
            f"{outcome.ticks_lost:,} of {outcome.ticks:,} ticks lost: interrupts were off for long",
            "keep what is between cli() and sei() short",
        )
