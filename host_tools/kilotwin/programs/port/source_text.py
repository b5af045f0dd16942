"""Checks on the source: patterns that a simulator forgives and a robot does not."""

import os
import re
import subprocess
from collections.abc import Container, Iterator, Sequence
from pathlib import Path

from kilotwin.experiment.programs import Program
from kilotwin.files import resources
from kilotwin.programs.confined_tools import confined
from kilotwin.programs.image.image import program_flags
from kilotwin.programs.image.tools import avr_gcc
from kilotwin.programs.native.guest import find_compiler
from kilotwin.programs.port.disassembly import Place
from kilotwin.programs.port.findings import Finding, Weight
from kilotwin.programs.port.roles import Line, Roles
from kilotwin.programs.port.trial import Outcome

# The clock, or a variable that it was copied to, taken modulo a number or masked, in a comparison.
_MODULO = (
    r"\b(?:{})\s*(?:[/*]\s*\w+\s*)?\)?\s*(?:%[^;{{]*?(?:==|!=|\)\s*[{{;]|<)|&\s*\w+\s*\)?\s*[!=]=)"
)
_COPY = re.compile(r"\b(\w+)\s*=\s*kilo_ticks\s*;")
_GUARD = r"\b(?:{0})\s*[!=]=\s*\w*[a-z_]\w*|\w*[a-z_]\w*\s*[!=]=\s*\b(?:{0})\b"
_EQUAL = re.compile(r"\bkilo_ticks\s*==\s*|==\s*kilo_ticks\b")
_SET_MOTORS = re.compile(r"\bset_motors\s*\(([^;]*)\)\s*;")
_KICK = re.compile(
    r"\bspinup_motors\s*\(|\bset_motors\s*\([^;]*\b(255|0xFF|0xff)\b|"
    r"OCR2[AB]\s*=\s*(255|0xFF|0xff)\b"
)
_FULL_DUTY = re.compile(r"\b(\w+)\s*=\s*(?:255|0[xX][fF]{2})\b")
_HUMMED_S = 1.0
_NO_DUTY = re.compile(r"^\s*(?:\([\w\s]+\)\s*)?0\s*,\s*(?:\([\w\s]+\)\s*)?0\s*$")
# A 1 that is shifted by something that is no number, and is not cast to something wider before.
_SHIFT = re.compile(r"(?<![\w.)])(?<!\) )\(?\s*1\s*\)?\s*<<\s*\(*\s*(?![\s(]*\d+\b)[A-Za-z_]")
# An int of two bytes, the first one shifted, and not cast to something wider or without a sign.
_JOINED = re.compile(r"\bint\s+(\w+)\s*=\s*(?!\s*\(\s*(?:u?int\d+_t|unsigned|long)\b)[^;]*<<\s*8\b")
# Names of variables and functions with more than 16 bits.
_WIDE = re.compile(
    r"\b(?:u?int(?:32|64)_t|(?:unsigned\s+|signed\s+)?long(?:\s+long)?(?:\s+int)?)\s+(\w+)"
    r"(?:[^;(){}=,]*,\s*(\w+))?"
)
_WARNING = re.compile(
    r"^([^:\n]+):(\d+):(?:\d+:)? warning: (.*?) \[-W([\w-]+)=?\d*\]$", re.MULTILINE
)
# Only conversions to an int, or of numbers computed in ints.
_WIDTH = re.compile(
    r"conversion to .(unsigned )?int. |overflow|shift|always (true|false)|truncated"
)
_ALWAYS = re.compile(r"always (true|false)")
_Warning = tuple[str, int, str]  # file, line, text
# Warnings that only a 16-bit int brings about: the PC's compiler does not say it of the same line.
_WIDTH_FLAGS = ["-Wconversion", "-Woverflow", "-Wshift-count-overflow", "-Wtype-limits"]


