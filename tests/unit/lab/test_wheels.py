"""Duties that lead straight, from how a robot drove."""

import itertools

import numpy as np
import pytest

from kilotwin.table.lab.arcs import Drift
from kilotwin.table.lab.wheels import (
    DUTY,
    LEAST_DUTY,
    LEG_M,
    MOST_DUTY,
    MOST_TURN_DUTY,
    SPEED_M_S,
    TURN_DUTY,
    Wheels,
)

USUAL = SPEED_M_S / (2 * LEG_M * DUTY)


def drive(strength: tuple[float, float], duties: tuple[int, int], sd: float = 0.005) -> Drift:
    """Drive of a robot with these shares of the usual strength, as it is measured."""
    left, right = (USUAL * share * duty for share, duty in zip(strength, duties, strict=True))
    return Drift(left - right, sd, LEG_M * (left + right), 0.001, 3, 0)


@pytest.mark.parametrize(
    "strength", list(itertools.product((0.7, 0.85, 1.0, 1.15, 1.4), repeat=2)), ids=str
)
def test_a_few_measurements_lead_straight(strength: tuple[float, float]) -> None:
    wheels, duties = Wheels.unknown(), (DUTY, DUTY)
    for _ in range(3):
        wheels = wheels.after(duties, drive(strength, duties))
        duties = wheels.duties(wheels.speed_m_s((DUTY, DUTY)))
    turn, unlike = (abs(drive(strength, pair).turn_rad_s) for pair in (duties, (DUTY, DUTY)))
    assert turn < 0.012
    assert turn <= unlike + 0.005
    assert all(LEAST_DUTY <= duty <= MOST_DUTY for duty in duties)


def test_motors_that_are_not_proportional_are_met_by_a_bend_each_way() -> None:
    def bent(duties: tuple[int, int]) -> Drift:
        left, right = (
            USUAL * share * 70 * (duty / 70) ** 1.4
            for share, duty in zip((1.1, 0.9), duties, strict=True)
        )
        return Drift(left - right, 0.005, LEG_M * (left + right), 0.001, 3, 0)

    wheels, straight = Wheels.unknown(), (DUTY, DUTY)
    for number in range(4):
        trial = wheels.duties(wheels.speed_m_s(straight), 0.1 * (-1) ** number)
        wheels = wheels.after(trial, bent(trial))
        straight = wheels.duties(wheels.speed_m_s((DUTY, DUTY)))
    assert abs(bent((DUTY, DUTY)).turn_rad_s) > 0.1
    assert abs(bent(straight).turn_rad_s) < 0.02


def test_speed_stays_where_no_motor_is_at_its_end() -> None:
    wheels = Wheels(np.array([1.1, 0.9]) * USUAL, np.eye(2) * 1e-9)
    duties = wheels.duties(SPEED_M_S)
    assert abs(wheels.speed_m_s(duties) / SPEED_M_S - 1) < 0.05
    assert abs(wheels.turn_rad_s(duties)) < 0.003


def test_a_weak_motor_makes_the_robot_slower_not_bent() -> None:
    wheels = Wheels(np.array([1.1, 0.5]) * USUAL, np.eye(2) * 1e-9)
    left, right = wheels.duties(SPEED_M_S)
    assert MOST_DUTY - 5 <= right <= MOST_DUTY
    assert left < 50
    assert abs(wheels.turn_rad_s((left, right))) < 0.003


def test_what_is_known_grows_by_measuring() -> None:
    wheels = Wheels.unknown()
    after = wheels.after((DUTY, DUTY), drive((1, 1), (DUTY, DUTY)))
    assert after.turn_sd((DUTY, DUTY)) < 0.2 * wheels.turn_sd((DUTY, DUTY))
    assert after.speed_sd((DUTY, DUTY)) < wheels.speed_sd((DUTY, DUTY))


def test_a_weak_motor_gets_more_duty_for_its_turns() -> None:
    usual = Wheels.unknown()
    assert usual.turn_duties() == (TURN_DUTY, TURN_DUTY)
    assert usual.turn_shares((TURN_DUTY, 35)) == pytest.approx((1, 0.5))
    uneven = Wheels(usual.strength * np.array([0.9, 1.2]), usual.covariance)
    assert uneven.turn_duties() == (78, 58)
    assert uneven.turn_shares(uneven.turn_duties()) == pytest.approx((1, 1), abs=0.01)
    weak = Wheels(usual.strength * np.array([0.5, 9]), usual.covariance)
    assert weak.turn_duties() == (MOST_TURN_DUTY, LEAST_DUTY)
