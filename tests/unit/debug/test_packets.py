"""Packets of gdb's protocol, from and to bytes."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kilotwin.session.debug.packets import INTERRUPT, Reader, framed, numbers


def test_a_packet_has_a_checksum_and_its_marks_are_escaped() -> None:
    assert framed("OK") == b"$OK#9a"
    assert framed("a#b") == b"$a}\x03b#" + b"%02x" % ((ord("a") + ord("}") + 3 + ord("b")) % 256)


@given(st.lists(st.text(st.characters(min_codepoint=32, max_codepoint=126)), max_size=5), st.data())
def test_packets_are_read_however_they_are_cut_up(texts: list[str], data: st.DataObject) -> None:
    sent = b"".join(map(framed, texts))
    cut = data.draw(st.integers(0, len(sent)))
    reader = Reader()
    first, one = reader.feed(sent[:cut])
    then, other = reader.feed(sent[cut:])
    assert first + then == texts
    assert one + other == b"+" * len(texts)


def test_a_packet_that_was_spoilt_is_asked_for_again() -> None:
    reader = Reader()
    assert reader.feed(b"$g#00") == ([], b"-")
    reader.acknowledges = False
    assert reader.feed(b"$g#67$g#00") == (["g"], b"")


def test_an_interrupt_comes_between_packets_and_noise_is_passed_over() -> None:
    assert Reader().feed(b"++\x03-$c#63") == ([INTERRUPT, "c"], b"+")


def test_a_packet_without_end_does_not_fill_the_memory() -> None:
    reader = Reader()
    reader.feed(b"$" + bytes(1 << 17))
    assert reader.feed(framed("c")) == (["c"], b"+")


def test_an_escape_at_the_end_of_a_packet_is_a_blank() -> None:
    assert Reader().feed(b"$}#7d") == (["\0"], b"+")


def test_numbers_are_hexadecimal_and_as_many_as_are_wanted() -> None:
    assert numbers("800100,2", 2) == [0x800100, 2]
    for wrong in ("1", "1,2,3", "x,1"):
        with pytest.raises(ValueError, match=r"must be 2 numbers|invalid literal"):
            numbers(wrong, 2)
