"""Variables that a robot's program only adds to, found in its machine code: counters of loop()'s
passes, and sums over them.

A pass of the main loop that changes nothing else repeats, as long as all that it asks of such a
variable comes out as before (emulator/robots/translated/passes/counters.h). So for each load of a
variable it is followed where its bytes go, over all ways that the code may take, until nothing
reads them any more. They may be added to, go back to the variable, and be compared with constants:
the numbers at which such a comparison changes are the variable's bounds. Where more is done with
them, a pass that comes there is not known to repeat.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, field

from kilotwin.programs.translate.instructions import Instruction
from kilotwin.programs.translate.liveness import followers
from kilotwin.programs.translate.registers import Function, live_registers
from kilotwin.programs.translate.taint import Bound, Part, State, UnknownError

MOST_BYTES = 16
"""All counters of a program, as in translated_pass_t."""
_MOST_BOUNDS = 24
_MOST_STEPS = 600
_ENDS = {"call", "rcall", "icall", "ret", "reti", "jmp", "rjmp", "ijmp", "brbs", "brbc"}


@dataclass(frozen=True)
class Counter:
    """A variable that is added to."""

    address: int
    bytes: int
    bounds: tuple[Bound, ...]
    adds: frozenset[int]
    """Addresses of `sts` that add to it."""
    others: frozenset[int]
    """Addresses of instructions that set it otherwise, or do more with it than its bounds say."""


@dataclass(frozen=True)
class _Access:
    """Loads or stores of one variable that follow each other."""

    variable: tuple[int, int]
    at: dict[int, int]
    """By byte of the variable, the instruction's address."""

    @property
    def begin(self) -> int:
        """Address of the first."""
        return min(self.at.values())

    @property
    def is_whole(self) -> bool:
        return len(self.at) == self.variable[1]


def find_counters(
    instructions: Mapping[int, Instruction],
    skipped_to: Callable[[Instruction], int],
    *,
    variables: Sequence[tuple[int, int]],
    functions: Sequence[Function],
    pointed: Set[int],
    live_flags: Mapping[int, int],
) -> list[Counter]:
    """Those among `variables`, addresses and sizes, in order of addresses.

    `functions` are C; `pointed` are addresses of code that a pointer may lead to; `live_flags` are
    those of liveness.py.
    """
    live = live_registers(instructions, skipped_to, functions)
    code = _Code(instructions, skipped_to, live_flags, live, functions, pointed)
    loads, stores = (list(_accesses(name, code, variables)) for name in ("lds", "sts"))
    for access in stores:
        for byte, at in access.at.items():
            code.stores[at] = byte
            code.store_of[at] = access.begin
    stored = {access.variable for access in stores if access.is_whole}
    alone = [_counter(variable, [variable], code, loads, stores) for variable in sorted(stored)]
    # A number that is added to one must be none itself.
    together = [(one.address, one.bytes) for one in alone if one is not None]
    counters: list[Counter] = []
    for variable in together:
        counter = _counter(variable, together, code, loads, stores)
        if counter is not None and sum(one.bytes for one in counters) + counter.bytes <= MOST_BYTES:
            counters.append(counter)
    return counters


def _accesses(name: str, code: "_Code", variables: Sequence[tuple[int, int]]) -> Iterator[_Access]:
    bytes_of = {
        address + byte: (address, size) for address, size in variables for byte in range(size)
    }
    open_ones: dict[tuple[int, int], _Access] = {}
    last: Instruction | None = None
    for at in sorted(code.instructions):
        instruction = code.instructions[at]
        if last is None or last.name in _ENDS or not code.only_follows(last, at):
            yield from open_ones.values()
            open_ones = {}
        last = instruction
        variable = bytes_of.get(instruction.k) if instruction.name == name else None
        if variable is None:
            continue
        byte = instruction.k - variable[0]
        if variable in open_ones and byte in open_ones[variable].at:
            yield open_ones.pop(variable)
        open_ones.setdefault(variable, _Access(variable, {})).at[byte] = at
    yield from open_ones.values()


