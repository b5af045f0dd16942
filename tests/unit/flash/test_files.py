"""Loaders, EEPROMs and chips in files."""

from pathlib import Path

import pytest

from kilotwin.errors import InputError
from kilotwin.files.flash_map import LOADER_BEGIN
from kilotwin.files.memories import write_memories
from kilotwin.table.flash import chip_file, eeprom_files, loader

PROGRAM = {0: b"\x01\x02"}
LOADER = {LOADER_BEGIN: b"\x03\x04"}


def test_ours_is_built_and_taken_unless_another_one_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "ours.hex"
    write_memories(file, LOADER)
    monkeypatch.setattr(loader, "build_boot_loader", lambda notify: file)
    assert loader.choose(None, PROGRAM) == loader.Loader("Kilotwin's", LOADER, ours=True)
    assert loader.choose(str(file), PROGRAM) == loader.Loader(str(file), LOADER)
    assert loader.choose("keep", PROGRAM).from_chip
    assert loader.choose("none", PROGRAM) == loader.Loader("none")
    assert loader.choose(None, {**PROGRAM, **LOADER}) == loader.Loader("the file's own")


def test_a_loader_that_is_none_or_one_too_many_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "l.hex"
    write_memories(file, PROGRAM)
    with pytest.raises(InputError, match="a byte at 0x0000; it goes from 0x7000 to 0x7FFF"):
        loader.choose(str(file), PROGRAM)
    write_memories(file, {0x7FFF: b"\x00\x00"})
    with pytest.raises(InputError, match="a byte at 0x8000; it goes from 0x7000"):
        loader.choose(str(file), PROGRAM)
    with pytest.raises(InputError, match="brings a boot loader of its own"):
        loader.choose("none", {**PROGRAM, **LOADER})


def test_an_erased_boot_section_holds_no_loader() -> None:
    erased = bytearray(b"\xff" * 0x8000)
    assert loader.loader_in(bytes(erased)) == {}
    erased[LOADER_BEGIN] = 0
    assert loader.loader_in(bytes(erased)) == {LOADER_BEGIN: b"\x00" + b"\xff" * 0xFFF}


def test_kept_eeproms_never_overwrite_one_another(tmp_path: Path) -> None:
    one, other = b"\x01" * 1024, b"\x02" * 1024
    files = {eeprom_files.keep(tmp_path / "a", data, 7) for data in (one, other, one)}
    assert len(files) == 2
    assert {eeprom_files.read(file, b"\xff" * 1024) for file in files} == {one, other}
    (tmp_path / "b").write_text("no folder")
    with pytest.raises(InputError, match=r"--keep .*b: file exists; name another folder"):
        eeprom_files.keep(tmp_path / "b", one, 7)


@pytest.mark.parametrize("base", [0, 0x810000])
def test_an_eeprom_file_is_laid_over_what_is_there(base: int, tmp_path: Path) -> None:
    write_memories(tmp_path / "e.hex", {base + 4: b"\x09"})
    assert eeprom_files.read(tmp_path / "e.hex", b"\x01" * 1024)[3:6] == b"\x01\x09\x01"
    write_memories(tmp_path / "e.hex", {base + 1023: b"\x09\x09"})
    with pytest.raises(InputError, match="are not in the EEPROM of 1 KB"):
        eeprom_files.read(tmp_path / "e.hex", b"\x01" * 1024)


def test_a_chip_is_in_its_file_whole(tmp_path: Path) -> None:
    file = tmp_path / "chip.hex"
    chip = chip_file.plug_in(file)
    assert chip.fuses == b"\xe2\xd1\xff"
    chip.flash = b"\x01" + b"\xff" * 0x7FFE + b"\x02"
    chip.eeprom = bytes(i & 0xFF for i in range(1024))
    chip.fuses, chip.lock_bits, chip.signature = b"\x62\xd9\xfd", 0xEF, b"\x1e\x95\x14"
    chip_file.save(file, chip)
    again = chip_file.plug_in(file)
    assert chip_file.contents(again) == chip_file.contents(chip)
    assert again.signature == b"\x1e\x95\x14"
    with pytest.raises(InputError, match=r"--chip .*: no such file or directory"):
        chip_file.save(tmp_path / "no" / "chip.hex", chip)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ({0x820000: b"\x00" * 4}, "bytes at 0x820000 and on do not fit into .* 3 bytes"),
        ({0x7FFF: b"\x00" * 2}, "bytes at 0x7FFF and on do not fit into .* 32768 bytes"),
        ({0x850000: b"\x00"}, "bytes at 0x850000 belong to no memory of an ATmega328P"),
    ],
)
def test_a_file_that_is_no_chips_is_refused(
    content: dict[int, bytes], said: str, tmp_path: Path
) -> None:
    write_memories(tmp_path / "odd.hex", content)
    with pytest.raises(InputError, match=said):
        chip_file.plug_in(tmp_path / "odd.hex")
