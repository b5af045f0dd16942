"""A variable that is added to has bounds: numbers at which a branch of its code may go another way.
All that code here does is held against each value of the variable."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import pytest

from kilotwin.programs.translate.counters import Counter, find_counters
from kilotwin.programs.translate.instructions import Instruction
from kilotwin.programs.translate.liveness import live_flags
from kilotwin.programs.translate.registers import Function

C, Z, N, V, S, H, T = range(7)
COUNTER, OTHER = 0x200, 0x300
LONG = ("lds", "sts", "call", "jmp")
Line = tuple[str, int, int, int]
"""Name, d, r, k; of a branch k is the flag, and it goes on with the next line but one."""


def line(name: str, d: int = 0, r: int = 0, k: int = 0) -> Line:
    return name, d, r, k


def load(registers: list[int], at: int = COUNTER) -> list[Line]:
    return [line("lds", d, k=at + byte) for byte, d in enumerate(registers)]


def store(registers: list[int], at: int = COUNTER) -> list[Line]:
    return [line("sts", d, k=at + byte) for byte, d in enumerate(registers)]


def assembled(lines: list[Line]) -> dict[int, Instruction]:
    places = [0]
    for name, *_ in lines:
        places.append(places[-1] + (4 if name in LONG else 2))
    places.append(places[-1])
    return {
        at: Instruction(at, name, d, r, k, places[number + 2], 2 if name in LONG else 1)
        for number, (at, (name, d, r, k)) in enumerate(zip(places, lines, strict=False))
    }


def found(
    lines: list[Line], size: int, *, returns: bool = False, pointed: frozenset[int] = frozenset()
) -> Counter | None:
    """The counter of that size in a function of these lines."""
    code = assembled([*lines, line("ret")])
    return counter_of(code, [Function(0, max(code) + 2, returns)], size, pointed)


def counter_of(
    code: dict[int, Instruction],
    functions: list[Function],
    size: int = 2,
    pointed: frozenset[int] = frozenset(),
) -> Counter | None:
    def skipped_to(skip: Instruction) -> int:
        return code[skip.end].end

    counters = find_counters(
        code,
        skipped_to,
        variables=[(COUNTER, size)],
        functions=functions,
        pointed=pointed,
        live_flags=live_flags(code, skipped_to),
    )
    return counters[0] if counters else None


WORD = [24, 25]
COUNT_WORD = [*load(WORD), line("adiw", 24, k=1), *store(WORD)]


class Chip:
    """Registers and flags, for instructions that these tests have."""

    def __init__(self, value: int) -> None:
        self.registers = dict.fromkeys(range(32), 0)
        self.flags = dict.fromkeys(range(8), 0)
        self.data = {COUNTER + byte: value >> 8 * byte & 0xFF for byte in range(4)}
        self.asked: list[int] = []
        """Outcomes of branches and skips."""

    def run(self, lines: list[Line]) -> list[int]:
        skips = False
        for name, d, r, k in lines:
            skips = not skips and self._execute(name, d, r, k)
        return self.asked

    def _execute(self, name: str, d: int, r: int, k: int) -> bool:
        a, b = self.registers[d], self.registers[r]
        if name == "lds":
            self.registers[d] = self.data[k]
        elif name == "sts":
            self.data[k] = a
        elif name in ("ldi", "mov"):
            self.registers[d] = k if name == "ldi" else b
        elif name in ("brbs", "sbrc"):
            self.asked.append(self.flags[k] if name == "brbs" else a >> k & 1)
            return name == "sbrc" and not self.asked[-1]
        elif name in ("and", "andi", "or"):
            operand = k if name == "andi" else b
            self._bits(d, a | operand if name == "or" else a & operand)
        elif name == "adiw":
            self._sum(d, k, 0, sign=1, keeps=True)
            low = self.flags[Z]
            self._sum(d + 1, 0, self.flags[C], sign=1, keeps=True)
            self.flags[Z] &= low
        elif name in ("inc", "dec"):
            carry = self.flags[C]
            self._sum(d, 1, 0, sign=1 if name == "inc" else -1, keeps=True)
            self.flags[C] = carry
        else:
            operand = k if name in ("subi", "sbci", "cpi") else b
            takes = name in ("adc", "sbc", "sbci", "cpc")
            zero = self.flags[Z]
            sign = 1 if name in ("add", "adc") else -1
            keeps = not name.startswith("cp")
            self._sum(d, operand, self.flags[C] if takes else 0, sign=sign, keeps=keeps)
            if takes and sign < 0:
                self.flags[Z] &= zero
        return False

    def _bits(self, d: int, result: int) -> None:
        self.registers[d] = result
        negative = result >> 7
        self.flags |= {Z: result == 0, N: negative, V: 0, S: negative}

    def _sum(self, d: int, operand: int, carry: int, *, sign: int, keeps: bool) -> None:
        a = self.registers[d]
        total = a + sign * (operand + carry)
        signed = (a ^ 128) - 128 + sign * ((operand ^ 128) - 128 + carry)
        negative = total >> 7 & 1
        self.flags |= {C: total >> 8 & 1, Z: total & 0xFF == 0, N: negative, S: signed < 0}
        self.flags[V] = negative ^ self.flags[S]
        if keeps:
            self.registers[d] = total & 0xFF


def crossed(counter: Counter, value: int) -> bool:
    """Whether a bound lies between the value before and this one."""
    return any((value - at) % (1 << bits) == 0 for bits, at in counter.bounds)


def check_bounds(counter: Counter, lines: list[Line]) -> None:
    """For each value that a byte of constants may make a difference to."""
    values = {high << 8 | low for high in range(256) for low in (0, 1)}
    values |= {*range(300), *range(0x3E0, 0x408), *range(0x7FE0, 0x8020), *range(0xFE00, 0x10000)}
    for value in values:
        is_same = Chip(value).run(lines) == Chip(value - 1).run(lines)
        at = (value - 1) & 0xFFFF
        assert is_same or crossed(counter, value), (lines, at)


def questions() -> Iterator[list[Line]]:
    """Comparisons of a word in r24 and r25, each to be followed by a branch on the flag."""
    for high, low in ((0, 0), (0, 1), (1, 0), (3, 0xE8), (0x80, 5), (0xFF, 0xFE)):
        constant = [line("ldi", 18, k=high)]
        yield [*constant, line("cpi", 24, k=low), line("cpc", 25, 18)]
        yield [line("subi", 24, k=low), line("sbci", 25, k=high)]
        yield [line("cpi", 25, k=high)]
        yield [line("ldi", 19, k=low), *constant, line("add", 24, 19), line("adc", 25, 18)]
    for mask in (1, 7, 0x80, 0x30, 0xFF, 0x18):
        yield [line("andi", 24, k=mask)]
        yield [line("andi", 25, k=mask)]
        yield [line("andi", 25, k=mask), line("or", 24, 25)]
        yield [line("andi", 24, k=mask), line("cpi", 24, k=3)]
        yield [line("ldi", 18, k=mask), line("and", 18, 25)]
    yield [line("or", 25, 24)]
    yield [line("and", 25, 25)]
    yield [line("inc", 24)]
    yield [line("dec", 24)]
    yield [line("mov", 20, 24), line("cpi", 20, k=100)]


@pytest.mark.parametrize("flag", [C, Z, N, V, S])
def test_branches_come_out_the_same_between_bounds(flag: int) -> None:
    known = 0
    for question in questions():
        lines = [*COUNT_WORD, *question, line("brbs", k=flag), line("ldi", 20)]
        counter = found(lines, 2)
        assert counter is not None
        if counter.others:
            continue  # then passes that ask so are executed
        known += 1
        check_bounds(counter, lines)
    assert known > 15


@pytest.mark.parametrize(("register", "bit"), list(product(WORD, range(8))))
def test_skips_by_a_bit_come_out_the_same_between_bounds(register: int, bit: int) -> None:
    lines = [*COUNT_WORD, line("sbrc", register, k=bit), line("ldi", 20), line("ldi", 21)]
    counter = found(lines, 2)
    assert counter is not None
    check_bounds(counter, lines)


def test_a_comparison_before_an_addition_and_one_behind_it_have_their_own_bounds() -> None:
    asks = [line("ldi", 18, k=1), line("cpi", 24, k=0xF4), line("cpc", 25, 18)]
    branch = [line("brbs", k=C), line("ldi", 20)]
    lines = [*load(WORD), *asks, *branch, *COUNT_WORD, *asks, *branch]
    counter = found(lines, 2)
    assert counter is not None
    assert counter.bounds == ((16, 0), (16, 499), (16, 500), (16, 65535))


def test_a_variable_that_others_are_added_to_is_a_sum() -> None:
    add = [line("add", 24, 18), line("adc", 25, 19)]
    counter = found([*load([18, 19], OTHER), *load(WORD), *add, *store(WORD)], 2)
    assert counter is not None
    assert (len(counter.adds), counter.others, counter.bounds) == (2, frozenset(), ())


def is_counter(lines: list[Line], size: int = 2, *, returns: bool = False) -> bool:
    counter = found(lines, size, returns=returns)
    return counter is not None and not counter.others


def test_what_leads_out_of_registers_is_more_than_counting() -> None:
    assert is_counter(COUNT_WORD)
    for name, d, r in (
        ("push", 24, 0),
        ("out", 24, 0),
        ("st", 24, 30),
        ("st", 20, 24),
        ("ld", 20, 24),
        ("bst", 26, 0),
    ):
        more = [line("mov", 26, 24), line("lsr", 26), line(name, d, r)]
        assert not is_counter([*COUNT_WORD, *more]), name
    assert not is_counter([*COUNT_WORD, *store([24], OTHER)])


def test_a_result_counts_as_read() -> None:
    assert not is_counter(COUNT_WORD, returns=True)
    assert is_counter([*COUNT_WORD, line("ldi", 24), line("ldi", 25)], returns=True)


def test_passes_are_known_up_to_where_more_is_done() -> None:
    """The store may be reached from there as well."""
    ask = [line("cpi", 24, k=9), line("brbs", k=Z), line("push", 25)]
    lines = [*load(WORD), *ask, line("adiw", 24, k=1), *store(WORD)]
    counter = found(lines, 2)
    assert counter is not None
    assert counter.others == {12}
    assert len(counter.adds) == 2


def test_a_sum_that_a_branch_asks_for_has_no_bounds() -> None:
    branch = [line("brbs", k=C), line("ldi", 20)]
    assert not is_counter([*load([24]), line("add", 24, 18), *store([24]), *branch], size=1)


def test_a_store_of_a_part_or_of_parts_of_two_sums_does_not_add() -> None:
    one = [*load(WORD), line("adiw", 24, k=1), line("sts", 24, k=COUNTER)]
    two = [*load(WORD), line("inc", 25), *store(WORD)]
    split = [*load(WORD), line("subi", 24, k=9), *store(WORD)]
    assert not is_counter(one)
    assert is_counter(two)
    assert not is_counter(split)


def test_a_store_that_something_else_may_come_to_does_not_add() -> None:
    """By a way around the load, by a pointer, or with another value."""
    around = [line("brbs", k=C), *COUNT_WORD[:1]]
    assert not is_counter([*around, *COUNT_WORD[1:]])
    either = [line("inc", 24), line("brbs", k=T), line("ldi", 24), *store([24])]
    assert not is_counter([*load([24]), *either], size=1)
    done = [line("ldi", 24), line("ldi", 25), line("cp", 2, 3)]
    table = [*COUNT_WORD, *done, line("ijmp")]
    assert found(table, 2) is not None
    assert found(table, 2, pointed=frozenset({8})) is None
    assert found([*COUNT_WORD, *done], 2, pointed=frozenset({8})) is not None


def test_functions_that_are_called_may_read_what_they_do_not_set() -> None:
    """The counter is in r24 behind its function, of which r22 is the first argument that is
    read; one by a pointer may read all."""
    lines = [*COUNT_WORD, line("cp", 2, 3), line("call"), line("ret")]
    for callee, is_known in (
        ([line("mov", 20, 22)], True),
        ([line("mov", 20, 24)], False),
        ([line("ldi", 24), line("mov", 20, 24)], True),
    ):
        code = assembled([*lines, *callee, line("ret")])
        call = next(one for one in code.values() if one.name == "call")
        begin = call.end + 2
        code[call.address] = replace(call, target=begin)
        counter = counter_of(code, [Function(0, begin, False)])
        assert counter is not None
        assert counter.others == (frozenset() if is_known else {call.address}), callee
    assert not is_counter([*COUNT_WORD, line("icall")])


def test_interrupts_keep_what_they_find() -> None:
    assert not is_counter([*COUNT_WORD, ("reti", 0, 0, 0)])
