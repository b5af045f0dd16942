"""The simulated programmer takes any bytes: it answers in whole messages and comes into step."""

from functools import reduce
from operator import xor

from hypothesis import given
from hypothesis import strategies as st

from kilotwin import _emulator

LONGEST = 275 + 6


def framed(body: bytes) -> bytes:
    message = b"\x1b\x01" + len(body).to_bytes(2, "big") + b"\x0e" + body
    return message + bytes([reduce(xor, message)])


COMMANDS = st.binary(min_size=1, max_size=40).map(framed)
ENTER = framed(bytes([0x10, 200, 100, 25, 32, 0, 0x53, 3, 0xAC, 0x53, 0, 0]))


def whole_messages(answers: bytes) -> int:
    """How many there are; they leave no byte over and their checksums are right."""
    count = 0
    while answers:
        assert answers[0] == 0x1B
        end = 6 + int.from_bytes(answers[2:4], "big")
        assert len(answers) >= end
        assert reduce(xor, answers[:end]) == 0
        answers = answers[end:]
        count += 1
    return count


@given(st.lists(st.binary(max_size=300) | COMMANDS, max_size=8))
def test_any_bytes_are_answered_in_whole_messages(pieces: list[bytes]) -> None:
    programmer = _emulator.Programmer()
    whole_messages(programmer.receive(ENTER))
    for piece in pieces:
        whole_messages(programmer.receive(piece))
    programmer.receive(bytes(LONGEST))  # the end of whatever was begun
    assert b"AVRISP_2" in programmer.receive(framed(b"\x01"))


@given(st.lists(COMMANDS, min_size=1, max_size=8))
def test_every_command_has_one_answer(commands: list[bytes]) -> None:
    programmer = _emulator.Programmer()
    assert whole_messages(programmer.receive(ENTER + b"".join(commands))) == 1 + len(commands)
