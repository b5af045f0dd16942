"""The strength of a robot's two motors, learned from how it drove, and the duties that follow.

Model: the speed of a wheel is proportional to its duty. Left at duty l with strength a, right at r
with b, the robot turns by l a - r b and drives at l a + r b times the distance of its legs from its
middle line (hardware.md 2). Real motors are not quite proportional: each new measurement therefore
weighs more than those before it, and the last ones, at nearly the right duties, decide.

Pure. Strengths in rad/s for each unit of duty.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kilotwin.table.lab.arcs import Drift

LEG_M = 0.0125
"""From a robot's middle line to a rear leg, about which its other motor turns it."""
SPEED_M_S = 0.0135
DUTY = 65
"""A usual robot: this speed at this duty of both motors (hardware.md 2)."""
MOST_DUTY = 80
"""Motors must stay below 90 (hardware.md 2), and are less proportional near it."""
LEAST_DUTY = 20
TURN_DUTY = 70
"""Duty of one motor, with which a usual robot turns by 45 degrees a second (hardware.md 2)."""
MOST_TURN_DUTY = 85
"""Highest duty of one motor alone: below 90, too."""

USUAL_STRENGTH = SPEED_M_S / (2 * LEG_M * DUTY)
"""Strength of a usual robot's motors."""

_SPREAD = 0.25
# Change of a strength from one measurement to the next: motors are not proportional.
_FORGETTING = 0.008
# Duties are whole numbers: so far from the exact ones a better pair may lie.
_REACH = 4
# How much a change of speed counts against the same share of straightness.
_SPEED_COUNTS = 0.02

Duties = tuple[int, int]


@dataclass(frozen=True)
class Wheels:
    """A robot's motors, as far as is known."""

    strength: NDArray[np.float64]
    covariance: NDArray[np.float64]

    @staticmethod
    def unknown() -> "Wheels":
        """A robot that has not been seen driving."""
        return Wheels(np.full(2, USUAL_STRENGTH), np.eye(2) * (_SPREAD * USUAL_STRENGTH) ** 2)

    def after(self, duties: Duties, drift: Drift) -> "Wheels":
        """The motors as known after it drove with these duties."""
        left, right = duties
        rows = np.array([[left, -right], [LEG_M * left, LEG_M * right]], dtype=float)
        seen = np.array([drift.turn_rad_s, drift.speed_m_s])
        noise = np.diag([drift.turn_sd**2, drift.speed_sd**2])
        before = self.covariance + np.diag((_FORGETTING * self.strength) ** 2)
        gain = before @ rows.T @ np.linalg.inv(rows @ before @ rows.T + noise)
        strength = self.strength + gain @ (seen - rows @ self.strength)
        return Wheels(
            np.maximum(strength, 0.2 * USUAL_STRENGTH), (np.eye(2) - gain @ rows) @ before
        )

    def turn_rad_s(self, duties: Duties) -> float:
        """How fast it turns when both motors run."""
        return float(duties[0] * self.strength[0] - duties[1] * self.strength[1])

    def speed_m_s(self, duties: Duties) -> float:
        """How fast it drives."""
        return float(LEG_M * (duties[0] * self.strength[0] + duties[1] * self.strength[1]))

    def turn_sd(self, duties: Duties) -> float:
        """How well turn_rad_s() is known: standard deviation."""
        row = np.array([duties[0], -duties[1]], dtype=float)
        return float(np.sqrt(row @ self.covariance @ row))

    def speed_sd(self, duties: Duties) -> float:
        """How well speed_m_s() is known."""
        row = LEG_M * np.array(duties, dtype=float)
        return float(np.sqrt(row @ self.covariance @ row))

    def duties(self, speed_m_s: float, turn_rad_s: float = 0.0) -> Duties:
        """Whole duties for this speed and this turning; slower if one had to exceed MOST_DUTY."""
        left, right = self.strength
        wheel = speed_m_s / (2 * LEG_M)
        wheel = min(wheel, MOST_DUTY * left - turn_rad_s / 2, MOST_DUTY * right + turn_rad_s / 2)
        exact = (wheel + turn_rad_s / 2) / left, (wheel - turn_rad_s / 2) / right
        pairs: list[Duties] = [(one, other) for one in _near(exact[0]) for other in _near(exact[1])]

        def cost(pair: Duties) -> float:
            turn = abs(self.turn_rad_s(pair) - turn_rad_s) / wheel
            slower = abs(self.speed_m_s(pair) / (2 * LEG_M * wheel) - 1)
            return float(turn + _SPEED_COUNTS * slower)

        return min(pairs, key=cost)

    def turn_duties(self, middle: float = USUAL_STRENGTH) -> Duties:
        """Duties with which it turns, left and right by one motor alone, as a motor of strength
        `middle` does at TURN_DUTY.

        The motor that turns it on the spot is the one that was seen on its way: its rate goes by
        its strength.
        """
        left, right = (TURN_DUTY * middle / strength for strength in self.strength)
        return _turn(left), _turn(right)

    def turn_shares(self, duties: Duties) -> tuple[float, float]:
        """How fast it turns on the spot, left and right, as shares of a usual robot's rate."""
        left, right = np.array(duties) * self.strength / (TURN_DUTY * USUAL_STRENGTH)
        return float(left), float(right)


def _turn(duty: float) -> int:
    return min(max(round(duty), LEAST_DUTY), MOST_TURN_DUTY)


def _near(duty: float) -> range:
    whole = min(max(round(duty), LEAST_DUTY), MOST_DUTY)
    return range(max(whole - _REACH, LEAST_DUTY), min(whole + _REACH, MOST_DUTY) + 1)
