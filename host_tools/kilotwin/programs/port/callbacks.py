"""Data that callbacks share with setup() and loop(): messages in the making, variables not set."""

import re
from collections.abc import Iterator, Sequence

from kilotwin.programs.port.disassembly import Disassembly, Function, Instruction, Place, Variable
from kilotwin.programs.port.findings import Finding, Weight
from kilotwin.programs.port.roles import Line, Roles

_MESSAGE = re.compile(r"\b(?:IR_)?message_t\s+(\w+)\s*[;=,]")
_FILLED = re.compile(r"\b(\w+)\s*\.\s*(?:data\s*\[[^\]]*\]|type|crc)\s*(?:<<|>>|[-+*/%&|^])?=(?!=)")
_ZERO = "r1"  # a register that always holds 0
_ZERO_TESTS = {"and", "tst", "sbrs", "sbrc", "cpse"}


def before_setup(program: Disassembly, roles: Roles) -> Iterator[Finding]:
    """Variables that setup() gives a first value and a message may meet before that.

    The robot hands messages to a callback that main() has set while it still waits for RUN. Where
    the callback first asks whether setup() has been there, that is no trap.
    """
    if not _stores(program, program.reached_from({"main"}), "kilo_message_rx"):
        return
    set_up = {
        variable.address: (instruction, variable)
        for instruction, variable in _accesses(program, program.reached_from(roles.setup), "sts")
        if variable.address >= program.bss_begin and not _is_zero(instruction)
    }
    used: set[int] = set()
    asked: set[int] = set()
    for name in program.reached_from(roles.callbacks["rx"]):
        function = program.functions[name]
        for instruction, variable in _accesses(program, {name}, "lds"):
            (asked if _asks_for_zero(function, instruction) else used).add(variable.address)
    if asked & set_up.keys():
        return
    callback = min(roles.callbacks["rx"], default="")
    for address in sorted(used & set_up.keys()):
        instruction, variable = set_up[address]
        name = variable.name.split(".")[0]
        yield Finding(
            "before-setup",
            Weight.WARNS,
            f"{callback}() may be called before setup() has set {name}: messages reach a robot "
            "that waits for RUN",
            f"give {name} its value where it is declared, or set kilo_message_rx in setup()",
            instruction.place,
        )


def messages(program: Disassembly, roles: Roles, lines: Sequence[Line]) -> Iterator[Finding]:
    """A message that loop() fills in while the transmit interrupt may take it.

    Where loop() also sets a variable that the callback looks at, that is taken for a lock.
    """
    sends = program.reached_from(roles.callbacks["tx"])
    looked_at = {variable.address for _, variable in _accesses(program, sends, "lds")}
    declared = {name for line in lines for name in _MESSAGE.findall(line.text)}
    in_callback = _places(program, sends)
    handed_out = {
        name: line.place.line
        for name in declared
        for line in lines
        if line.place in in_callback and re.search(rf"&\s*{name}\b", line.text)
    }
    for name in sorted(program.reached_from(roles.loop) - sends):
        if any(variable.address in looked_at for _, variable in _accesses(program, {name}, "sts")):
            continue
        open_ = _places(program, {name}, but_uninterrupted=True)
        for line in lines:
            filled = set(_FILLED.findall(line.text)) & handed_out.keys()
            if line.place in open_ and filled:
                message = min(filled)
                yield Finding(
                    "message-race",
                    Weight.WARNS,
                    f"{message} is filled in here while the transmit interrupt may take it in line "
                    f"{handed_out[message]}: robots drop a message that is half old and half new",
                    f"fill in another message_t and copy it to {message} between cli() and sei(), "
                    "or have the callback return 0 meanwhile",
                    line.place,
                )


def _accesses(
    program: Disassembly, names: set[str], how: str
) -> Iterator[tuple[Instruction, Variable]]:
    """Direct reads (lds) or writes (sts) of variables, in the program's own lines."""
    for name in sorted(names):
        for instruction in program.functions[name].instructions:
            if instruction.name == how and instruction.data_address is not None:
                variable = program.variable_at(instruction.data_address)
                if variable is not None and instruction.place is not None:
                    yield instruction, variable


def _stores(program: Disassembly, names: set[str], variable: str) -> bool:
    return any(found.name == variable for _, found in _accesses(program, names, "sts"))


def _places(
    program: Disassembly, names: set[str], *, but_uninterrupted: bool = False
) -> set[Place]:
    """Source lines of these functions, inlined ones too."""
    found = set()
    for name in names:
        function = program.functions[name]
        off = function.uninterrupted if but_uninterrupted else set()
        for instruction in function.instructions:
            if instruction.place is not None and instruction.address not in off:
                found.add(instruction.place)
    return found


def _is_zero(store: Instruction) -> bool:
    return store.operands.replace(" ", "").endswith(f",{_ZERO}")


def _asks_for_zero(function: Function, load: Instruction) -> bool:
    """Whether what is loaded is only compared with 0: the next instruction that uses it does so."""
    register = load.operands.partition(",")[0]
    behind = function.instructions[function.instructions.index(load) + 1 :]
    for instruction in behind:
        operands = instruction.operands.replace(" ", "").split(",")
        if register in operands:
            return instruction.name in _ZERO_TESTS or (
                instruction.name == "cpi" and operands[1] == "0x00"
            )
    return False
