"""Flags count as dead only where something sets them anew before anything can read them."""

from kilotwin.programs.translate.instructions import Instruction
from kilotwin.programs.translate.liveness import ALL_FLAGS, live_flags

C, Z, T = 1 << 0, 1 << 1, 1 << 6
NEVER_SET = T | 1 << 7  # by arithmetic
SREG = 0x5F


def live(*code: Instruction) -> list[int]:
    """By instruction, from address 0 on."""
    after = live_flags({one.address: one for one in code}, lambda skip: skip.end + 2)
    return [after[one.address] for one in code]


def one(at: int, name: str, k: int = 0, target: int = 0) -> Instruction:
    return Instruction(at, name, 16, 17, k, target)


def test_an_addition_sets_anew_what_the_one_before_left() -> None:
    first, *_ = live(one(0, "add"), one(2, "add"), one(4, "ret"))
    assert first == NEVER_SET


def test_a_carry_that_is_added_is_read() -> None:
    first, *_ = live(one(0, "add"), one(2, "adc"), one(4, "ret"))
    assert first == NEVER_SET | C


def test_a_long_comparison_reads_z_of_its_lower_bytes_only_if_its_own_is_read() -> None:
    by_carry = live(one(0, "cp"), one(2, "cpc"), one(4, "brbs", 0, 0), one(6, "cp"), one(8, "ret"))
    by_zero = live(one(0, "cp"), one(2, "cpc"), one(4, "brbs", 1, 0), one(6, "cp"), one(8, "ret"))
    assert by_carry[0] & (C | Z) == C
    assert by_zero[0] & (C | Z) == C | Z


def test_what_is_not_known_to_follow_may_read_all_flags() -> None:
    for name in ("ret", "reti", "ijmp", "icall", "invalid"):
        assert live(one(0, "add"), one(2, name)) == [ALL_FLAGS, ALL_FLAGS], name
    assert live(one(0, "add"), one(2, "rjmp", target=0x1000))[0] == ALL_FLAGS


def test_a_call_needs_what_its_function_reads_first() -> None:
    first, *_ = live(
        one(0, "add"), one(2, "rcall", target=6), one(4, "ret"), one(6, "adc"), one(8, "ret")
    )
    assert first == NEVER_SET | C


def test_the_status_register_is_read_and_written_as_a_whole() -> None:
    saved, *_ = live(one(0, "add"), one(2, "in", SREG), one(4, "add"), one(6, "ret"))
    restored, *_ = live(one(0, "add"), one(2, "out", SREG), one(4, "ret"))
    assert (saved, restored) == (ALL_FLAGS, 0)


def test_both_ways_of_a_skip_and_of_a_branch_count() -> None:
    skipped = live(one(0, "add"), one(2, "sbrc"), one(4, "add"), one(6, "adc"), one(8, "ret"))
    branched = live(
        one(0, "add"), one(2, "brbs", 1, 6), one(4, "add"), one(6, "adc"), one(8, "ret")
    )
    assert skipped[0] == NEVER_SET | C
    assert branched[0] == NEVER_SET | C | Z


def test_counting_in_a_loop_leaves_the_carry_to_what_is_behind() -> None:
    added, counted, *_ = live(
        one(0, "add"), one(2, "dec"), one(4, "brbc", 1, 2), one(6, "adc"), one(8, "ret")
    )
    assert added & C
    assert counted & C
