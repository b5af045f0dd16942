"""The trail of a run that is repeated to tell why a robot did something (emulator/robots/trail.h):
asked for by the parent, kept by the worker, and a file of the run folder."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kilotwin.errors import RunError

if TYPE_CHECKING:
    from kilotwin._emulator import Trail as TrailOfEngine

CAPACITY = 1 << 20
"""Entries of each list that are kept, the newest ones: 100 to 200 MB, if a run fills them."""

_ARRAYS, _PATHS = "trail.npz", "trail.json"

Extents = tuple[tuple[int, int], ...]
"""Byte addresses of code, [begin, end) each."""


@dataclass(frozen=True)
class Trail:
    """A trail to be kept. The run ends at the tick `end_tick`. `draws`: of each robot, the
    code that draws random numbers. `robot`, by index, and its variable from the address `begin` to
    before `end`, of which each change is kept; none if both are 0."""

    end_tick: int
    draws: tuple[Extents, ...]
    robot: int = 0
    begin: int = 0
    end: int = 0


@dataclass(frozen=True)
class Recorded:
    """A trail as the engine wrote it down; emulator/python/trail.cpp names the fields."""

    arrivals: NDArray[np.void]
    writes: NDArray[np.void]
    sendings: NDArray[np.void]
    paths: Sequence[Sequence[int]]
    forgotten: int


def write_trail(folder: Path, arrivals: NDArray[np.void], told: "TrailOfEngine") -> None:
    """Makes files of a run folder of what the engine told."""
    with (folder / _ARRAYS).open("wb") as file:
        np.savez(file, arrivals=arrivals, writes=told["writes"], sendings=told["sendings"])
    beside = {"paths": told["paths"], "forgotten": told["forgotten"]}
    (folder / _PATHS).write_text(json.dumps(beside))


def read_trail(folder: Path) -> Recorded:
    """That of a run folder. RunError if it is none: a program can write there."""
    try:
        beside: dict[str, Any] = json.loads((folder / _PATHS).read_text())
        with np.load(folder / _ARRAYS, allow_pickle=False) as arrays:
            arrivals, writes, sendings = arrays["arrivals"], arrays["writes"], arrays["sendings"]
        paths = [[int(address) for address in path] for path in beside["paths"]]
        return Recorded(arrivals, writes, sendings, paths, int(beside["forgotten"]))
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise RunError(f"the repeated run left no trail ({error})") from None
