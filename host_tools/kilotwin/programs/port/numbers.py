"""Numbers that do not fit their type on the robot: an int of 16 bits that overflows, a sum without
a sign that begins anew at 0, a float that does not fit the integer that is made of it.

The compiler for the robot puts checks into an image of its own (numbers.c), which runs on the chip
once more; sums without a sign, which it does not check, are watched in the image as it is flashed.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from kilotwin.errors import KilotwinError
from kilotwin.programs.cache import Notify
from kilotwin.programs.image.image import Checks, build_image
from kilotwin.programs.native.guest import Guest
from kilotwin.programs.port import trial as trials
from kilotwin.programs.port.disassembly import Disassembly, Function, Instruction, Place
from kilotwin.programs.port.findings import Finding, Weight
from kilotwin.programs.port.retrial import Tried

_BESIDE = Path(__file__)
_HANDLERS = _BESIDE.with_name("numbers.c")
_CHECKS = Checks(
    ("-fsanitize=signed-integer-overflow,float-cast-overflow", "-fdata-sections"),
    (f"-Wl,-T,{_BESIDE.with_name('numbers.ld')}",),
)  # for the program's own sources, with the handlers among them
_HANDLER = "__ubsan_handle_"
_OF_FLOATS = f"{_HANDLER}float_cast_overflow"
_USE_LARGER = (
    "use a type that holds it, as int32_t, or test it before; (int32_t)a * b for a product"
)
_TEST_BEFORE = (
    "test that it fits before it is made an integer, or make it an int32_t first; what becomes of "
    "it else the C standard leaves open, and chip and PC differ"
)
# The variable that a line changes: "me->energy += 5000", "count++", "++count", "int sum = a * b".
_CHANGED = re.compile(
    r"((?:\w+\s*(?:->|\.)\s*)*\w+)(?:\s*\[[^\]]*\])?\s*(?:(?:<<|>>|[-+*/%&|^])?=(?!=)|\+\+|--)"
)
_CHANGED_BEFORE = re.compile(r"(?:\+\+|--)\s*((?:\w+\s*(?:->|\.)\s*)*\w+)")
_HEAD_OF_LOOP = re.compile(r"\bfor\s*\([^;]*;[^;]*;[^)]*\)(?=\s*\S)")
_LONGEST_TEXT = 60


@dataclass(frozen=True)
class Sum:
    """A sum of 16 bits that is stored where it came from. `at`: the instruction that ends it;
    `carry`: how the carry flag is where the sum does not fit."""

    at: int
    carry: bool
    place: Place


def seen_unfit(
    tried: Tried, guest: Guest, sums: Sequence[Sum], carried: Mapping[int, int], notify: Notify
) -> Iterator[Finding]:
    """Runs the program on the chip with the compiler's checks. `carried`: ticks by address, of
    `sums` of the image without them."""
    program = tried.program
    with_handlers = replace(program, sources=(*program.sources, _HANDLERS))
    try:
        image = build_image(with_handlers, checks=_CHECKS)
    except KilotwinError:
        notify("numbers are not checked: with the checks the program does not fit into the robot")
        return
    code = Disassembly.of(image)
    entries = {
        function.entries[0]: name
        for name, function in code.functions.items()
        if name.startswith(_HANDLER)
    }
    callers: dict[int, dict[int, int]] = {}
    if entries:
        notify("running it again: with checks of its numbers")
        callers = trials.callers(tried.trial, guest, image, list(entries))
    yield from _of_checks(code, {name: callers.get(entry, {}) for entry, name in entries.items()})
    # A sum with a sign has a check: its carry means nothing.
    signed = _checked_places(code)
    for one in sums:
        if one.at in carried and one.place not in signed:
            yield _overflow(one.place, carried[one.at], "without a sign they go from 0 to 65,535")


def _of_checks(code: Disassembly, callers: Mapping[str, Mapping[int, int]]) -> Iterator[Finding]:
    """One finding for each line, with its first tick."""
    first: dict[tuple[bool, Place], int] = {}
    for handler, calls in callers.items():
        for at, tick in calls.items():
            place = code.at(at)[1]
            if place is not None:
                kind = handler == _OF_FLOATS, place
                first[kind] = min(first.get(kind, tick), tick)
    for (is_float, place), tick in first.items():
        if is_float:
            yield Finding(
                "float-to-int",
                Weight.WARNS,
                f"a float does not fit the integer that is made of it{_shown(place)}, first at "
                f"tick {tick:,}",
                _TEST_BEFORE,
                place,
            )
        else:
            yield _overflow(place, tick, "an int goes from -32,768 to 32,767 on the robot")


def _overflow(place: Place, tick: int, range_: str) -> Finding:
    return Finding(
        "int-overflow",
        Weight.WARNS,
        f"{_variable(place)} does not fit into 16 bits{_shown(place)}, first at tick {tick:,}: "
        f"{range_}",
        _USE_LARGER,
        place,
    )


def _checked_places(code: Disassembly) -> set[Place]:
    return {
        instruction.place
        for function in code.functions.values()
        for instruction, callee in function.calls
        if callee.startswith(_HANDLER) and instruction.place is not None
    }


def _variable(place: Place) -> str:
    """The one that a line changes."""
    text = _HEAD_OF_LOOP.sub("", _line(place))
    found = _CHANGED.search(text) or _CHANGED_BEFORE.search(text)
    return re.sub(r"\s", "", found[1]) if found else "a number"


def _shown(place: Place) -> str:
    text = _line(place)
    if len(text) > _LONGEST_TEXT:
        text = text[:_LONGEST_TEXT] + "..."
    return f" (`{text}`)" if text else ""


def _line(place: Place) -> str:
    """The line as it is written, without a comment; "" if it is not there any more."""
    try:
        text = Path(place.file).read_text(errors="replace").splitlines()[place.line - 1]
    except (OSError, IndexError):
        return ""
    return " ".join(text.partition("//")[0].split())


def sums(code: Disassembly, own: set[str]) -> list[Sum]:
    """Sums without a sign in the program's own code: `x += 5000`, `x++`, `x -= 3`."""
    found = []
    for function in code.functions.values():
        for index, instruction in enumerate(function.instructions):
            place = instruction.place
            if place is None or place.file not in own:
                continue
            if (carry := _carry_of(function, index)) is not None:
                found.append(Sum(instruction.address, carry, place))
    return found


