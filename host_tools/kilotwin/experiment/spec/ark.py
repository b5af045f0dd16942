"""Words to single robots, three to a message, as ARK packs them (hardware.md 1.13).

A word has 24 bits: uid, type and value, highest first; of ARK's today 10, 4 and 10, of older ones
other numbers. A message of type 0 holds three; a uid of ones stands where there is none.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from kilotwin.experiment.spec.overhead import DATA_BYTES, message

WORDS = 3
"""In a message."""
WORD_BITS = 24
_WORD_BYTES = DATA_BYTES // WORDS
MESSAGE_TYPE = 0
"""The type of messages with words."""


@dataclass(frozen=True, slots=True)
class Word:
    """The word that one robot is told."""

    uid: int
    type: int
    value: int


@dataclass(frozen=True, slots=True)
class Layout:
    """How many of a word's 24 bits its uid, its type and its value have."""

    uid_bits: int
    type_bits: int
    value_bits: int

    @property
    def most_uid(self) -> int:
        """The highest uid that a word reaches."""
        return self._nobody - 1

    @property
    def _nobody(self) -> int:
        return (1 << self.uid_bits) - 1

    def word(self, uid: int, type: int, value: int) -> Word:
        """TypeError of what is no whole number, ValueError of what has no room."""
        for name, number, most in (
            ("uid", uid, self.most_uid),
            ("type", type, (1 << self.type_bits) - 1),
            ("value", value, (1 << self.value_bits) - 1),
        ):
            if not isinstance(number, int):
                raise TypeError(f"{name} is {number!r}; it must be a whole number")
            if not 0 <= number <= most:
                raise ValueError(f"{name} is {number}; it must be 0 to {most}")
        return Word(uid, type, value)

    def pack(self, words: Sequence[Word]) -> bytes:
        """A message, nine bytes and the type, of up to three words."""
        nobody = Word(self._nobody, 0, 0)
        filled = [*words, *[nobody] * (WORDS - len(words))]
        return message(b"".join(map(self._bytes_of, filled)), MESSAGE_TYPE)

    def _bytes_of(self, word: Word) -> bytes:
        below = word.type << self.value_bits | word.value
        return (word.uid << WORD_BITS - self.uid_bits | below).to_bytes(_WORD_BYTES, "big")
