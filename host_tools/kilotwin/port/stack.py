"""How deep the stack can get: the longest chain of calls, and an interrupt on top of it."""

import re
from dataclasses import dataclass

from kilotwin.port.disassembly import Disassembly, Function
from kilotwin.port.roles import Roles

_RETURN_ADDRESS = 2
_FRAME = re.compile(r"r28, 0x([0-9A-Fa-f]+)")
_HIGH = re.compile(r"r29, 0x([0-9A-Fa-f]+)")


@dataclass(frozen=True)
class StackBound:
    """`bytes` None: there is none. `why`: the chain, or what makes it boundless."""

    bytes: int | None
    why: str


def bound(program: Disassembly, roles: Roles) -> StackBound:
    """Main program and the deepest interrupt: interrupts do not interrupt one another."""
    chains = _Chains(program, roles)
    try:
        main, main_chain = chains.deepest("main")
        vectors = [name for name in program.functions if re.fullmatch(r"__vector_\d+", name)]
        interrupts = [(chains.deepest(name), name) for name in vectors]
    except RecursionError as error:
        return StackBound(None, str(error))
    (interrupt, interrupt_chain), _ = max(interrupts, default=((0, []), ""))
    chain = " > ".join(main_chain)
    if interrupt_chain:
        chain += ", interrupted by " + " > ".join(interrupt_chain)
    return StackBound(main + interrupt, chain)


class _Chains:
    def __init__(self, program: Disassembly, roles: Roles) -> None:
        self._program = program
        self._roles = roles
        self._known: dict[str, tuple[int, list[str]]] = {}
        self._open: list[str] = []

    def deepest(self, name: str) -> tuple[int, list[str]]:
        """Bytes from its return address on, and the chain; RecursionError tells of a circle."""
        if name in self._known:
            return self._known[name]
        if name in self._open:
            circle = [*self._open[self._open.index(name) :], name]
            raise RecursionError("it calls itself: " + " > ".join(circle))
        function = self._program.functions.get(name)
        if function is None:
            return 0, []
        self._open.append(name)
        below = [self.deepest(callee) for callee in self._callees(function)]
        self._open.pop()
        depth, chain = max(below, key=lambda found: found[0], default=(0, []))
        self._known[name] = _frame(function) + depth, [name, *chain]
        return self._known[name]

    def _callees(self, function: Function) -> set[str]:
        callees = {callee for _, callee in function.calls}
        if function.calls_pointers:
            callees |= self._meant(function)
        return callees

    def _meant(self, function: Function) -> frozenset[str]:
        """Whom a call by address can mean: the API's know their part, a program's any other."""
        if function.name == "kilo_start":
            return self._roles.setup | self._roles.loop
        if function.name.startswith("__vector_"):
            return self._roles.in_interrupts
        return self._program.address_taken - self._roles.in_interrupts - self._roles.in_main


def _frame(function: Function) -> int:
    """From its instructions: what it pushes, and the frame it makes below the stack pointer."""
    size = _RETURN_ADDRESS
    for place, instruction in enumerate(function.instructions):
        if instruction.name == "push":
            size += 1
        elif instruction.name == "rcall" and instruction.operands == ".+0":
            size += _RETURN_ADDRESS  # makes room for two bytes
        elif instruction.name == "in" and instruction.operands.startswith("r28, 0x3d"):
            size += _made_room(function, place)
    return size


def _made_room(function: Function, place: int) -> int:
    """After `in r28, SPL`: what the next instructions take off it."""
    low = high = 0
    for instruction in function.instructions[place : place + 5]:
        found = _FRAME.search(instruction.operands)
        if instruction.name in ("sbiw", "subi") and found:
            low = int(found[1], 16)
        elif instruction.name == "sbci" and (found := _HIGH.search(instruction.operands)):
            high = int(found[1], 16)
    return low + 256 * high
