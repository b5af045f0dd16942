"""How far a run may go now: at its speed, not at all, or some steps."""

import math

import pytest

from kilotwin.session.pace import Pace
from kilotwin.units import TICK_S


def test_unless_asked_it_goes_as_fast_as_it_can() -> None:
    pace = Pace()
    assert pace.ticks(0.0, 0) > 1_000_000
    assert pace.wait_s(0.0, 0) == 0


def test_paused_it_does_not_go_on_until_it_is_told_to() -> None:
    pace = Pace()
    pace.pause()
    assert pace.ticks(100.0, 5) == 0
    assert math.isinf(pace.wait_s(100.0, 5))
    pace.resume(200.0, 5)
    assert pace.ticks(200.0, 5) > 1_000_000


def test_a_step_ends_where_it_was_to_and_pauses_there() -> None:
    pace = Pace()
    pace.pause()
    pace.step(0.0, 10, 13)
    assert pace.ticks(0.0, 10) == 3
    assert pace.ticks(0.0, 12) == 1
    assert pace.ticks(0.0, 13) == 0
    assert pace.paused


@pytest.mark.parametrize("speed", [0.1, 1.0, 10.0, 1000.0])
def test_at_a_speed_it_keeps_to_the_wall(speed: float) -> None:
    pace, tick, now_s = Pace(), 40, 7.0
    pace.go_at(now_s, tick, speed)
    while now_s < 9:
        tick += pace.ticks(now_s, tick)
        now_s += max(1e-6, min(0.01, pace.wait_s(now_s, tick)))
    assert (tick - 40) * TICK_S == pytest.approx(2 * speed, abs=0.02 * speed + TICK_S)


def test_after_a_pause_it_does_not_make_up_for_it() -> None:
    pace = Pace()
    pace.go_at(0.0, 0, 1.0)
    pace.pause()
    pace.resume(1000.0, 0)
    assert pace.ticks(1000.0 + 1.5 * TICK_S, 0) == 1
    assert pace.wait_s(1000.0, 0) == pytest.approx(TICK_S)
