"""Signature, fuses and lock bits of a chip: what they mean, what hinders, what is only said."""

import dataclasses

import pytest

from kilotwin.table.flash.chip import EEPROM_BYTES, Chip

AVRDUDE = "avrdude -p m328p -c c -P p"
EEPROM = bytearray(b"\xff" * EEPROM_BYTES)
EEPROM[0x05], EEPROM[0x09], EEPROM[0x0C], EEPROM[0x14] = 70, 71, 72, 73
EEPROM[0xB0], EEPROM[0xB1] = 0x34, 0x12
KILOBOT = Chip(bytes.fromhex("1e950f"), 0xE2, 0xD1, 0xFD, 0xFF, bytes(EEPROM))
ERASED = dataclasses.replace(KILOBOT, eeprom=b"\xff" * EEPROM_BYTES)


def changed(**what: int) -> Chip:
    return dataclasses.replace(KILOBOT, **what)  # type: ignore[arg-type]


def test_a_kilobot_may_be_written_and_nothing_is_odd() -> None:
    assert KILOBOT.obstacle(AVRDUDE, loader=True) is None
    assert KILOBOT.warnings() == []
    assert KILOBOT.part == "ATmega328P"
    assert KILOBOT.uid == 0x1234
    assert KILOBOT.duties == {
        "turn_left": 70,
        "turn_right": 71,
        "straight_left": 72,
        "straight_right": 73,
    }


@pytest.mark.parametrize(("high", "size"), [(0xD1, 4096), (0xD3, 2048), (0xD5, 1024), (0xD7, 512)])
def test_the_fuses_bootsz_give_the_size_of_the_boot_section(high: int, size: int) -> None:
    chip = changed(high=high)
    assert chip.boot_section_bytes == size
    assert chip.obstacle(AVRDUDE, loader=False) is None
    obstacle = chip.obstacle(AVRDUDE, loader=True)
    assert (obstacle is None) == (size == 4096)
    if obstacle is not None:
        assert obstacle.endswith(f"type: {AVRDUDE} -U hfuse:w:0xD1:m")


@pytest.mark.parametrize(
    ("lock", "with_loader", "without"),
    [
        (0xFE, "may not be written", "may not be written"),
        (0xFC, "may not be written", "may not be written"),
        (0xFB, "may not read and write the application", None),
        (0xF7, "may not read and write the application", None),
        (0xEF, None, None),
    ],
)
def test_lock_bits_that_forbid_what_is_needed_hinder(
    lock: int, with_loader: str | None, without: str | None
) -> None:
    chip = changed(lock=lock)
    for expected, loader in ((with_loader, True), (without, False)):
        obstacle = chip.obstacle(AVRDUDE, loader=loader)
        assert (expected is None) == (obstacle is None)
        if expected and obstacle:
            assert expected in obstacle
            assert obstacle.endswith(f"erasing opens it; type: {AVRDUDE} -e")


def test_opening_a_chip_that_loses_its_eeprom_is_said_to_lose_it() -> None:
    obstacle = changed(lock=0xFE, high=0xD9).obstacle(AVRDUDE, loader=True)
    assert obstacle is not None
    assert "erasing opens it, which loses the EEPROM; type: " in obstacle


def test_another_chip_hinders() -> None:
    other = dataclasses.replace(KILOBOT, signature=bytes.fromhex("1e9516"))
    assert other.part is None
    obstacle = other.obstacle(AVRDUDE, loader=False)
    assert obstacle is not None
    assert "signature is 1E 95 16" in obstacle
    assert dataclasses.replace(KILOBOT, signature=bytes.fromhex("1e9514")).part == "ATmega328"


@pytest.mark.parametrize(
    ("what", "warning"),
    [
        ({"high": 0xD9}, "erasing loses the EEPROM (fuse EESAVE is off); it is written back"),
        ({"low": 0x62}, "the clock is no Kilobot's (low fuse): its own oscillator, divided: 1 MHz"),
        (
            {"low": 0xFF},
            "the clock is no Kilobot's (low fuse): another clock than the chip's own oscillator",
        ),
        ({"high": 0xC1}, "the watchdog is always on (fuse WDTON): most programs will be reset"),
        ({"high": 0x91}, "debugWIRE is on (fuse DWEN): it may get in the programmer's way"),
        (
            {"extended": 0xFF},
            "brown-out detection is off (extended fuse): an EEPROM may suffer when the battery "
            "runs down",
        ),
        ({"lock": 0xEF}, "the boot section is locked against SPM; erasing opens it"),
    ],
)
def test_what_is_odd_is_said(what: dict[str, int], warning: str) -> None:
    assert changed(**what).warnings() == [warning]


def test_the_table_says_what_the_bytes_mean() -> None:
    lines = dict(line.strip().split("  ", 1) for line in KILOBOT.text().splitlines())
    rows = {name: what.strip() for name, what in lines.items()}
    assert rows == {
        "chip": "1E 95 0F  ATmega328P",
        "low fuse": "0xE2  its own oscillator, 8 MHz",
        "high fuse": "0xD1  boot section 4,096 bytes, start at 0x0000, erasing keeps the EEPROM",
        "extended fuse": "0xFD  reset below 2.7 V",
        "lock bits": "0xFF  open",
        "EEPROM": "uid 4660, turn left 70, turn right 71, straight left 72, straight right 73",
    }


@pytest.mark.parametrize(
    ("chip", "said"),
    [
        (changed(high=0xD8), "start at the boot section, erasing loses the EEPROM"),
        (changed(extended=0xFE), "reset below 1.8 V"),
        (changed(extended=0xFC), "reset below 4.3 V"),
        (changed(extended=0xF8), "no brown-out detection"),
        (changed(lock=0xFE), "lock bits      0xFE  not to be written"),
        (changed(lock=0xFC), "lock bits      0xFC  neither to be written nor read"),
        (changed(lock=0xFC), "EEPROM         cannot be read"),
        (changed(lock=0xCF), "lock bits      0xCF  open, but for the program: boot section"),
        (changed(lock=0xFB), "lock bits      0xFB  open, but for the program: application"),
        (ERASED, "EEPROM         erased: no uid, no calibration"),
        (dataclasses.replace(KILOBOT, signature=b"\x00\x01\x02"), "00 01 02  unknown"),
    ],
)
def test_the_table_says_what_is_unusual(chip: Chip, said: str) -> None:
    assert said in chip.text()


def test_json_has_no_uid_of_an_erased_eeprom() -> None:
    assert ERASED.as_dict()["uid"] is None
    assert ERASED.as_dict()["duties"] is None
    assert KILOBOT.as_dict()["fuses"] == {"low": 0xE2, "high": 0xD1, "extended": 0xFD}
