"""A .hex file is read as pages, or refused with the line that is wrong."""

import contextlib
import shutil
import subprocess
import zlib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kilotwin.errors import InputError
from kilotwin.files.flash_image import APPLICATION, FlashImage, read_hex
from kilotwin.files.message_crc import message_crc

END = ":00000001FF\n"
LOADER = range(0x7000, 0x8000)


def record(address: int, data: bytes, kind: int = 0) -> str:
    body = bytes([len(data)]) + address.to_bytes(2, "big") + bytes([kind]) + data
    return f":{(body + bytes([-sum(body) % 256])).hex().upper()}\n"


def read(folder: Path, text: str, memory: range = APPLICATION) -> FlashImage:
    file = folder / "x.hex"
    file.write_bytes(text.encode())
    return read_hex(file, memory)


def refusal(folder: Path, text: str, memory: range = APPLICATION) -> str:
    with pytest.raises(InputError) as caught:
        read(folder, text, memory)
    assert caught.value.exit_code == 2
    return str(caught.value).removeprefix(f"{folder}/x.hex")


def test_bytes_lie_where_their_records_say_and_gaps_are_erased(tmp_path: Path) -> None:
    text = record(0x10, b"\x12\x34") + "\r\n\n" + record(0, b"\x01\x00", 2)
    text += record(2, b"\xab").lower() + record(0, b"\x00\x00", 4) + record(0, b"\x01")
    text += record(0, b"\x00\x00\x00\x00", 3) + record(0, b"\x00\x00\x00\x00", 5) + END
    image = read(tmp_path, text)
    expected = bytearray(b"\xff" * 0x1003)
    expected[0x10:0x12] = b"\x12\x34"
    expected[0x1002], expected[0] = 0xAB, 0x01
    assert image.content == expected


def test_pages_have_128_bytes_and_the_last_is_filled_up(tmp_path: Path) -> None:
    image = read(tmp_path, record(0, bytes(100)) + record(100, bytes(100)) + END)
    assert image.pages == [bytes(128), bytes(72) + b"\xff" * 56]
    assert image.padded == b"".join(image.pages)
    assert image.crc16 == message_crc(image.padded)
    assert image.image_id == zlib.crc32(image.padded)
    assert image.build_id is None


def test_a_full_image_of_220_pages_is_taken_and_not_a_byte_more(tmp_path: Path) -> None:
    text = record(0, b"\x00") + record(0x6DFF, b"\x01")
    assert len(read(tmp_path, text + END).pages) == 220
    said = refusal(tmp_path, text + record(0x6E00, b"\x01") + END)
    assert said.startswith(":3: a byte at 0x6E00; it goes from 0x0000 to 0x6DFF, 220 pages of 128")


def test_another_memory_begins_at_its_own_address(tmp_path: Path) -> None:
    image = read(tmp_path, record(0x7002, b"\x01") + END, LOADER)
    assert image.content == b"\xff\xff\x01"
    said = refusal(tmp_path, record(0, b"\x01") + END, LOADER)
    assert said.startswith(":1: a byte at 0x0000; it goes from 0x7000 to 0x7FFF, 32 pages")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", ": has no bytes to flash"),
        ("\n\n", ": has no bytes to flash"),
        (END, ": has no bytes to flash"),
        (record(0, b"\x01"), ":1: half a hex file, its end record is missing"),
        (record(0, b"\x01") + "\n" + record(1, b"\x01")[:-5], ":3: the record is not as long"),
        (":00\n", ":1: the record is not as long as it says; the file is cut off or damaged"),
        (":020010001234A9\n" + END, ":1: wrong checksum; the file is cut off or damaged"),
        (":0200100012X4A8\n" + END, ":1: after the colon there are pairs of hexadecimal digits"),
        (":020010001234A\n" + END, ":1: after the colon there are pairs of hexadecimal digits"),
        ("int main(void)\n", ":1: a line of Intel HEX begins with a colon; name a .hex file"),
        ("\x7fELF\x80\xff", ":1: a line of Intel HEX begins with a colon"),
        (record(0, b"\x01") + END + record(1, b"\x01"), ":3: there is more after the end record"),
        (record(0, b"\x01", 6) + END, ":1: record type 0x06; Intel HEX has 00 to 05"),
        (record(0, b"\x01", 4) + END, ":1: an address record has two bytes, not 1"),
        (
            record(0, b"\x01\x02") + "\n" + record(1, b"\x02") + END,
            ":3: the byte at 0x0001 was given before, in line 1",
        ),
        (record(0, b"\x00\x81", 4) + record(0, b"\x01") + END, ":2: a byte at 0x810000;"),
    ],
)
def test_what_cannot_be_flashed_is_refused_with_its_line(
    text: str, said: str, tmp_path: Path
) -> None:
    assert refusal(tmp_path, text).startswith(said)


@pytest.mark.parametrize(("name", "said"), [("no.hex", "no such file"), (".", "is a directory")])
def test_a_file_that_cannot_be_read_is_named(name: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=f"{said}.*; name a .hex file"):
        read_hex(tmp_path / name)


@given(st.text(alphabet=":0123456789ABCDEFabcdef\n", max_size=200))
def test_any_text_is_read_or_refused(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    folder = tmp_path_factory.getbasetemp()
    with contextlib.suppress(InputError):
        assert 0 < len(read(folder, text).content) <= len(APPLICATION)


@pytest.mark.skipif(not shutil.which("avr-objcopy"), reason="needs binutils-avr")
def test_objcopy_reads_and_writes_the_same_bytes(tmp_path: Path) -> None:
    content = bytes(i * 7 % 251 for i in range(3000)) + b"\x01"
    (tmp_path / "x.bin").write_bytes(content)
    convert = ["avr-objcopy", "-I", "binary", "-O", "ihex", "x.bin", "y.hex"]
    subprocess.run(convert, cwd=tmp_path, check=True)
    assert read_hex(tmp_path / "y.hex").content == content