def _carry_of(function: Function, index: int) -> bool | None:
    """If the instruction ends a sum of a variable of two bytes with a number, which is stored where
    it came from: how the carry flag is where the sum does not fit. None: it is no such sum."""
    code = function.instructions
    last = code[index]
    pair = _pair_of(last)
    if pair is None or not _comes_from_and_goes_to(function, index, pair):
        return None
    if index + 1 < len(code) and code[index + 1].name in _GO_ON:
        return None  # a sum of more bytes
    if last.name in ("adiw", "sbiw"):
        return True
    if index == 0:
        return None
    first = code[index - 1]
    low, high = (_number(one) for one in (first, last))
    if last.name == "sbci" and first.name == "subi" and low is not None and high is not None:
        # A sum with K is a difference with 65,536 - K: it borrows where the sum does fit.
        return (high << 8 | low) < 0x8000
    # A byte without a sign is added, with a register that is 0 for its upper one.
    added = last.name == "adc" and last.operands.endswith(("r1", "__zero_reg__"))
    return True if added and first.name == "add" else None


def _pair_of(last: Instruction) -> int | None:
    """The lower register of the pair that a sum of two bytes leaves with this instruction."""
    found = re.match(r"r(\d+)", last.operands)
    if found is None:
        return None
    if last.name in ("adiw", "sbiw"):
        return int(found[1])
    return int(found[1]) - 1 if last.name in ("sbci", "adc") else None


def _number(instruction: Instruction) -> int | None:
    found = re.search(r", (0x[0-9A-Fa-f]+)", instruction.operands)
    return int(found[1], 16) if found else None


_GO_ON = {"adc", "sbc", "sbci"}
_LOADS, _STORES = {"lds", "ld", "ldd"}, {"sts", "st", "std"}
_NEAR = 6


def _comes_from_and_goes_to(function: Function, index: int, low: int) -> bool:
    """Whether a pair of registers was loaded just before, and is stored where it came from."""
    code = function.instructions
    before = _accesses(code[max(index - _NEAR, 0) : index], _LOADS, low)
    after = _accesses(code[index + 1 : index + 1 + _NEAR], _STORES, low)
    return len(before) == 2 and before == after


def _accesses(code: list[Instruction], how: set[str], low: int) -> dict[int, str]:
    """Where the registers of a pair are loaded from or stored to, as it is written."""
    found = {}
    for instruction in code:
        if instruction.name not in how:
            continue
        left, _, right = instruction.operands.partition(", ")
        register, where = (left, right) if how is _LOADS else (right, left)
        if register in (f"r{low}", f"r{low + 1}"):
            found[int(register[1:])] = where.replace("+0", "")
    return found