def _counter(
    variable: tuple[int, int],
    watched: Sequence[tuple[int, int]],
    code: "_Code",
    loads: Sequence[_Access],
    stores: Sequence[_Access],
) -> Counter | None:
    """The variable, if something is known to add to it, but for others that are watched."""
    code.loads = {
        at: Part.of(access.begin, byte)
        for access in loads
        if access.variable in watched
        for byte, at in access.at.items()
    }
    walks = [_Walk(code, access) for access in loads if access.variable == variable]
    plain = {at for walk in walks for at in walk.adds}
    adds = {
        at
        for access in stores
        if access.variable == variable and access.is_whole and set(access.at.values()) <= plain
        for at in access.at.values()
    }
    bounds = {bound for walk in walks for bound in walk.bounds}
    if not adds or len(bounds) > _MOST_BOUNDS:
        return None
    address, size = variable
    others = {
        at
        for at, one in code.instructions.items()
        if one.name == "sts" and address <= one.k < address + size and at not in adds
    }
    others |= {at for walk in walks for at in walk.others}
    return Counter(address, size, tuple(sorted(bounds)), frozenset(adds), frozenset(others))


@dataclass
class _Code:
    instructions: Mapping[int, Instruction]
    skipped_to: Callable[[Instruction], int]
    live_flags: Mapping[int, int]
    live: Mapping[int, int]
    """Registers, by address."""
    functions: Sequence[Function]
    """Those that follow the calling convention."""
    pointed: Set[int]
    loads: dict[int, Part] = field(default_factory=dict)
    stores: dict[int, int] = field(default_factory=dict)
    """Bytes of their variables."""
    store_of: dict[int, int] = field(default_factory=dict)
    """The first one of those that store a variable together."""
    leads_here: dict[int, list[int]] = field(default_factory=dict)
    """Addresses that lead to an address, but for pointers and calls."""

    def __post_init__(self) -> None:
        for at, instruction in self.instructions.items():
            for follower in followers(instruction, self.skipped_to):
                self.leads_here.setdefault(follower, []).append(at)
        by_pointer = {
            function for function in self.functions if any(map(self._goes_far, self._in(function)))
        }
        self._entered = {function.begin for function in self.functions}
        self._entered |= {
            at
            for function in by_pointer
            for at in range(function.begin, function.end, 2)
            if at in self.pointed
        }

    def _in(self, function: Function) -> Iterator[Instruction]:
        for at in range(function.begin, function.end, 2):
            if at in self.instructions:
                yield self.instructions[at]

    def _goes_far(self, instruction: Instruction) -> bool:
        """Whether it may go to an address from a table, maybe by a function of libgcc."""
        if instruction.name == "ijmp":
            return True
        return instruction.name in ("jmp", "rjmp") and self.function_at(instruction.target) is None

    def function_at(self, at: int) -> Function | None:
        """The one that has an address."""
        return next((one for one in self.functions if one.begin <= at < one.end), None)

    def calls(self, instruction: Instruction) -> bool:
        """Whether a function is called, maybe as the last that this one does."""
        if instruction.name in ("jmp", "rjmp"):
            return any(one.begin == instruction.target for one in self.functions)
        return instruction.name in ("call", "rcall", "icall")

    def is_entered(self, at: int) -> bool:
        """Whether more may lead there than `leads_here` says."""
        return at in self._entered or self.function_at(at) is None

    def only_follows(self, last: Instruction, at: int) -> bool:
        """Whether nothing else leads to an address than the instruction before it."""
        return self.leads_here.get(at) == [last.address] and not self.is_entered(at)


