"""Checks on the linked program: size, stack, what interrupts do and share with the rest."""

import re
from collections.abc import Iterator, Sequence

from kilotwin.programs.image.image_size import FLASH_BYTES, RAM_BYTES
from kilotwin.programs.port.disassembly import Disassembly, Function, Instruction, Place, Variable
from kilotwin.programs.port.findings import Finding, Weight
from kilotwin.programs.port.roles import Line, Roles
from kilotwin.programs.port.stack import StackBound

STACK_RESERVE = 64  # for what the static bound cannot know, as an interrupt's first pushes
SCANT_BYTES = 300
"""Room for the stack below which the largest array is named: the runtime and a few calls with
floating point take half of it."""

# Floating point on the AVR: hundreds to thousands of cycles each.
_FLOATS = {
    *("__addsf3", "__subsf3", "__mulsf3", "__divsf3", "__floatsisf", "__floatunsisf", "__fixsfsi"),
    *("__fixunssfsi", "__cmpsf2", "__gesf2", "__gtsf2", "__lesf2", "__ltsf2", "__nesf2"),
    *("sqrt", "sin", "cos", "tan", "atan", "atan2", "exp", "log", "log10", "pow", "fmod"),
    *("floor", "ceil", "round", "asin", "acos", "hypot"),
}
_SLOW = {"delay": "delay()", "spinup_motors": "spinup_motors()", "rand_hard": "rand_hard()"}
_TICKS = "kilo_ticks"
_SCALARS = (2, 4, 8)
# A loop that reads a variable until two readings agree is no longer, in instructions.
_NEAR = 64
# Two accesses to bytes of a variable belong together where fewer instructions come in between.
_ADJACENT = 3


def size(program: Disassembly, stack: StackBound) -> Iterator[Finding]:
    """Flash and RAM, with the deepest stack there can be."""
    if program.flash_bytes > FLASH_BYTES:
        yield Finding(
            "flash",
            Weight.FAILS,
            f"the program has {program.flash_bytes:,} bytes; the robot takes {FLASH_BYTES:,}",
            "leave out floating point, printf and tables, or put them into fewer, smaller parts",
        )
    left = RAM_BYTES - program.ram_bytes
    if stack.bytes is None:
        yield Finding(
            "stack",
            Weight.WARNS if left > 0 else Weight.FAILS,
            f"the stack has no bound: {stack.why}; {max(left, 0):,} bytes are left for it",
            stack.do,
            stack.place,
        )
    elif stack.bytes + STACK_RESERVE > left:
        fits = stack.bytes <= left
        yield Finding(
            "stack",
            Weight.WARNS if fits else Weight.FAILS,
            f"variables take {program.ram_bytes:,} of {RAM_BYTES:,} bytes, the deepest stack "
            f"{stack.bytes:,} ({stack.why}); {left - stack.bytes:,} bytes are left",
            "make arrays smaller or of smaller types, or calls less deep",
        )


def scant_memory(program: Disassembly, lines: Sequence[Line]) -> Iterator[Finding]:
    """The array without which there would be room for a stack. `lines`: the program's own."""
    left = RAM_BYTES - program.ram_bytes
    largest = max(program.variables.values(), key=lambda one: one.size, default=None)
    if largest is None or left >= SCANT_BYTES or left + largest.size < SCANT_BYTES:
        return
    name = largest.name.partition(".")[0]
    declared = re.compile(rf"\b{re.escape(name)}\s*(?:\[[^\]]*\]\s*)+[=;,]")
    place = next((line.place for line in lines if declared.search(line.text)), None)
    if place is not None:
        yield Finding(
            "stack",
            Weight.WARNS,
            f"{name} takes {largest.size:,} of {RAM_BYTES:,} bytes of RAM, which leaves "
            f"{max(left, 0):,} for the stack",
            "use a smaller type, as uint8_t or a bit for each element, or fewer of them",
            place,
        )


def interrupts(program: Disassembly, roles: Roles) -> Iterator[Finding]:
    """Calls that callbacks must not make: interrupts are off, and the clock stands meanwhile."""
    reached = program.reached_from(roles.in_interrupts)
    for name in sorted(reached):
        for instruction, callee in program.functions[name].calls:
            if instruction.place is None:
                continue
            if callee in _FLOATS:
                yield Finding(
                    "float-in-interrupt",
                    Weight.WARNS,
                    f"floating point in {name}(), which an interrupt calls",
                    "count in integers here, or note the numbers and compute in loop()",
                    instruction.place,
                )
            elif callee in _SLOW:
                yield Finding(
                    "slow-interrupt",
                    Weight.WARNS,
                    f"{_SLOW[callee]} in {name}(), which an interrupt calls: ticks and messages "
                    "are lost meanwhile",
                    "set a flag here, and wait in loop()",
                    instruction.place,
                )


