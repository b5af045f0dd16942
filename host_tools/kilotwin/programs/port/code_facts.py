"""Facts of a program's machine code for the notes of a run (runs/notes.py). The code is read once,
and the facts are kept in the cache."""

import hashlib
import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kilotwin.experiment.programs import Program
from kilotwin.files.drafts import draft_of
from kilotwin.programs.cache import cache_folder
from kilotwin.programs.image.image import build_image
from kilotwin.programs.port.disassembly import Disassembly, Function, Instruction, Place
from kilotwin.programs.port.roles import find_roles, own_lines

_UID = "kilo_uid"
# Instructions that leave their first register as it is; all others change it.
_LEAVE_IT = {"cp", "cpc", "cpi", "cpse", "tst", "sts", "st", "std", "push", "out", "sbrc", "sbrs"}
_ENDS = {"call", "rcall", "icall", "ret", "reti", "jmp", "rjmp", "ijmp"}
_ZERO = "r1"  # a register that always holds 0
_FAR = 24  # instructions from a load of the uid to its comparison
_REGISTER = re.compile(r"\br\d+\b")


@dataclass(frozen=True)
class _Copies:
    """Addresses of the bytes of kilo_uid, and of variables that are given nothing else."""

    low: frozenset[int]
    high: frozenset[int]


def facts_of(program: Program) -> dict[str, Any]:
    """Reads the program's image. `listens`: its own code sets kilo_message_rx. `asks_for_uid_0`:
    the lines that do. `never_returns`: setup() or loop() if it never returns, with a line in it.

    KilotwinError if it does not build for the robot.
    """
    image = build_image(program)
    look = hashlib.sha256(Path(__file__).read_bytes()).hexdigest()[:8]
    file = cache_folder() / f"{image.key}-facts" / f"{look}.json"
    if file.exists():
        return dict(json.loads(file.read_text()))
    code, own = Disassembly.of(image), {str(source) for source in program.sources}
    facts = {
        "listens": _writes(code, own, "kilo_message_rx"),
        "asks_for_uid_0": [f"{at.file}:{at.line}" for at in compares_uid_with_zero(code, own)],
        "never_returns": [*_endless(program, code)],
    }
    file.parent.mkdir(parents=True, exist_ok=True)
    with draft_of(file, sync=False) as draft:
        draft.write_text(json.dumps(facts))
    return facts


def _writes(program: Disassembly, own: set[str], name: str) -> bool:
    addresses = {one.address for one in program.variables.values() if one.name == name}
    return any(
        one.name == "sts" and one.data_address in addresses
        for function in program.functions.values()
        for one in function.instructions
        if one.place is not None and one.place.file in own
    )


def _endless(program: Program, code: Disassembly) -> Iterator[tuple[str, str]]:
    """Names of setup() and loop(), as the program calls them, that have no way to their end, and
    the last line of the way that there is."""
    known: dict[str, Place | None] = {}
    if all(returns(code, name, known) for name in code.functions if name != "main"):
        return
    roles = find_roles(own_lines(program))
    for name in sorted(roles.setup | roles.loop):
        if name in code.functions and not returns(code, name, known):
            place = known[name]
            yield name, "" if place is None else f"{place.file}:{place.line}"


def returns(program: Disassembly, name: str, known: dict[str, Place | None]) -> bool:
    """Whether a function has a way to its end. `known` gets those that have none, with the line of
    the last instruction that they come to."""
    return _returns(program, name, known, frozenset())


def _returns(
    program: Disassembly, name: str, known: dict[str, Place | None], open_: frozenset[str]
) -> bool:
    if name in known:
        return False
    if name in open_ or name not in program.functions:
        return True
    function = program.functions[name]
    at = {one.address: index for index, one in enumerate(function.instructions)}
    waiting, seen = [at[function.entries[-1]]], set[int]()
    while waiting:
        index = waiting.pop()
        if index in seen:
            continue
        if index >= len(function.instructions):
            return True
        seen.add(index)
        instruction = function.instructions[index]
        target = instruction.target
        if instruction.name in ("ret", "reti", "ijmp"):
            return True
        goes_on = True
        if target is not None and target[0] in at:
            waiting.append(at[target[0]])
        elif target is not None and target[2]:
            goes_on = _returns(program, target[1], known, open_ | {name})
            if goes_on and instruction.ends:
                return True
        elif target is not None and instruction.ends:
            return True  # into the midst of another function, as parts of libgcc do
        if instruction.skips:
            waiting.append(index + 2)
        if goes_on and not instruction.ends:
            waiting.append(index + 1)
    known[name] = function.instructions[max(seen)].place
    return False


