"""Why a program decides otherwise on the robot: run again without what only takes time there.

On the robot interrupts take time: what it does behind them comes later than on this computer, and a
sensor that is read then may show something else. No number is wrong in that.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from kilotwin.errors import KilotwinError
from kilotwin.experiment.programs import Program
from kilotwin.programs.cache import Notify
from kilotwin.programs.image.image import build_image
from kilotwin.programs.native.guest import build as build_guest
from kilotwin.programs.port import trial as trials
from kilotwin.programs.port.disassembly import Disassembly
from kilotwin.programs.port.findings import Finding, Weight, listed
from kilotwin.programs.port.roles import Roles
from kilotwin.programs.port.trial import Outcome, Trial


@dataclass(frozen=True)
class Cause:
    """Cause of a difference that is none of numbers. `uses`: a function that the program calls."""

    uses: str
    define: str
    """A macro that does away with it."""
    sources: tuple[Path, ...]
    """Includes that the macro needs."""
    what: str
    without: str
    """How the program was run then."""
    do: str


LIGHT = Cause(
    "get_ambientlight",
    "get_ambientlight=kilotwin_nth_light",
    (Path(__file__).with_name("nth_light.c"),),
    "it reads the light some ms later on the robot, when it is not the same any more",
    "both get the same readings of the light, one after the other",
    "nothing has to be mended if it may read the light at one moment as well as at the next; "
    "compare what many runs have in common",
)
DELAYS = Cause(
    "delay",
    "delay=kilotwin_delay",
    (Path(__file__).with_name("in_whole_ticks.c"),),
    "interrupts prolong delay() on the robot, so that a message that comes at its end is met by "
    "another line of loop() than here",
    "delay() ends with a tick on both",
    "nothing has to be mended if it may find a message before a delay() as well as behind it; "
    "compare what many runs have in common",
)
PASSES = Cause(
    "kilo_start",
    "kilo_start=kilotwin_start",
    (Path(__file__).with_name("once_a_tick.c"),),
    "it counts passes of loop(), of which the robot makes thousands in the time of one here",
    "loop() runs once a tick on both",
    "count kilo_ticks in place of passes: what it shows here is not what the robot will show",
)
_CAUSES = (LIGHT, DELAYS, PASSES)


@dataclass(frozen=True)
class Tried:
    """A program, and how it was tried."""

    program: Program
    code: Disassembly
    roles: Roles
    trial: Trial


def findings(
    tried: Tried, outcome: Outcome, unfit: Sequence[Finding], notify: Notify
) -> Iterator[Finding]:
    """`outcome`'s first difference, if it has one that means anything. `unfit`: numbers that were
    seen not to fit their type on the robot."""
    # Behind a spoilt stack or a failure nothing else is to be expected.
    if not outcome.difference or outcome.room_bytes < 0 or outcome.avr_failure:
        return
    tick, what = outcome.difference
    ear = tried.trial.ear
    got = "" if ear is None else f", with the messages that robot {ear.uid} of a run got"
    text = f"it decides otherwise on the robot than here{got}, first at tick {tick:,}: {what}"
    causes = [cause for cause in _CAUSES if _may_be(cause, tried)]
    if blamed := _blamed(causes, tried, notify):
        whats = " and ".join(cause.what for cause in blamed)
        withouts = " and ".join(cause.without for cause in blamed)
        passes = PASSES in blamed
        yield Finding(
            "differs-in-passes" if passes else "differs-in-time",
            Weight.FAILS if passes else Weight.WARNS,
            f"{text}. That is because {whats}: where {withouts}, it decides the same",
            "; ".join(cause.do for cause in blamed),
        )
    else:
        yield Finding("differs", Weight.FAILS, text, _where_to_look(causes, tried, unfit))


def _may_be(cause: Cause, tried: Tried) -> bool:
    """Whether the program uses it. A delay() in a callback, where ticks stand, stays as it is."""
    if cause is DELAYS:
        code, roles = tried.code, tried.roles
        in_callbacks = code.reached_from(roles.in_interrupts)
        hears = bool(roles.callbacks["rx"])
        return hears and trials.waits(code, roles) and cause.uses not in in_callbacks
    return cause.uses in tried.code.functions


def _blamed(causes: Sequence[Cause], tried: Tried, notify: Notify) -> Sequence[Cause]:
    """As few causes as have to be done away with for all decisions to be the same; none: others."""
    for some in _attempts(causes):
        program = tried.program
        other = replace(
            program,
            sources=(*program.sources, *(file for cause in some for file in cause.sources)),
            defines=(*program.defines, *(cause.define for cause in some)),
        )
        try:
            image, guest = build_image(other), build_guest(other)
            notify("running it again: " + " and ".join(cause.without for cause in some))
            code = Disassembly.of(image)
            outcome = trials.run(tried.trial, guest, image, code, tried.roles, to_difference=True)
        except KilotwinError:
            continue  # the macro means something else to this program, or no room is left
        failed = outcome.avr_failure or outcome.native_failure or outcome.room_bytes < 0
        if not outcome.difference and not failed:
            return some
    return ()


def _attempts(causes: Sequence[Cause]) -> list[Sequence[Cause]]:
    """Each cause alone, then all together."""
    together = [causes] if len(causes) > 1 else []
    return [*([cause] for cause in causes), *together]


def _where_to_look(causes: Sequence[Cause], tried: Tried, unfit: Sequence[Finding]) -> str:
    """Causes that are possible in this program."""
    if seen := [found for found in unfit if found.place is not None]:
        places = sorted({(found.place.line, found.check) for found in seen if found.place})
        where = listed([f"line {line} [{check}]" for line, check in places])
        return f"mend first what does not fit its type: {where}"
    may_be = [cause.what for cause in causes if cause is not PASSES]
    if "malloc" in tried.code.functions:
        may_be.append("malloc() finds another amount of memory on the robot than here")
    narrow = (
        "look for an int that needs more than 16 bits, a double that needs more than 32, and "
        "for what an interrupt may change between two lines of loop()"
    )
    if not may_be:
        return narrow
    return f"{narrow}. It may also be that {', or that '.join(may_be)}"
