"""Words to single robots in ARK's packing."""

import pytest

from kilotwin.experiment.spec.ark import MOST_UID, Word, pack


def bits(message: bytes, first: int, count: int) -> int:
    """Bits of a message, counted from the highest of its first byte."""
    text = "".join(f"{byte:08b}" for byte in message)
    return int(text[first : first + count], 2)


def test_three_words_lie_one_after_the_other_highest_bit_first() -> None:
    words = [Word(1, 15, 0), Word(MOST_UID, 1, 1023), Word(513, 8, 514)]
    message = pack(words)
    assert len(message) == 10
    assert message[9] == 0
    for i, word in enumerate(words):
        at = 24 * i
        assert bits(message, at, 10) == word.uid
        assert bits(message, at + 10, 4) == word.type
        assert bits(message, at + 14, 10) == word.value


def test_the_bytes_are_those_that_published_programs_read() -> None:
    # id: data[0] << 2 | data[1] >> 6; type: data[1] >> 2 & 15; value: the last 10 bits
    data = pack([Word(0b1010110011, 0b0110, 0b1100101001)])
    assert list(data[:3]) == [0b10101100, 0b11011011, 0b00101001]


def test_places_without_a_word_are_for_nobody() -> None:
    message = pack([Word(7, 0, 0)])
    assert [bits(message, at, 10) for at in (0, 24, 48)] == [7, 1023, 1023]


@pytest.mark.parametrize(
    ("uid", "type_", "value", "said"),
    [
        (1023, 0, 0, "uid is 1023; it must be 0 to 1022"),
        (-1, 0, 0, "uid is -1"),
        (1, 16, 0, "type is 16; it must be 0 to 15"),
        (1, 0, 1024, "value is 1024; it must be 0 to 1023"),
    ],
)
def test_what_does_not_fit_is_refused(uid: int, type_: int, value: int, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        Word(uid, type_, value)


def test_a_word_is_made_of_whole_numbers() -> None:
    with pytest.raises(TypeError, match=r"value is 1\.5; it must be a whole number"):
        Word(1, 0, 1.5)  # type: ignore[arg-type]
