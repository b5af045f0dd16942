"""How deep the stack can get: the longest chain of calls, and an interrupt on top of it.

The machine code is followed from a function's entry wherever it jumps, also into others: into one
that is called last, or into libgcc's common prologue and epilogue.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

from kilotwin.programs.port.disassembly import Disassembly, Located, Place
from kilotwin.programs.port.roles import Roles
from kilotwin.programs.port.stack_pointer import State, UnknownStackPointerError

_RETURN_ADDRESS = 2
_RESET = 0
_SWITCH = "__tablejump2__"  # goes where a table says, in the function that jumps to it
# So often the stack may be found deeper at an instruction than before; then it has no end.
_TIMES_DEEPER = 50


@dataclass(frozen=True)
class StackBound:
    """`bytes` None: there is none. `why`: the chain, or what makes it boundless; `do`: the cure."""

    bytes: int | None
    why: str
    do: str = ""
    place: Place | None = None
    """Place that makes it boundless, where it is known."""


class _BoundlessError(Exception):
    def __init__(self, why: str, do: str, place: Place | None = None) -> None:
        super().__init__(why)
        self.bound = StackBound(None, why, do, place)


def bound(program: Disassembly, roles: Roles) -> StackBound:
    """Main program and the deepest interrupt: interrupts do not interrupt one another."""
    chains = _Chains(program, roles)
    try:
        main = chains.deepest_of("main")
        vectors = [name for name in program.functions if re.fullmatch(r"__vector_\d+", name)]
        interrupts = [chains.deepest_of(name) for name in vectors]
    except _BoundlessError as boundless:
        return boundless.bound
    interrupt = max(interrupts, key=lambda call: call.bytes, default=_Call(0, ()))
    chain = " > ".join(main.chain)
    if interrupt.chain:
        chain += ", interrupted by " + " > ".join(interrupt.chain)
    return StackBound(main.bytes + interrupt.bytes, chain)


@dataclass(frozen=True)
class _Call:
    """Depth of a function: bytes from its return address on, and how it gets there."""

    bytes: int
    chain: tuple[str, ...]
    returns: bool = True


class _Chains:
    def __init__(self, program: Disassembly, roles: Roles) -> None:
        self._program = program
        self._roles = roles
        self._known: dict[int, _Call] = {}
        self._open: list[int] = []

    def deepest_of(self, name: str) -> _Call:
        """Deepest call of the function `name`; _BoundlessError."""
        calls = [self.deepest(entry) for entry in self._entries(name)]
        return max(calls, key=lambda call: call.bytes, default=_Call(0, ()))

    def deepest(self, entry: int) -> _Call:
        """Deepest call of the function at the address `entry`; _BoundlessError."""
        if entry in self._known:
            return self._known[entry]
        if entry in self._open:
            circle = [*self._open[self._open.index(entry) :], entry]
            names = " > ".join(self._program.code[address].function for address in circle)
            raise _BoundlessError(f"it calls itself: {names}", "write the recursion as a loop")
        if entry not in self._program.code:
            return _Call(0, ())
        self._open.append(entry)
        self._known[entry] = _Way(self, self._program, entry).call()
        self._open.pop()
        return self._known[entry]

    def meant(self, function: str) -> Iterator[int]:
        """Functions that a call by address can reach: by role in the API, else any one."""
        program, roles = self._program, self._roles
        registered = roles.in_interrupts | roles.in_main
        if function == "kilo_start":
            names = roles.setup | roles.loop
        elif function.startswith("__vector_"):
            names = roles.in_interrupts | program.runtime_callbacks
        elif function == "fputc":
            names = program.stream_functions - registered
        else:
            names = program.address_taken - registered
        for name in sorted(names):
            yield from self._entries(name)

    def _entries(self, name: str) -> list[int]:
        function = self._program.functions.get(name)
        return function.entries if function else []


class _Way:
    """Through a function, from its entry to all its ends."""

    def __init__(self, chains: _Chains, program: Disassembly, entry: int) -> None:
        self._chains = chains
        self._code = program.code
        self._entry = entry
        self._name = self._code[entry].function
        self._before: dict[int, State] = {}
        self._deeper: dict[int, int] = {}
        self._waiting: list[int] = []
        self._switches: dict[int, State] = {}
        self._deepest = _Call(_RETURN_ADDRESS, (self._name,))
        self._returns = False

    def call(self) -> _Call:
        """Bytes that it takes; _BoundlessError."""
        self._reach(self._entry, State(_RETURN_ADDRESS))
        while self._waiting or self._reach_cases():
            self._pass(self._waiting.pop())
        return _Call(self._deepest.bytes, self._deepest.chain, self._returns)

    def _reach(self, address: int, state: State) -> None:
        if address == _RESET or address not in self._code:
            return
        before = self._before.get(address)
        if before is not None:
            state = state.joined(before)
            if state == before:
                return
            if state.depth > before.depth:
                self._deeper[address] = self._deeper.get(address, 0) + 1
                if self._deeper[address] > _TIMES_DEEPER:
                    raise self._boundless(address)
        self._before[address] = state
        self._waiting.append(address)

    def _pass(self, address: int) -> None:
        here, state = self._code[address], self._before[address]
        instruction, target = here.instruction, here.instruction.target
        if target is not None and target[0] == here.next and instruction.name == "rcall":
            # Nothing is called: it makes room for two bytes.
            state = replace(state, depth=state.depth + _RETURN_ADDRESS)
            self._take(state.depth, here.function)
            self._reach(here.next, state)
            return
        if instruction.name in ("call", "rcall", "icall"):
            if self._calls(here, state):
                self._reach(here.next, state.after_call())
            return
        try:
            state = state.after(instruction)
        except UnknownStackPointerError:
            raise self._boundless(address) from None
        self._take(state.depth, here.function)
        if instruction.name == "ijmp":
            self._goes_by_address(here, state)
        elif target is not None and target[1] == _SWITCH:
            self._switches[here.start] = state.joined(self._switches.get(here.start, state))
        else:
            self._returns |= instruction.name in ("ret", "reti")
            if not instruction.ends:
                self._reach(here.next, state)
            if instruction.skips and here.next in self._code:
                self._reach(self._code[here.next].next, state)
            if target is not None:
                self._reach(target[0], state)

    def _calls(self, here: Located, state: State) -> bool:
        """Whether one that is called comes back."""
        if here.instruction.target is not None:
            meant = [here.instruction.target[0]]
        else:
            meant = [state.z] if state.z is not None else list(self._chains.meant(here.function))
        calls = [self._chains.deepest(entry) for entry in meant if entry != _RESET]
        if not calls:
            self._take(state.depth + _RETURN_ADDRESS, here.function)
        for call in calls:
            self._take(state.depth + call.bytes, here.function, call.chain)
        return not meant or any(call.returns for call in calls)

    def _goes_by_address(self, here: Located, state: State) -> None:
        """A way back, a place within the function, or another function in its place."""
        if state.z is not None:
            self._reach(state.z, state)
        elif state.depth < _RETURN_ADDRESS:
            self._returns = True  # by the return address that it took off the stack
        elif not state.restored:
            self._switches[here.start] = state.joined(self._switches.get(here.start, state))
            self._returns = True
            for entry in self._chains.meant(here.function):
                call = self._chains.deepest(entry)
                self._take(state.depth - _RETURN_ADDRESS + call.bytes, here.function, call.chain)

    def _reach_cases(self) -> bool:
        """Reaches the next case of a switch that nothing else leads to; False if there is none."""
        for start, state in self._switches.items():
            address = start
            while address in self._code and self._code[address].start == start:
                if address not in self._before:
                    self._reach(address, state)
                    return True
                address = self._code[address].next
        return False

    def _take(self, depth: int, function: str, below: tuple[str, ...] = ()) -> None:
        through = () if function == self._name else (function,)
        chain = (self._name, *through, *below)
        # The shorter one: a frame may be made elsewhere.
        if (depth, -len(chain)) > (self._deepest.bytes, -len(self._deepest.chain)):
            self._deepest = _Call(depth, chain)

    def _boundless(self, address: int) -> _BoundlessError:
        here = self._code[address]
        return _BoundlessError(
            f"how much {here.function}() takes is known only when it runs, as of an array of "
            "variable length or alloca()",
            "give the array a fixed length, the largest that is needed",
            here.instruction.place,
        )
