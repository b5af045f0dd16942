"""A program that has to do with what only a chip has runs on one, where the processor is left to
us; elsewhere the run says at its start what needs one. Found in the image, told with its line."""

from pathlib import Path
from typing import Any

import pytest

from kilotwin import RGB, World, _emulator
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.programs import find_program
from kilotwin.programs.group import settled
from kilotwin.programs.image.image import build_image
from kilotwin.programs.translate.needs_chip import needs_chip

PROGRAM = """\
#include <kilolib.h>
#include <avr/interrupt.h>
#include <avr/io.h>
static volatile uint16_t seen;
static void setup(void) {}
static void loop(void) {
%s
}
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
"""
NAMES_SOME = """\
    ADMUX = 3;
    ADCSRA |= 1 << ADSC;
    if (PINC & 2) seen = ADCW;
    PORTD ^= 1, seen += PINC;"""
# It is never told by its text: a macro hides the vector, and the compiler drops what never runs.
HANDLER = """\
    TIMSK1 |= 1 << OCIE1B;
    if (0) SPCR = 1;
}
#define OWN ISR(TIMER1_COMPB_vect)
OWN {
    if (seen++ > 10) set_color(RGB(0, 0, 3));"""
EXPERIMENT = """
name = "own"
seed = 1
duration_s = 2
[arena]
shape = "circle"
diameter_m = 1
[swarm]
profile = "kilobot"
[medium]
kind = "{medium}"
[[robots]]
program = "my.c"
count = 1
{cpu}
"""


def named(folder: Path, body: str) -> list[str]:
    (folder / "my.c").write_text(PROGRAM % body)
    program = find_program([str(folder / "my.c")], folder, [], [])
    image = build_image(program)
    flash, _ = _emulator.flash_image(str(image.elf))
    return list(needs_chip(program, flash, image.elf, image.objects("program")))


def told(folder: Path, body: str, medium: str, cpu: str) -> tuple[Experiment, list[str]]:
    (folder / "my.c").write_text(PROGRAM % body)
    (folder / "my.toml").write_text(EXPERIMENT.format(medium=medium, cpu=cpu))
    lines: list[str] = []
    experiment = Experiment.load(folder / "my.toml")
    return settled(experiment, lines.append), lines


def test_each_is_named_with_the_line_that_names_it_first(tmp_path: Path) -> None:
    assert sorted(named(tmp_path, NAMES_SOME)) == [
        "my.c:7 in loop(): ADMUX",
        "my.c:8 in loop(): ADCSRA",
        "my.c:9 in loop(): ADC",
        "my.c:9 in loop(): PINC",
    ]


def test_handlers_are_found_by_their_vectors_and_sleep_by_its_instruction(tmp_path: Path) -> None:
    handler, register = named(tmp_path, HANDLER)
    assert handler.startswith("my.c:11 ")
    assert handler.endswith(": ISR(TIMER1_COMPB_vect)")
    assert register == "my.c:7 in loop(): TIMSK1"
    assert named(tmp_path, '    __asm__ volatile("sleep");') == ["my.c:7 in loop(): sleep"]


def test_the_runtimes_own_are_not_told_of(tmp_path: Path) -> None:
    body = "seen = get_ambientlight() + get_voltage() + TCNT1; set_motors(1, 1); cli(); sei();"
    assert named(tmp_path, body) == []


def test_auto_takes_the_chip_with_a_line_and_writes_it_down(tmp_path: Path) -> None:
    experiment, lines = told(tmp_path, HANDLER, "kilobot", "")
    assert [group.tier for group in experiment.groups] == ["chip"]
    assert experiment.resolved()["robots"][0]["cpu"] == "avr"
    assert len(lines) == 1
    assert lines[0].startswith("my.c:11 ")
    assert lines[0].endswith(f'is for a chip: {tmp_path / "my.c"} runs with cpu = "avr"')


@pytest.mark.parametrize(
    ("medium", "cpu"), [("kilobot", 'cpu = "translated"'), ("ideal", "")], ids=["asked", "ideal"]
)
def test_a_run_that_stays_translated_says_what_needs_the_chip(
    medium: str, cpu: str, tmp_path: Path
) -> None:
    experiment, lines = told(tmp_path, HANDLER, medium, cpu)
    assert [group.tier for group in experiment.groups] == ["translated"]
    assert [line.split(": ")[1] for line in lines] == [
        'ISR(TIMER1_COMPB_vect) needs cpu = "avr"',
        'TIMSK1 needs cpu = "avr"',
    ]


def test_others_stay_as_they_are(tmp_path: Path) -> None:
    experiment, lines = told(tmp_path, "seen++;", "kilobot", "")
    assert [group.tier for group in experiment.groups] == ["translated"]
    assert lines == []
    native, _ = told(tmp_path, HANDLER, "kilobot", 'cpu = "native"')
    assert [group.tier for group in native.groups] == ["native"]


def test_by_default_its_own_interrupt_comes(tmp_path: Path) -> None:
    (tmp_path / "my.c").write_text(PROGRAM % HANDLER)
    medium: dict[str, Any] = {"kind": "kilobot"}
    with pytest.warns(UserWarning, match=r"my\.c:11 .*ISR\(TIMER1_COMPB_vect\) is for a chip"):
        world = World(program=str(tmp_path / "my.c"), count=1, seed=1, medium=medium)
    with world:
        world.run(2)
        assert world.leds[0] == RGB(0, 0, 3)
