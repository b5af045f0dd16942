"""A robot that runs translated decides as its chip does (emulator/avr/differential_test.h).

Both get the same messages, light and noise of the converter, and are switched on at the same time.
The engine stands for the chip's peripherals, so that times differ by microseconds: an interrupt
comes where a block of code ends.

The corpus is 60 programs in the styles of published ones (hardware.md 6), all of which agree; `make
test` holds a sample of them, `make check-long` the others.
"""

from pathlib import Path
from typing import Any

import pytest

from kilotwin._emulator import DifferentialTest
from kilotwin.experiment.programs import find_program
from kilotwin.programs.image import image as avr_build
from kilotwin.programs.translate.translation import translated_guest

ROOT = Path(__file__).resolve().parents[2]
CORPUS = sorted((Path(__file__).parent / "corpus").glob("*.c"))
# Those whose styles have gone wrong before, and of the examples those that do most.
SAMPLE = {
    "before_setup",
    "delay_in_callback",
    "floats_each_pass",
    "light_sum",
    "orbit",
    "passes_blink",
    "print_in_wait",
    "random_walk_counter",
    "talk_and_listen",
    "two_producers",
}
EXAMPLES = sorted((ROOT / "firmware/examples").glob("*.c"))
CONFORMANCE = sorted((ROOT / "tests/conformance/programs").glob("*.c"))
MANY = [*EXAMPLES, *CONFORMANCE, *CORPUS]
PROGRAMS = [
    ROOT / "firmware/aggregation",
    *(path for path in MANY if path.stem in SAMPLE),
    *(pytest.param(path, marks=pytest.mark.long) for path in MANY if path.stem not in SAMPLE),
]
STEPS = 1_000
SLACK_S = 0.005


def compared(program: Path, steps: int, seed: int, **settings: Any) -> DifferentialTest:
    found = find_program([str(program)], ROOT, [], [])
    guest, image = translated_guest(found), avr_build.build_image(found)
    exactly: Any = {"uid": 7, "before_run": [], "slack_s": SLACK_S, "waits": False, "follow": None}
    test = DifferentialTest(
        guest=str(guest.file),
        tier="translated",
        elf=str(image.elf),
        name=guest.name,
        seed=seed,
        **{**exactly, **settings},
    )
    test.run(steps)
    return test


def check(test: DifferentialTest, steps: int) -> None:
    assert test.difference is None
    assert (test.avr_failure, test.native_failure) == ("", "")
    assert test.tick == steps + 1


def test_the_corpus_has_sixty_programs_at_least() -> None:
    assert len(CORPUS) >= 60
    assert {path.stem for path in MANY} > SAMPLE


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda path: path.stem)
def test_a_translated_robot_decides_as_its_chip_does(program: Path) -> None:
    test = compared(program, STEPS, seed=1)
    check(test, STEPS)
    assert test.compared > 1


def test_a_loop_in_a_function_that_a_wait_calls_from_two_places_is_no_pass_of_the_wait() -> None:
    """What tells one call from the other is the stack alone."""
    check(compared(Path(__file__).with_name("two_places.c"), 100, seed=1), 100)


def test_a_pin_that_is_set_by_an_instruction_for_one_bit_shows_at_once() -> None:
    test = compared(Path(__file__).with_name("single_bits.c"), 200, seed=1)
    check(test, 200)
    assert test.compared >= 12  # four times in 64 ticks


def test_it_gets_messages_before_setup_as_the_chip_does() -> None:
    """Nine data bytes and a type each."""
    before = [bytes([number] * 9 + [0]) for number in range(5)]
    program = next(path for path in CORPUS if path.stem == "before_setup")
    test = compared(program, 400, seed=1, before_run=before)
    check(test, 400)
