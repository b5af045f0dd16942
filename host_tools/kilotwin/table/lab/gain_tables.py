"""A robot's gain tables from what its receiver read at known distances, and what they are worth.

Two readings for each of 14 distances, 33, 38 ... 98 mm, centre to centre; robots estimate distances
by them (hardware.md 1.10). Pure.
"""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kilotwin import _emulator
from kilotwin.files.headers import GAIN_DISTANCES_MM, GAIN_ENTRIES, MOST_READING
from kilotwin.table.links.robot_link import Gains

LEAST_REACH_MM = 78
"""Tables that are measured up to here tell how both gains fall."""

# Entries from which the fall beyond the last one is taken.
_FALL_STEPS = 3


@dataclass(frozen=True)
class GainTables:
    """Both tables of a robot, by entry."""

    low: tuple[int, ...]
    high: tuple[int, ...]

    def entry(self, index: int) -> Gains:
        """Both readings at GAIN_DISTANCES_MM[index]."""
        return Gains(self.low[index], self.high[index])

    def estimates_mm(self, readings: Sequence[Gains]) -> list[int]:
        """The distances that a robot with these tables makes of readings, 33 to 255."""
        pairs = [(reading.low, reading.high) for reading in readings]
        return _emulator.estimate_distances(self.low, self.high, pairs)


def tables_of(entries: Sequence[Gains]) -> GainTables | None:
    """The tables of an EEPROM; None of an erased one, which tells no distances."""
    low, high = [entry.low for entry in entries], [entry.high for entry in entries]
    if max(low) > MOST_READING or max(high) > MOST_READING:
        return None
    return GainTables(tuple(low), tuple(high))


def reach_mm(readings: Mapping[int, Sequence[Gains]]) -> int | None:
    """The farthest of GAIN_DISTANCES_MM up to which there are readings at all of them."""
    near = list(itertools.takewhile(readings.get, GAIN_DISTANCES_MM))
    return near[-1] if near else None


def fitted(readings: Mapping[int, Sequence[Gains]]) -> GainTables | None:
    """The tables of readings at GAIN_DISTANCES_MM; None if they do not reach far enough.

    An entry is the mean of the middle half of its readings, so that stray ones do not count.
    Entries fall with the distance: where noise has them rise, both become their mean. Those beyond
    the reach of the robot's partner go on falling as the last ones did.
    """
    reach = reach_mm(readings)
    if reach is None or reach < LEAST_REACH_MM:
        return None
    near = [mm for mm in GAIN_DISTANCES_MM if mm <= reach]
    low = _falling([[gains.low for gains in readings[mm]] for mm in near])
    high = _falling([[gains.high for gains in readings[mm]] for mm in near])
    # The low gain is never at its limit there.
    fall = (max(low[-1], 1.0) / max(low[-1 - _FALL_STEPS], 1.0)) ** (1 / _FALL_STEPS)
    beyond = fall ** np.arange(1, GAIN_ENTRIES - len(near) + 1)
    return GainTables(
        _whole(np.concatenate([low, low[-1] * beyond])),
        _whole(np.concatenate([high, high[-1] * beyond])),
    )


def mean_of(tables: Sequence[GainTables]) -> GainTables:
    """One table for all of these robots."""
    low = np.mean([table.low for table in tables], axis=0)
    high = np.mean([table.high for table in tables], axis=0)
    return GainTables(_whole(low), _whole(high))


def errors_mm(tables: GainTables, readings: Mapping[int, Sequence[Gains]]) -> NDArray[np.float64]:
    """How far each estimate of readings at known distances is off: mm, above 0 if too far."""
    off = [estimate - mm for mm, some in readings.items() for estimate in tables.estimates_mm(some)]
    return np.array(off, dtype=np.float64)


def _falling(readings: Sequence[Sequence[int]]) -> NDArray[np.float64]:
    """Neighbours that rise are pooled until none do (pool adjacent violators)."""
    pools: list[tuple[float, int]] = []
    for some in readings:
        pools.append((_middle_mean(some), 1))
        while len(pools) > 1 and pools[-1][0] > pools[-2][0]:
            (value, count), (before, more) = pools.pop(), pools.pop()
            pools.append(((value * count + before * more) / (count + more), count + more))
    return np.repeat([value for value, _ in pools], [count for _, count in pools])


def _middle_mean(readings: Sequence[int]) -> float:
    cut = len(readings) // 4
    return float(np.mean(np.sort(readings)[cut : len(readings) - cut]))


def _whole(values: NDArray[np.float64]) -> tuple[int, ...]:
    return tuple(int(value) for value in np.floor(values + 0.5))
