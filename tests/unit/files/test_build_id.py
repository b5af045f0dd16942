"""The build id is four words at the end of an image, and nothing else is taken for one."""

import pytest

from kilotwin.files.build_id import BuildId, build_id, find_build_id

GCC = "avr-gcc (GCC) 5.4.0"
WALKER = BuildId("robot", "walker", "avr-gcc-5.4.0", "0.2.0")


def trailer(text: bytes) -> bytes:
    return text + bytes([len(text)]) + b"KTID"


def test_it_says_target_program_compiler_and_version() -> None:
    assert build_id("robot", "walker", GCC, "0.2.0") == WALKER
    assert str(WALKER) == "robot walker avr-gcc-5.4.0 kilotwin-0.2.0"


@pytest.mark.parametrize(
    ("name", "word"),
    [
        ("my walker", "my_walker"),
        ('a"b\\c', "a_b_c"),
        ("käfer", "k__fer"),
        ("lab.v2+x-1", "lab.v2+x-1"),
        ("n" * 100, "n" * 40),
    ],
)
def test_a_name_becomes_one_word(name: str, word: str) -> None:
    assert build_id("module", name, GCC, "1").program == word


@pytest.mark.parametrize("behind", [b"", b"\xff" * 90, b"more code", b"KTID", b"\x05KTID"])
def test_it_is_found_at_the_end_and_before_what_follows(behind: bytes) -> None:
    content = b"code" * 100 + trailer(str(WALKER).encode()) + behind
    assert find_build_id(content) == WALKER


def test_the_last_one_counts() -> None:
    old = trailer(b"module cell avr-gcc-5.4.0 kilotwin-0.1.0")
    assert find_build_id(old + trailer(str(WALKER).encode())) == WALKER
    found = find_build_id(old)
    assert found is not None
    assert (found.target, found.kilotwin) == ("module", "0.1.0")


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"KTID",
        b"\x04KTID",
        b"code without a word of what it is",
        trailer(b"robot walker avr-gcc-5.4.0"),
        trailer(b"pump walker avr-gcc-5.4.0 kilotwin-0.2.0"),
        trailer(b"robot wal ker avr-gcc-5.4.0 kilotwin-0.2.0"),
        trailer(b"robot w\x80lker avr-gcc-5.4.0 kilotwin-0.2.0"),
        str(WALKER).encode() + b"\xf0KTID",
    ],
)
def test_what_only_looks_like_one_is_none(content: bytes) -> None:
    assert find_build_id(content) is None