def ticks(lines: Sequence[Line], outcome: Outcome | None = None) -> Iterator[Finding]:
    """`if (kilo_ticks % N == 0)`: true for a whole tick, in which loop() runs a thousand times.
    `outcome`: of a trial, which has counted these passes."""
    passes = "thousands of times"
    if outcome is not None and outcome.loops and outcome.ticks:
        calls = max(call.calls for call in outcome.loops)
        passes = f"{calls / outcome.ticks:,.0f} times (in this trial)"
    # A copy that is compared with the time before lets the program act once a tick.
    text = "\n".join(line.text for line in lines)
    copies = {name for name in _COPY.findall(text) if not re.search(_GUARD.format(name), text)}
    clocks = "|".join(["kilo_ticks", *sorted(copies)])
    modulo, guard = re.compile(_MODULO.format(clocks)), re.compile(_GUARD.format(clocks))
    for line in lines:
        if modulo.search(line.text) and not guard.search(line.text):
            yield Finding(
                "tick-modulo",
                Weight.WARNS,
                f"kilo_ticks % N keeps its value for a whole tick, in which loop() runs {passes}",
                "keep the tick at which it is due next: if (kilo_ticks >= next) { next += N; ... }",
                line.place,
            )
        elif _EQUAL.search(line.text) and "while" not in line.text:
            yield Finding(
                "tick-equal",
                Weight.WARNS,
                "kilo_ticks may pass this value during a callback or delay(), and keeps it for a "
                f"whole tick, in which loop() runs {passes}",
                "compare with >=, and note that it is done",
                line.place,
            )


def shifts(lines: Sequence[Line]) -> Iterator[Finding]:
    """`1 << k` where 32 bits are wanted: an int has 16 on the robot, and the bit is lost."""
    wide = {name for line in lines for names in _WIDE.findall(line.text) for name in names}
    for line in lines:
        words = set(re.findall(r"[A-Za-z_]\w*", line.text))
        if _SHIFT.search(line.text) and words & wide:
            yield Finding(
                "int-width",
                Weight.WARNS,
                "1 << k is an int: with k of 16 and more it is 0 on the robot, and of 15 negative",
                "write 1UL << k",
                line.place,
            )


def joined_bytes(lines: Sequence[Line]) -> Iterator[Finding]:
    """`int id = high << 8 | low`, of which the sign is asked: on the robot it may have one."""
    text = "\n".join(line.text for line in lines)
    for line in lines:
        found = _JOINED.search(line.text)
        if found and re.search(rf"\b{found[1]}\s*(?:>=|<=|<|>)\s*-?[01]\b(?!\.)", text):
            yield Finding(
                "int-width",
                Weight.WARNS,
                f"{found[1]} is negative on the robot where the first byte is 128 and more, and "
                "never here",
                "say which is meant: int16_t, or uint16_t",
                line.place,
            )


def motors(lines: Sequence[Line], outcome: Outcome | None = None) -> Iterator[Finding]:
    """A motor that stands needs 15 ms at full duty to start. `outcome`: of a trial, in which motors
    may have hummed though there is a kick in the program."""
    if outcome is not None and outcome.hummed_s >= _HUMMED_S:
        yield Finding(
            "no-kick",
            Weight.FAILS,
            f"motors were on for {outcome.hummed_s:.0f} s of the run without turning: they stood, "
            "and got no kick of 15 ms at full duty",
            "call spinup_motors() before set_motors() where the robot stood",
            next((line.place for line in lines if _SET_MOTORS.search(line.text)), None),
        )
        return
    if any(_KICK.search(line.text) for line in lines):
        return
    full = {name for line in lines for name in _FULL_DUTY.findall(line.text)}
    calls = [(line, _SET_MOTORS.search(line.text)) for line in lines]
    if any(found and full & set(re.findall(r"\w+", found[1])) for _, found in calls):
        return
    for line, found in calls:
        if found and not _NO_DUTY.match(found[1]):
            yield Finding(
                "no-kick",
                Weight.FAILS,
                "motors that stand do not start at this duty, and spinup_motors() is never called",
                "call spinup_motors() before set_motors() where the robot stood",
                line.place,
            )
            return