class _Walk:
    """Ways that the bytes of one load go, as far as something may read them."""

    def __init__(self, code: _Code, access: _Access) -> None:
        self._code = code
        self._variable = access.variable
        self._base = access.begin
        self._last = max(access.at.values())
        self.adds: set[int] = set()
        """Addresses of stores to which nothing comes but the variable and what was added."""
        self.others: set[int] = set()
        """Addresses of instructions that do something else with it."""
        self._stored: dict[int, set[Part | None]] = {}
        """Values that come to the variable, by address of the store."""
        self._bounds: set[tuple[int, Bound]] = set()
        self._edges: set[tuple[int, int]] = set()
        self._left: set[tuple[int, int]] = set()
        """Edges of the flow with and without bytes of the variable."""
        if self._follow():
            self._check_stores()
        else:
            self.others = {self._base}

    @property
    def bounds(self) -> Iterator[Bound]:
        """Those of the variable."""
        return (bound for base, bound in self._bounds if base == self._base)

    def _follow(self) -> bool:
        """All ways; false if they are too many."""
        code = self._code
        open_ends = [(self._base, State())]
        done: set[tuple[int, object]] = set()
        while open_ends:
            at, state = open_ends.pop()
            key = (at, state.key())
            if key in done:
                continue
            done.add(key)
            if len(done) > _MOST_STEPS or at not in code.instructions:
                return False
            instruction = code.instructions[at]
            state = state.copy()
            try:
                self._step(instruction, state)
            except UnknownError:
                self.others.add(at)
                continue
            state.forget(code.live[at], code.live_flags[at])
            ahead = followers(instruction, code.skipped_to)
            goes_on = state.is_tainted or self._base <= at < self._last
            if goes_on and not ahead:
                self.others.add(at)
            (self._edges if goes_on else self._left).update((at, to) for to in ahead)
            if goes_on:
                open_ends += ((to, state) for to in ahead)
        return True

    def _step(self, instruction: Instruction, state: State) -> None:
        code, at = self._code, instruction.address
        if at in code.loads:
            state.load(instruction.d, code.loads[at])
        elif at in code.stores:
            self._store(instruction, state, code.stores[at])
        elif code.calls(instruction):
            follows = any(one.begin == instruction.target for one in code.functions)
            state.call(code.live[at], follows=follows)
        elif instruction.name == "ret" and code.function_at(at) is not None:
            state.leave()
        elif instruction.name not in ("ret", "reti", "ijmp", "jmp", "rjmp"):
            self._bounds |= state.execute(instruction)

    def _store(self, instruction: Instruction, state: State, byte: int) -> None:
        """Back to the variable; to another one is more than is known."""
        value = state.part(instruction.d)
        at = instruction.address
        is_own = instruction.k - byte == self._variable[0]
        if value is not None and not (is_own and value.base == self._base):
            raise UnknownError
        if is_own:
            is_whole = value is not None and value.is_byte(byte)
            self._stored.setdefault(at, set()).add(value if is_whole else None)

    def _check_stores(self) -> None:
        """The bytes of a store are of one sum, and nothing else comes to it."""
        sums: dict[int, Part] = {}  # by store, its highest byte so far
        for at, values in self._stored.items():
            value = next(iter(values))
            if len(values) > 1 or value is None or not self._comes_from_load(at):
                continue
            store = self._code.store_of[at]
            low, high = sorted((value, sums.get(store, value)), key=lambda part: part.low)
            mask = (1 << 8 * (low.low + 1)) - 1
            if low.addends == high.addends and (low.offset ^ high.offset) & mask == 0:
                sums[store] = high
                self.adds.add(at)

    def _comes_from_load(self, at: int) -> bool:
        """Whether each way to an address leads from the load, with its bytes, or from where more is
        done with it."""
        open_ends, done = [at], {self._last}
        while open_ends:
            here = open_ends.pop()
            if here in done:
                continue
            done.add(here)
            before = set(self._code.leads_here.get(here, ())) - self.others
            edges = {(one, here) for one in before}
            is_followed = here in self._code.leads_here and edges <= self._edges - self._left
            if not is_followed or self._code.is_entered(here):
                return False
            open_ends += before
        return True
