"""A program that names a register which is memory where it runs translated is told so, once."""

from pathlib import Path

import pytest

from kilotwin.experiment.programs import find_program
from kilotwin.programs.translate.translation import translated_guest

PROGRAM = """\
#include <kilolib.h>
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
WHAT = ' is memory and no more where a program runs translated; cpu = "avr" has what it does'


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("KILOTWIN_CACHE", str(tmp_path / "cache"))


def said(folder: Path, body: str) -> list[str]:
    (folder / "my.c").write_text(PROGRAM % body)
    lines: list[str] = []
    translated_guest(find_program([str(folder / "my.c")], folder, [], []), lines.append)
    return [line for line in lines if WHAT in line]


def test_each_is_named_with_the_line_that_names_it_first(tmp_path: Path) -> None:
    lines = said(tmp_path, NAMES_SOME)
    assert sorted(line.removesuffix(WHAT) for line in lines) == [
        "my.c:6 in loop(): ADMUX",
        "my.c:7 in loop(): ADCSRA",
        "my.c:8 in loop(): ADC",
        "my.c:8 in loop(): PINC",
    ]
    assert said(tmp_path, NAMES_SOME) == []  # it is translated


def test_the_runtimes_own_are_not_told_of(tmp_path: Path) -> None:
    assert said(tmp_path, "seen = get_ambientlight() + get_voltage(); set_motors(1, 1);") == []