def checksum(
    lines: Sequence[Line], roles: Roles, silent: Container[str], outcome: Outcome | None = None
) -> Iterator[Finding]:
    """Frames without a checksum: every robot that receives one drops it. `silent`: callbacks that
    never have a message. `outcome`: of a trial, which knows what was sent."""
    why, weight = "message_crc() is never called", Weight.FAILS
    if outcome is not None and outcome.sent > 0:
        if outcome.sent_badly < outcome.sent:
            return
        why = f"that of all {outcome.sent:,} frames of the run is wrong"
    elif any(
        "message_crc" in line.text and "uint16_t message_crc" not in line.text for line in lines
    ):
        return
    elif outcome is not None:
        why, weight = f"{why}, though nothing was sent in the run", Weight.WARNS
    for name, place in roles.callbacks["tx"].items():
        if name in silent:
            continue
        yield Finding(
            "no-crc",
            weight,
            f"what {name}() sends has no checksum: {why}, and robots drop such a message",
            "set message.crc = message_crc(&message) after every change of the message",
            place,
        )


def widths(program: Program) -> Iterator[Finding]:
    """Where an int of 16 bits loses what one of 32 keeps: avr-gcc warns, the PC's does not; and
    comparisons that only with 32 bits come out the same always."""
    flags = [flag for flag in program_flags(program) if flag != "-fstack-usage"]
    avr_libc = f"-I{resources.path('emulator/robots/native/include')}"
    for source in program.sources:
        ours = _warnings([avr_gcc(), *flags, *_WIDTH_FLAGS], source)
        pc = [find_compiler(), avr_libc, *(flag for flag in flags if not flag.startswith("-mmcu"))]
        theirs = _warnings([*pc, *_WIDTH_FLAGS], source)
        for some, others, pattern, text, do in (
            (
                ours,
                theirs,
                _WIDTH,
                "an int has 16 bits on the robot: {}",
                "use a type that says its width, as int32_t; write 60000UL for constants",
            ),
            (
                theirs,
                ours,
                _ALWAYS,
                "an int has 32 bits here: {}; on the robot it is not",
                "compare with a value of the variable's own type, as UINT16_MAX",
            ),
        ):
            for file, line, what in _only_in(some, others, program):
                if pattern.search(what):
                    place = Place(str(Path(file).resolve()), line)
                    yield Finding("int-width", Weight.WARNS, text.format(what), do, place)


def missing_returns(warnings: Sequence[str]) -> Iterator[Finding]:
    """Functions with a value that come to their end without one: what a register then holds is
    another thing on the robot and here. `warnings`: of the compiler, as an image keeps them."""
    for file, line, what, _ in _WARNING.findall("\n".join(warnings)):
        if what.startswith("control reaches end of non-void function"):
            yield Finding(
                "no-return",
                Weight.WARNS,
                "the function comes to its end without a value, and its caller gets what a "
                "register held",
                "return a value there too, or make the function void",
                Place(str(Path(file).resolve()), int(line)),
            )


def _only_in(
    some: Sequence[_Warning], others: Sequence[_Warning], program: Program
) -> Iterator[_Warning]:
    """Warnings of the program's own lines of which the other compiler says nothing."""
    known = {(file, line) for file, line, _ in others}
    for warning in some:
        if warning[:2] not in known and Path(warning[0]).resolve() in program.sources:
            yield warning


def _warnings(command: list[str], source: Path) -> list[_Warning]:
    done = subprocess.run(
        confined([*command, "-fsyntax-only", str(source)]),
        capture_output=True,
        text=True,
        check=False,
        errors="replace",
        env={**os.environ, "LC_ALL": "C"},
    )
    found = _WARNING.findall(done.stderr)
    return list(dict.fromkeys((file, int(line), what) for file, line, what, _ in found))
