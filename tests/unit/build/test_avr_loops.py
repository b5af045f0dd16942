"""Turns are left out of loops of known shapes alone; what such a loop does is held against each
turn by tests/translation/test_loops.py."""

import pytest

from kilotwin.programs.translate.instructions import Instruction
from kilotwin.programs.translate.loops import turns_left_out

C, Z, N = 0, 1, 2
Line = tuple[str, int, int, int, int]
"""Name, d, r, k, target."""


def line(name: str, d: int = 0, r: int = 0, k: int = 0, target: int = 0) -> Line:
    return name, d, r, k, target


DIVISION = [
    line("adc", 26, 26),
    line("adc", 27, 27),
    line("cp", 26, 22),
    line("cpc", 27, 23),
    line("brbs", k=C, target=14),
    line("sub", 26, 22),
    line("sbc", 27, 23),
    line("adc", 24, 24),
    line("adc", 25, 25),
    line("dec", 21),
    line("brbc", k=Z),
]
TO_MARK = [
    line("add", 22, 22),
    line("adc", 23, 23),
    line("cp", 22, 18),
    line("cpc", 23, 19),
    line("brbs", k=C, target=14),
    line("sub", 22, 18),
    line("sbc", 23, 19),
    line("adc", 30, 30),
    line("brbc", k=C),
]
NORMALISATION = [line("dec", 25), line("add", 22, 22), line("adc", 23, 23), line("brbc", k=N)]
COUNTDOWN = [line("subi", 24, k=1), line("sbci", 25), line("brbc", k=Z)]


def found(code: list[Line]) -> str | None:
    """The macro of code at address 0."""
    instructions = {
        2 * at: Instruction(2 * at, name, d, r, k, target)
        for at, (name, d, r, k, target) in enumerate(code)
    }
    statement = turns_left_out(0, instructions)
    return None if statement is None else statement.split("(")[0]


def test_known_shapes_are_found() -> None:
    assert found(DIVISION) == "DIVIDE_BY_COUNT"
    assert found(TO_MARK) == "DIVIDE_TO_MARK"
    assert found(NORMALISATION) == "NORMALISE"
    assert found(COUNTDOWN) == "COUNT_DOWN"
    assert found([line("sbiw", 30, k=1), line("brbc", k=Z)]) == "COUNT_DOWN"


@pytest.mark.parametrize("code", [DIVISION, TO_MARK, NORMALISATION, COUNTDOWN])
def test_a_loop_with_another_line_in_it_is_left_to_the_code(code: list[Line]) -> None:
    for at, (name, d, r, k, target) in enumerate(code):
        rest = code[at + 1 :]
        assert found([*code[:at], line("nop"), *rest]) is None, at
        if name in ("brbs", "brbc", "subi", "sbci"):
            assert found([*code[:at], (name, d, r, k + 3, target), *rest]) is None, at
        if name in ("brbs", "brbc"):
            assert found([*code[:at], (name, d, r, k, target + 2), *rest]) is None, at


def test_the_same_numbers_are_shifted_compared_and_subtracted() -> None:
    for at in range(len(DIVISION)):
        name, d, r, k, target = DIVISION[at]
        if name.startswith("br"):
            continue
        other = [*DIVISION[:at], (name, d + 1, r, k, target), *DIVISION[at + 1 :]]
        assert found(other) is None, at


def test_registers_that_two_numbers_share_are_left_to_the_code() -> None:
    shared = [(name, 24 if d == 26 else d, r, k, t) for name, d, r, k, t in DIVISION]
    assert found(shared) is None
    assert found([line("dec", 22), *NORMALISATION[1:]]) is None


def test_numbers_of_more_than_four_bytes_are_left_to_the_code() -> None:
    chain = [line("adc", register, register) for register in range(16, 20)]
    assert found([line("dec", 25), line("add", 15, 15), *chain, line("brbc", k=N)]) is None
    wide = [line("subi", 16, k=1), *(line("sbci", register) for register in range(17, 21))]
    assert found([*wide, line("brbc", k=Z)]) is None
