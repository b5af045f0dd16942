"""Words to single robots in ARK's packing."""

import pytest

from kilotwin.experiment.spec.ark import Layout, Word

ARK = Layout(10, 4, 10)


def bits(message: bytes, first: int, count: int) -> int:
    """Bits of a message, counted from the highest of its first byte."""
    text = "".join(f"{byte:08b}" for byte in message)
    return int(text[first : first + count], 2)


def test_three_words_lie_one_after_the_other_highest_bit_first() -> None:
    words = [Word(1, 15, 0), Word(1022, 1, 1023), Word(513, 8, 514)]
    message = ARK.pack(words)
    assert len(message) == 10
    assert message[9] == 0
    for i, word in enumerate(words):
        at = 24 * i
        assert bits(message, at, 10) == word.uid
        assert bits(message, at + 10, 4) == word.type
        assert bits(message, at + 14, 10) == word.value


def test_the_bytes_are_those_that_published_programs_read() -> None:
    # id: data[0] << 2 | data[1] >> 6; type: data[1] >> 2 & 15; value: the last 10 bits
    data = ARK.pack([Word(0b1010110011, 0b0110, 0b1100101001)])
    assert list(data[:3]) == [0b10101100, 0b11011011, 0b00101001]


def test_places_without_a_word_are_for_nobody() -> None:
    message = ARK.pack([Word(7, 0, 0)])
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
        ARK.word(uid, type_, value)


def test_a_word_is_made_of_whole_numbers() -> None:
    with pytest.raises(TypeError, match=r"value is 1\.5; it must be a whole number"):
        ARK.word(1, 0, 1.5)  # type: ignore[arg-type]


@pytest.mark.parametrize("widths", [(8, 4, 12), (8, 0, 16), (12, 4, 8), (10, 14, 0)])
def test_older_words_have_other_widths(widths: tuple[int, int, int]) -> None:
    layout = Layout(*widths)
    most = [2**width - 1 for width in widths]
    words = [layout.word(layout.most_uid, most[1], 0), layout.word(1, 0, most[2])]
    message = layout.pack(words)
    starts = (0, widths[0], widths[0] + widths[1])
    for at, word in ((0, words[0]), (24, words[1])):
        found = [
            bits(message, at + start, width) if width else 0
            for start, width in zip(starts, widths, strict=True)
        ]
        assert found == [word.uid, word.type, word.value]
    assert bits(message, 48, widths[0]) == most[0]
    with pytest.raises(ValueError, match=f"uid is {most[0]}; it must be 0 to {most[0] - 1}"):
        layout.word(most[0], 0, 0)
