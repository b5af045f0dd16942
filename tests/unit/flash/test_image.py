"""Applications and loaders as they go into a chip; files of several memories."""

from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kilotwin.errors import InputError
from kilotwin.files.build_id import Target, build_id
from kilotwin.files.flash_image import FlashImage
from kilotwin.files.flash_map import LOADER_BEGIN
from kilotwin.files.memories import read_memories, write_memories
from kilotwin.table.flash.image import (
    application_of,
    has_loader,
    loader_of,
    modules_image,
    pages_of,
    swarm_image,
)

END = ":00000001FF\n"


def refusal(path: Path, segments: dict[int, bytes]) -> str:
    """The error of application_of() for such a file, without the file's name."""
    write_memories(path, segments)
    with pytest.raises(InputError) as caught:
        application_of(path)
    assert str(caught.value).startswith(str(path))
    return str(caught.value).removeprefix(str(path))


def test_an_application_may_bring_its_loader(tmp_path: Path) -> None:
    file = tmp_path / "a.hex"
    write_memories(file, {0: b"\x01" * 129})
    assert application_of(file) == {0: b"\x01" * 129}
    assert not has_loader(application_of(file))
    write_memories(file, {0: b"\x01" * 129, LOADER_BEGIN: b"\x02" * 4})
    both = application_of(file)
    assert both == {0: b"\x01" * 129, LOADER_BEGIN: b"\x02" * 4}
    assert has_loader(both)
    assert pages_of(both) == 2


@pytest.mark.parametrize(
    ("segments", "said"),
    [
        ({0: b"\x00" * (220 * 128 + 1)}, ": 221 pages of 128 bytes; a robot's program has 220"),
        ({0: b"\x00" * (LOADER_BEGIN + 2)}, ": 224 pages of 128 bytes"),
        ({LOADER_BEGIN: b"\x00" * 4}, " holds a boot loader alone; name a program, and this by"),
        ({0x7FFE: b"\x00" * 4}, ":1: a byte at 0x8000; it goes from 0x0000 to 0x7FFF"),
    ],
)
def test_what_a_robot_cannot_take_is_refused(
    segments: dict[int, bytes], said: str, tmp_path: Path
) -> None:
    assert refusal(tmp_path / "bad.hex", segments).startswith(said)


def test_a_modules_program_is_refused(tmp_path: Path) -> None:
    for target in ("robot", "module"):
        words = str(build_id(target, "p", "avr-gcc 5.4.0", "0.2.0")).encode()
        program = {0: b"\x00" * 100 + words + bytes([len(words)]) + b"KTID"}
        if target == "module":
            assert refusal(tmp_path / "m.hex", program).startswith(" was built for a module; name")
        else:
            write_memories(tmp_path / "r.hex", program)
            assert application_of(tmp_path / "r.hex") == program


@pytest.mark.parametrize(
    ("read", "target", "other"),
    [(modules_image, "module", "robot"), (swarm_image, "robot", "module")],
)
def test_what_is_sent_to_loaders_is_for_them_and_can_be_started(
    read: Callable[[Path], FlashImage], target: Target, other: Target, tmp_path: Path
) -> None:
    file = tmp_path / "p.hex"

    def said(built_for: Target, begin: bytes) -> str:
        words = str(build_id(built_for, "p", "avr-gcc 5.4.0", "0.2.0")).encode()
        write_memories(file, {0: begin + bytes(100) + words + bytes([len(words)]) + b"KTID"})
        with pytest.raises(InputError) as caught:
            read(file)
        return str(caught.value).removeprefix(str(file))

    jump = b"\x0c\x94\x34\x00"
    assert said(other, jump) == f" was built for a {other}; name a {target}'s program"
    assert said(target, bytes(4)).startswith(": does not begin with a jump into itself, so no")
    write_memories(file, {0: jump + bytes(200)})
    assert read(file).content == jump + bytes(200)
    write_memories(file, {0: jump + bytes(220 * 128)})
    with pytest.raises(InputError, match="it goes from 0x0000 to 0x6DFF, 220 pages"):
        read(file)


def test_a_loader_lies_in_the_boot_section(tmp_path: Path) -> None:
    file = tmp_path / "l.hex"
    write_memories(file, {0x7002: b"\x03"})
    assert loader_of(file) == {LOADER_BEGIN: b"\xff\xff\x03"}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", ": its end record is missing; name a whole .hex file"),
        (":0100000055AA\n", ": its end record is missing; name a whole .hex file"),
        (END + ":0100000055AA\n", ": its end record is missing; name a whole .hex file"),
        (":0100000055AB\n" + END, ": record at line 1 has invalid checksum; name a whole .hex"),
        ("\nrubbish\n" + END, ": hex file contains invalid record at line 2; name a whole .hex"),
    ],
)
def test_memories_that_are_damaged_or_cut_off_are_refused(
    text: str, said: str, tmp_path: Path
) -> None:
    (tmp_path / "bad.hex").write_text(text)
    with pytest.raises(InputError) as caught:
        read_memories(tmp_path / "bad.hex")
    assert str(caught.value).removeprefix(str(tmp_path / "bad.hex")).startswith(said)
    with pytest.raises(InputError, match=r"no\.hex: no such file or directory; name a \.hex file"):
        read_memories(tmp_path / "no.hex")


@given(st.dictionaries(st.integers(0, 0x84FFFF), st.binary(min_size=1, max_size=1), min_size=1))
def test_memories_that_are_written_are_read_again(
    tmp_path_factory: pytest.TempPathFactory, content: dict[int, bytes]
) -> None:
    file = tmp_path_factory.getbasetemp() / "round.hex"
    write_memories(file, content)
    segments = read_memories(file).items()
    laid = {begin + i: bytes([byte]) for begin, data in segments for i, byte in enumerate(data)}
    assert laid == content