def sends_nothing(program: Disassembly, name: str) -> bool:
    """Whether a transmit callback returns NULL on every way: each `ret` has zeros before it, and it
    does not go over into another function."""
    if name not in program.functions:
        return False
    code = program.functions[name].instructions
    entry = code[0].address
    leaves = any(
        one.name in ("jmp", "rjmp")
        and one.target
        and not entry <= one.target[0] <= code[-1].address
        for one in code
    )
    ends = [index for index, instruction in enumerate(code) if instruction.name == "ret"]
    return not leaves and bool(ends) and all(_returns_zero(code, end) for end in ends)


def _returns_zero(code: list[Instruction], end: int) -> bool:
    """Whether both registers of a result get 0 before `end`, with no way to come in between."""
    targets = {one.target[0] for one in code if one.target and one.name not in ("call", "rcall")}
    left = {"r24", "r25"}
    for instruction in reversed(code[:end]):
        register = instruction.operands.partition(",")[0]
        if register in left:
            if instruction.name != "ldi" or not instruction.operands.endswith("0x00"):
                return False
            left.remove(register)
        if not left:
            return True
        if instruction.ends or instruction.address in targets or instruction.name[:2] == "br":
            return False
    return False


def torn(program: Disassembly, roles: Roles) -> Iterator[Finding]:
    """Variables of several bytes that an interrupt can change between two of them."""
    inside = program.reached_from(roles.in_interrupts)
    outside = program.reached_from(roles.in_main) - inside
    written_inside = _accesses(program, inside, "sts")
    touched_inside = {**_accesses(program, inside, "lds"), **written_inside}
    for name in sorted(outside):
        function = program.functions[name]
        for variable, group in _groups(program, function):
            if all(instruction.address in function.uninterrupted for instruction in group):
                continue
            reads = group[0].name == "lds"
            if variable.name == _TICKS:
                bad = reads and not _compared(function, group)
                changed_by = "the tick's interrupt"
            else:
                changes = variable.address in (written_inside if reads else touched_inside)
                bad = changes and not (reads and _compared(function, group))
                changed_by = _where(touched_inside.get(variable.address))
            if bad:
                yield _torn(variable, group[-1], reads, changed_by)


def _torn(variable: Variable, at: Instruction, reads: bool, changed_by: str) -> Finding:
    how = "read" if reads else "written"
    other = "writes" if reads else "uses"
    name = variable.name.split(".")[0]
    return Finding(
        "torn-access",
        Weight.WARNS,
        f"{name} has {variable.size} bytes and is {how} here one by one; {changed_by} {other} it "
        "in between now and then",
        f"read {name} until two readings agree, or do it between cli() and sei()"
        if reads
        else f"write {name} between cli() and sei()",
        at.place,
    )


_Access = tuple[str, Place | None]  # the function, and the line


def _accesses(program: Disassembly, names: set[str], how: str) -> dict[int, _Access]:
    """By address, variables that these functions read (lds) or write (sts), and where first."""
    found: dict[int, _Access] = {}
    for name in sorted(names):
        for instruction in program.functions[name].instructions:
            if instruction.name == how and instruction.data_address is not None:
                variable = program.variable_at(instruction.data_address)
                if variable is not None:
                    found.setdefault(variable.address, (name, instruction.place))
    return found


def _where(access: _Access | None) -> str:
    if access is None or access[1] is None:
        return "a callback"
    return f"{access[0]}() in line {access[1].line}"


def _groups(
    program: Disassembly, function: Function
) -> Iterator[tuple[Variable, list[Instruction]]]:
    """Accesses to the bytes of one scalar, one source line at a time. The linker shortens code, so
    that the line of the first may be that of the statement before."""
    groups: dict[tuple[int, str, Place], list[Instruction]] = {}
    latest: dict[tuple[int, str], tuple[int, Place]] = {}
    for at, instruction in enumerate(function.instructions):
        if instruction.data_address is None or instruction.place is None:
            continue
        variable = program.variable_at(instruction.data_address)
        if variable is None or variable.size not in _SCALARS:
            continue
        access = variable.address, instruction.name
        before, place = latest.get(access, (at, instruction.place))
        group = groups.get((*access, place), [])
        repeats = any(other.data_address == instruction.data_address for other in group)
        if at - before >= _ADJACENT or repeats:
            place = instruction.place
        groups.setdefault((*access, place), []).append(instruction)
        latest[access] = at, place
    for (address, _, _), group in groups.items():
        if len({instruction.data_address for instruction in group}) > 1:
            yield program.variables[address], group


def _compared(function: Function, group: list[Instruction]) -> bool:
    """Whether a loop close by reads the variable until two readings agree.

    Such a loop ends in a comparison of several bytes (cpc) and a branch back to before a read.
    """
    code = function.instructions
    begin, end = code.index(group[0]), code.index(group[-1])
    for place in range(begin, min(end + _NEAR, len(code))):
        branch = code[place]
        if not branch.name.startswith("br") or code[place - 1].name != "cpc" or not branch.target:
            continue
        again = [other for other in code[:place] if other.address >= branch.target[0]]
        reads = any(
            other.name == "lds" and other.data_address == group[0].data_address for other in again
        )
        # With an end in between the way back is to one that several branches share.
        if reads and not any(other.ends for other in again):
            return True
    return False
