"""Marks that a translation leaves of what has run in this process (COVER, translated/code.h)."""

import contextlib
import ctypes
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from kilotwin.files.flash_map import FLASH_BYTES
from kilotwin.programs.native.guest import COVERED_BYTES

Marks = Mapping[int, int]
"""By byte address in flash: RAN of a block that begins there, TAKEN and NOT_TAKEN of the branch
there; a block of one instruction may have all."""
RAN, TAKEN, NOT_TAKEN = 1, 2, 4
BITS = RAN, TAKEN, NOT_TAKEN, 8, 16
"""All that a mark may have, also where messages and ticks have interrupted. Addresses behind the
flash are those of the stack's depths (emulator/robots/translated/code.h)."""

_DEPTHS = 0x1000
_OF_TRANSLATION, _OF_NATIVE = "translation_coverage", "kt_coverage"


def marks_of(guest: str) -> dict[int, int]:
    """Those of a guest that the engine has loaded, of all robots that have run it in this process.

    Of a native one RAN, by the address that a call at a block's begin returns to. ValueError if it
    was not built for coverage.
    """
    scale, marks = _marks_in(guest)
    whole = np.frombuffer(bytes(marks), np.uint8)
    (there,) = np.nonzero(whole)
    return dict(zip((scale * there).tolist(), whole[there].tolist(), strict=True))


def _marks_in(guest: str) -> "tuple[int, ctypes.Array[ctypes.c_uint8]]":
    """The marks where they are made, and how many addresses one of them stands for."""
    library = ctypes.CDLL(guest)  # the one that is loaded: no file is opened
    with contextlib.suppress(ValueError):
        return 2, (ctypes.c_uint8 * (FLASH_BYTES // 2 + _DEPTHS)).in_dll(library, _OF_TRANSLATION)
    return 1, (ctypes.c_uint8 * COVERED_BYTES).in_dll(library, _OF_NATIVE)


def clear(guests: Iterable[str]) -> None:
    """Takes the marks of guests away, so that those of the next trial are its own."""
    for guest in guests:
        with contextlib.suppress(ValueError):
            _, marks = _marks_in(guest)
            ctypes.memset(marks, 0, len(marks))


def marks_of_all(guests: Iterable[str]) -> list[list[tuple[int, int]]]:
    """Those of each guest, for a message; none of one that was not built for coverage."""
    told = []
    for guest in guests:
        with contextlib.suppress(ValueError):
            told.append(list(marks_of(guest).items()))
            continue
        told.append([])
    return told


def understood(told: Sequence[Sequence[Sequence[int]]]) -> list[dict[int, int]]:
    """Such a message. A program may have written it: ValueError or TypeError if it is none."""
    return [{int(address): int(mark) for address, mark in marks} for marks in told]


def merged(several: Iterable[Marks]) -> dict[int, int]:
    """The marks of several runs of one program, put together."""
    all_of_them: dict[int, int] = {}
    for marks in several:
        for address, mark in marks.items():
            all_of_them[address] = all_of_them.get(address, 0) | mark
    return all_of_them
