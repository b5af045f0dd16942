"""One robot, on a programmer."""

from collections.abc import Callable
from typing import Any

from .conftest import Person, Typed, Words

BLINK, MOVE = "firmware/examples/blink.c", "firmware/examples/move.c"
Told = Callable[..., Any]


def test_01_a_programmer_reads_a_robot(told: Told, isp: Words) -> None:
    """Chip, fuses, lock bits and EEPROM are read by a programmer, and nothing is written."""
    first = told("flash", "robot", BLINK, *isp, "--dry-run")
    again = told("flash", "robot", BLINK, *isp, "--dry-run")
    assert first["part"] == "ATmega328P"
    assert not first["written"]
    assert first == again


def test_02_a_robot_is_flashed_by_a_programmer(
    told: Told, kilotwin: Typed, isp: Words, person: Person
) -> None:
    """Program and boot loader get in, calibration and uid stay, and the program runs."""
    before = told("flash", "robot", BLINK, *isp, "--dry-run")
    flashed = told("flash", "robot", BLINK, *isp)
    after = told("flash", "robot", BLINK, *isp, "--dry-run")
    assert flashed["written"]
    assert flashed["verified"]
    assert after["duties"] == before["duties"]
    assert after["uid"] == before["uid"]
    person("take the robot off the programmer and switch it on; is it awake, and blue or blinking?")


def test_03_a_programmer_that_is_pulled_out_says_what_the_chip_holds(
    kilotwin: Typed, isp: Words, person: Person
) -> None:
    """A plug pulled in mid-flash is told in one line, and the same command repairs the robot."""
    person("when 'writing' is shown, pull the programmer's plug out of the robot; ready?")
    kilotwin("flash", "robot", MOVE, *isp, expect=3)
    person("plug it in again; done?")
    kilotwin("flash", "robot", MOVE, *isp)
