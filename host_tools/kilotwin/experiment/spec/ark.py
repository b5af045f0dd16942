"""Words to single robots, three to a message, as ARK packs them (hardware.md 1.13).

A word has 24 bits: the uid (10), a type (4), a value (10), highest first. A message of type 0 holds
three; the uid 1023 stands where there is none.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from kilotwin.experiment.spec.overhead import DATA_BYTES, message

WORDS = 3
"""In a message."""
MOST_UID, MOST_TYPE, MOST_VALUE = 1022, 15, 1023
NOBODY = 1023
_WORD_BYTES = DATA_BYTES // WORDS
_MESSAGE_TYPE = 0


@dataclass(frozen=True, slots=True)
class Word:
    """The word that one robot is told."""

    uid: int
    type: int
    value: int

    def __post_init__(self) -> None:
        for name, value, most in (
            ("uid", self.uid, MOST_UID),
            ("type", self.type, MOST_TYPE),
            ("value", self.value, MOST_VALUE),
        ):
            if not isinstance(value, int):
                raise TypeError(f"{name} is {value!r}; it must be a whole number")
            if not 0 <= value <= most:
                raise ValueError(f"{name} is {value}; it must be 0 to {most}")


def pack(words: Sequence[Word]) -> bytes:
    """A message, nine bytes and the type, of up to three words."""
    packed = b"".join((w.uid << 14 | w.type << 10 | w.value).to_bytes(3, "big") for w in words)
    nobody = (NOBODY << 14).to_bytes(_WORD_BYTES, "big")
    return message(packed + nobody * (WORDS - len(words)), _MESSAGE_TYPE)
