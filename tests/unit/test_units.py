"""Seconds and real numbers in the firmware's units."""

import pytest

from kilotwin.files.headers import number_of
from kilotwin.units import CYCLES_PER_S, TICK_CYCLES, TICK_S, q16, seconds, ticks


@pytest.mark.parametrize(
    ("duration_s", "expected"),
    [(0, 0), (0.59, 18), (2.0, 61), (5.0, 153), (10.0, 305), (2.5, 76), (30_000, 915_527)],
)
def test_seconds_become_the_nearest_tick(duration_s: float, expected: int) -> None:
    assert ticks(duration_s) == expected


def test_ticks_last_32768_microseconds() -> None:
    assert seconds(1_000_000) == pytest.approx(32_768)


def test_reals_become_q16() -> None:
    assert q16(2.25) == 147_456


def test_a_kilobots_turn_time_is_the_firmwares_default() -> None:
    assert q16(1.27 / TICK_S) == 2_540_000


def test_a_tick_is_the_chips() -> None:
    timer = "firmware/kilolib/core/timer.h"
    counts, cycles = number_of(timer, "TICK_COUNTS"), number_of(timer, "COUNT_CYCLES")
    assert counts * cycles == TICK_CYCLES
    assert 1000 * number_of(timer, "CYCLES_PER_MS") == CYCLES_PER_S