def compares_uid_with_zero(program: Disassembly, own: set[str]) -> Iterator[Place]:
    """Lines of the program's own code at which it tests whether its uid is 0."""
    at = next((one.address for one in program.variables.values() if one.name == _UID), None)
    if at is None:
        return
    copies = _copies(program, own, _Copies(frozenset({at}), frozenset({at + 1})))
    found: set[Place] = set()
    for function in program.functions.values():
        for index, instruction in enumerate(function.instructions):
            if instruction.name != "lds" or instruction.data_address not in copies.low:
                continue
            test = _test_of(function, index, copies)
            if test is not None and test.place is not None and test.place.file in own:
                found.add(test.place)
    yield from sorted(found, key=lambda place: (place.file, place.line))


def _copies(program: Disassembly, own: set[str], uid: _Copies) -> _Copies:
    """Those and the variables into which the program puts the uid and nothing else."""
    stored: dict[int, bool] = {}
    for function in program.functions.values():
        for index, instruction in enumerate(function.instructions):
            place, to = instruction.place, instruction.data_address
            if instruction.name != "sts" or to is None or place is None or place.file not in own:
                continue
            is_uid = instruction.operands.split(", ")[-1] in _held(function, index, uid)[0]
            stored[to] = stored.get(to, True) and is_uid
    low = {to for to, is_uid in stored.items() if is_uid}
    return _Copies(uid.low | low, uid.high | {to + 1 for to in low})


def _held(function: Function, end: int, copies: _Copies) -> tuple[set[str], set[str]]:
    """Registers that hold the lower and the upper byte of the uid before an instruction."""
    low: set[str] = set()
    high: set[str] = set()
    for instruction in function.instructions[max(end - _FAR, 0) : end]:
        _go_on(instruction, low, high, copies)
    return low, high


def _go_on(instruction: Instruction, low: set[str], high: set[str], copies: _Copies) -> None:
    name = instruction.name
    if name in _ENDS:
        low.clear()
        high.clear()
        return
    registers = _REGISTER.findall(instruction.operands)
    if not registers or name in _LEAVE_IT:
        return
    to = registers[0]
    pairs = [(to, registers[-1])]
    if name == "movw":
        pairs += [(f"r{int(to[1:]) + 1}", f"r{int(registers[-1][1:]) + 1}")]
    for target, source in pairs:
        for held, addresses in ((low, copies.low), (high, copies.high)):
            comes = name in ("mov", "movw") and source in held
            comes = comes or (name == "lds" and instruction.data_address in addresses)
            (held.add if comes else held.discard)(target)


def _test_of(function: Function, index: int, copies: _Copies) -> Instruction | None:
    """The instruction that tests whether a uid loaded at `index` is 0, if there is one near."""
    low: set[str] = set()
    high: set[str] = set()
    code = function.instructions[index : index + _FAR]
    for instruction, behind in zip(code, [*code[1:], None], strict=True):
        if instruction.name in _ENDS and instruction is not code[0]:
            return None
        if _tests(instruction, behind, low, high):
            return instruction
        _go_on(instruction, low, high, copies)
    return None


def _tests(
    instruction: Instruction, behind: Instruction | None, low: set[str], high: set[str]
) -> bool:
    """Whether the flags of an instruction, and that `behind` it, say that the uid is 0."""
    name = instruction.name
    registers = _REGISTER.findall(instruction.operands)
    left, right = (registers[0], registers[-1]) if registers else ("", "")
    if name == "or":
        return (left in low and right in high) or (left in high and right in low)
    if name == "sbiw":
        return left in low and instruction.operands.endswith("0x00")
    if name in ("and", "tst"):
        return left == right and left in low
    zero = {left, right} == {_ZERO, left if right == _ZERO else right}
    of_low = zero and _ZERO in (left, right) and bool({left, right} & low)
    if name == "cpse":
        return of_low
    if name == "cpi":
        return left in low and instruction.operands.endswith("0x00") and _is_whole(behind, high)
    return name == "cp" and of_low and _is_whole(behind, high)


def _is_whole(behind: Instruction | None, high: set[str]) -> bool:
    """Whether a comparison of the lower byte ends here, or goes on with an upper byte and 0."""
    if behind is None or behind.name != "cpc":
        return True
    registers = set(_REGISTER.findall(behind.operands))
    return _ZERO in registers and bool(registers & high)
