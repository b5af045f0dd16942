"""Intel HEX files of robots: what is read, and what is refused with a word to the user."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kilotwin.errors import InputError
from kilotwin.flash.image import (
    LOADER_BEGIN,
    application_of,
    has_loader,
    pages_of,
    read_hex,
    write_hex,
)

END = ":00000001FF\n"


def refusal(path: Path, text: str | bytes) -> str:
    """What application_of() says to such a file, without the file's name."""
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    with pytest.raises(InputError) as caught:
        application_of(path)
    assert str(caught.value).startswith(str(path))
    return str(caught.value).removeprefix(str(path))


def test_bytes_come_by_address_and_neighbours_are_joined(tmp_path: Path) -> None:
    file = tmp_path / "a.hex"
    file.write_text(":020000001234B8\r\n\r\n:0100020056A7\r\n:0110000042AD\r\n" + END.lower())
    assert read_hex(file) == {0: b"\x12\x34\x56", 0x1000: b"\x42"}


def test_extended_addresses_lead_to_other_memories(tmp_path: Path) -> None:
    file = tmp_path / "a.hex"
    file.write_text(":020000021000EC\n:0100000055AA\n:02000004008179\n:010000006699\n" + END)
    assert read_hex(file) == {0x10000: b"\x55", 0x810000: b"\x66"}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", ": its end record is missing, so it is cut off; make it anew"),
        (":0100000055AA\n", ": its end record is missing, so it is cut off; make it anew"),
        (":0100000055AB\n" + END, ":1: wrong checksum; the file is damaged, make it anew"),
        (":020000005555\n" + END, ":1: this is no record of Intel HEX; is the file cut off?"),
        ("\n:01000", ":2: this is no record of Intel HEX; is the file cut off?"),
        ("0100000055AA\n" + END, ":1: this is no record of Intel HEX; is the file cut off?"),
        (":0100000655A4\n" + END, ":1: this is no record of Intel HEX; is the file cut off?"),
        (":0100000155A9\n", ":1: this is no record of Intel HEX; is the file cut off?"),
        (":0100000055AA\n:0100000054AB\n" + END, ":2: the byte at 0x0000 was given before"),
        (END + END, ": there is more after its end; two files in one are no program"),
        (END, " holds no byte; name the .hex of a program"),
        (b"\x7fELF\xff\x00", " is no Intel HEX file; name a .hex"),
        (":016E0000553C\n" + END, ": 221 pages of 128 bytes; a robot's program has 220 at most"),
    ],
)
def test_files_that_cannot_be_flashed_are_refused(
    text: str | bytes, said: str, tmp_path: Path
) -> None:
    assert refusal(tmp_path / "bad.hex", text).startswith(said)


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no\.hex: no such file or directory; name a \.hex file"):
        read_hex(tmp_path / "no.hex")


def test_bytes_beyond_the_flash_and_loaders_alone_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "x.hex"
    write_hex(file, {0x7FFE: b"\x00" * 4})
    assert ": bytes at 0x8000 are not in the ATmega328P's flash" in refusal(file, file.read_text())
    write_hex(file, {0: b"\x00" * (LOADER_BEGIN + 2)})
    assert ": 224 pages of 128 bytes" in refusal(file, file.read_text())
    write_hex(file, {0x810000: b"\x00"})
    assert ": bytes at 0x810000 are not in" in refusal(file, file.read_text())
    write_hex(file, {LOADER_BEGIN: b"\x00" * 4})
    assert " holds a boot loader alone" in refusal(file, file.read_text())


def test_an_application_may_bring_its_loader(tmp_path: Path) -> None:
    file = tmp_path / "both.hex"
    both = {0: b"\x01" * 129, LOADER_BEGIN: b"\x02" * 4}
    write_hex(file, both)
    assert application_of(file) == both
    assert pages_of(both) == 2
    assert has_loader(both)
    assert not has_loader({0: b"\x01"})
    assert pages_of({0: b"\x00", 0x6DFF: b"\x00"}) == 220


@given(st.dictionaries(st.integers(0, 0x7FFF), st.binary(min_size=1, max_size=1), min_size=1))
def test_what_is_written_is_read_again(
    tmp_path_factory: pytest.TempPathFactory, content: dict[int, bytes]
) -> None:
    file = tmp_path_factory.getbasetemp() / "round.hex"
    write_hex(file, content)
    laid = {
        begin + i: data[i : i + 1]
        for begin, data in read_hex(file).items()
        for i in range(len(data))
    }
    assert laid == content
