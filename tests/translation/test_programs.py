"""A whole program goes on a translated chip as on an interpreted one, cycle by cycle.

Both get RUN and messages at the same cycles. Executed instruction by instruction they are the same
at any moment: cycle, registers, SRAM, flash, EEPROM, and all outputs with their times. Where waits
are passed over, a chip at rest may be found in another pass of its loop; its variables and outputs
are the same.
"""

import random
import re
import subprocess
from collections.abc import Sequence
from pathlib import Path

import pytest

from kilotwin._emulator import RobotChip
from kilotwin.experiment.programs import find_program
from kilotwin.programs.image.boot_loader import with_boot_loader
from kilotwin.programs.image.image import build_image
from kilotwin.programs.translate import translation

ROOT = Path(__file__).resolve().parents[2]
OWN = Path(__file__).parent / "programs"
PROGRAMS = [
    ROOT / "firmware/aggregation",
    OWN / "floats.c",
    *sorted((ROOT / "firmware/examples").glob("*.c")),
]
TICK = 262_144
RUN_AT = 20 * TICK
# Between the pulses of a frame, or the light of a robot at rest, another frame may not begin.
LEAST_GAP = 200_000
# The instruction that a chip is in is executed to its end: light begins after that.
LONGEST_INSTRUCTION = 16
DATA_END, VARIABLES = 0x900, (0x100, 0x700)
SHORT_TICKS, LONG_TICKS = 400, 1_000_000


def command(name: str) -> int:
    header = (ROOT / "firmware/kilolib/include/message.h").read_text()
    found = re.search(rf"\b{name} = (0x\w+)", header)
    assert found
    return int(found[1], 16)


def images(program: Path) -> tuple[Path, Path]:
    """The .hex of a program, and its translation."""
    image = build_image(find_program([str(program)], ROOT, [], [])).hex
    code = translation.translated(image)
    assert code is not None
    return image, code.file


class Pair:
    """An interpreted chip and a translated one, which get the same."""

    def __init__(
        self,
        image: Path,
        code: Path,
        seed: int,
        *,
        skips: bool,
        gets_run: bool = True,
        types: Sequence[int] = range(4),
    ) -> None:
        self.chips = [RobotChip(str(file), seed=seed, skips=skips) for file in (image, code)]
        self._draw = random.Random(seed)
        self._at = 0
        self._next_message = RUN_AT
        self._commands = [command("RUN")] if gets_run else []
        self._types = types

    def run(self, until: int) -> None:
        while self._next_message < until:
            self._advance(self._next_message - LONGEST_INSTRUCTION)
            content = bytes(self._draw.randrange(256) for _ in range(9))
            kind = self._commands.pop() if self._commands else self._draw.choice(self._types)
            for chip in self.chips:
                chip.show(content + bytes([kind]), self._next_message)
            self._next_message += LEAST_GAP + self._draw.randrange(20 * TICK)
        self._advance(until)

    def _advance(self, until: int) -> None:
        for chip in self.chips:
            chip.run(until)

    def digests(self, begin: int, end: int) -> tuple[int, int]:
        interpreted, code = (chip.digest(begin, end) for chip in self.chips)
        return interpreted, code

    def check_that_program_ran(self) -> None:
        for chip in self.chips:
            assert chip.failure == ""
        assert self.chips[0].outputs == self.chips[1].outputs


def check_at_any_moment(pair: Pair, ticks: int) -> None:
    draw = random.Random(1)
    at = 0
    while at < ticks * TICK:
        at += draw.randrange(1, 2 * TICK)
        pair.run(at)
        assert pair.chips[0].cycle == pair.chips[1].cycle
        interpreted, translated = pair.digests(0, DATA_END)
        assert interpreted == translated, f"differs at cycle {at}"
    pair.check_that_program_ran()


def outputs_without_run(image: Path, code: Path, seed: int, ticks: int) -> tuple[int, ...]:
    pair = Pair(image, code, seed, skips=True, gets_run=False)
    pair.run(ticks * TICK)
    return pair.chips[0].outputs


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda path: path.stem)
def test_a_translated_chip_is_the_interpreted_one_at_any_moment(program: Path) -> None:
    image, code = images(program)
    pair = Pair(image, code, seed=7, skips=False)
    check_at_any_moment(pair, SHORT_TICKS)
    assert pair.chips[0].outputs != outputs_without_run(image, code, 7, SHORT_TICKS)


@pytest.mark.parametrize("program", [PROGRAMS[0], PROGRAMS[-1]], ids=lambda path: path.stem)
def test_waits_are_passed_over_on_a_translated_chip_too(program: Path) -> None:
    check_outputs(program, SHORT_TICKS)


@pytest.mark.parametrize("seed", [1, 2])
def test_sleep_resets_and_a_boot_loader_go_as_on_an_interpreted_chip(seed: int) -> None:
    """At random: a frame of a program to flash is rubbish, so the loader gives up at some time."""
    image = with_boot_loader(images(ROOT / "firmware/examples/blink.c")[0], "robot", print)
    code = translation.translated(image)
    assert code is not None
    names = ["RUN", "SLEEP", "WAKEUP", "RESET", "BOOT", "BOOT", "BOOTPGM_PAGE", "BOOTPGM_SIZE"]
    pair = Pair(image, code.file, seed, skips=False, types=[command(name) for name in names])
    check_at_any_moment(pair, SHORT_TICKS)
    assert pair.chips[0].outputs[0] > 10


def test_code_that_the_program_has_overwritten_is_not_what_was_translated(tmp_path: Path) -> None:
    elf = tmp_path / "writes_itself.elf"
    sections = {"text": 0x7000, "place": 0x1000, "first": 0x2000, "second": 0x2800}
    places = [f"-Wl,--section-start=.{name}={at:#x}" for name, at in sections.items()]
    command = ["avr-gcc", "-mmcu=atmega328p", "-Os", "-std=gnu99", *places, "-o", str(elf)]
    subprocess.run([*command, str(OWN / "writes_itself.c")], check=True)
    code = translation.translated(elf)
    assert code is not None
    chips = [RobotChip(str(file), seed=1, skips=False, boots=True) for file in (elf, code.file)]
    for at in range(TICK // 16, 40 * TICK, TICK // 16):
        for chip in chips:
            chip.run(at)
        assert chips[0].cycle == chips[1].cycle
        assert chips[0].digest(0, DATA_END) == chips[1].digest(0, DATA_END), f"at cycle {at}"
    assert chips[1].failure == ""
    assert chips[1].flash_operations > 100
    assert chips[1].outputs[0] > 30


@pytest.mark.long
@pytest.mark.parametrize("program", PROGRAMS, ids=lambda path: path.stem)
def test_a_translated_chip_does_the_same_for_a_million_ticks(program: Path) -> None:
    check_outputs(program, LONG_TICKS)


def check_outputs(program: Path, ticks: int) -> None:
    image, code = images(program)
    pair = Pair(image, code, seed=3, skips=True)
    for share in range(1, 11):
        pair.run(share * ticks // 10 * TICK)
        interpreted, translated = pair.digests(*VARIABLES)
        assert interpreted == translated, f"differs within {share} tenths"
    pair.check_that_program_ran()
    assert pair.chips[0].outputs != outputs_without_run(image, code, 3, ticks // 10)
