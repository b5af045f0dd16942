"""A fuzzer for decoders in Python: seeds, changed at random, as many as wanted.

Without coverage: what steers it are real inputs to begin with, words that inputs have, and that
inputs which were not refused at once are changed further. The same seed gives the same inputs.
"""

import math
import random
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from .python_targets import PythonTarget

_CORPUS_MOST = 500


class FindingError(AssertionError):
    """A decoder raised what it should not."""


def _flip(data: bytearray, rng: random.Random, _: list[bytes], __: tuple[bytes, ...]) -> None:
    if data:
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)


def _set(data: bytearray, rng: random.Random, _: list[bytes], __: tuple[bytes, ...]) -> None:
    if data:
        data[rng.randrange(len(data))] = rng.randrange(256)


def _cut(data: bytearray, rng: random.Random, _: list[bytes], __: tuple[bytes, ...]) -> None:
    at = rng.randrange(len(data) + 1)
    del data[at : at + rng.choice((1, 2, 8, 64, 1 << 20))]


def _repeat(data: bytearray, rng: random.Random, _: list[bytes], __: tuple[bytes, ...]) -> None:
    at = rng.randrange(len(data) + 1)
    piece = data[at : at + rng.choice((1, 4, 16, 80))]
    data[at:at] = piece * rng.choice((*(1,) * 30, 60))


def _word(data: bytearray, rng: random.Random, _: list[bytes], words: tuple[bytes, ...]) -> None:
    at = rng.randrange(len(data) + 1)
    word = rng.choice(words) if words else rng.randbytes(4)
    data[at : at + rng.choice((0, 0, len(word)))] = word * rng.choice((*(1,) * 30, 1500))


def _splice(data: bytearray, rng: random.Random, corpus: list[bytes], _: tuple[bytes, ...]) -> None:
    other = rng.choice(corpus)
    at = rng.randrange(len(other) + 1)
    data[rng.randrange(len(data) + 1) :] = other[at:]


_CHANGES: tuple[Callable[..., None], ...] = (_flip, _set, _cut, _repeat, _word, _word, _splice)


def inputs(target: PythonTarget, seed: int) -> Iterator[bytes]:
    """Inputs without end: the seeds first."""
    corpus = target.seeds()
    yield b""
    yield from corpus
    rng = random.Random(seed)
    while True:
        data = bytearray(rng.choice(corpus))
        for _ in range(rng.choice((1, 1, 2, 3, 6))):
            rng.choice(_CHANGES)(data, rng, corpus, target.words)
        made = bytes(data[: target.longest])
        if rng.random() < 0.001:
            corpus.append(made)
            if len(corpus) > _CORPUS_MOST:
                corpus[rng.randrange(len(corpus) // 2, len(corpus))] = corpus.pop()
        yield made


def fuzz(target: PythonTarget, found: Path, *, runs: int, seconds: float, seed: int = 1) -> int:
    """Feeds the decoder until `runs` inputs or `seconds` are over; how many it took.

    FindingError, with the input kept in the file `found`, for anything that it raises.
    """
    end = math.inf
    count = 0
    for data in inputs(target, seed):
        if count == 0:
            end = time.monotonic() + seconds  # the seeds are made, which may take longer
        if count >= runs or (count % 256 == 0 and time.monotonic() > end):
            break
        try:
            target.take(data)
        except Exception as error:
            found.write_bytes(data)
            raise FindingError(
                f"{type(error).__name__}: {error}; the input is in {found}"
            ) from error
        count += 1
    return count
