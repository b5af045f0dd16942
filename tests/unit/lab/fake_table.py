"""Robots on a table of cells, in a few lines of numpy: motors that differ, walls, cells that hear.

An independent model of what the emulator computes in C++: legs, spreads and motor noise by
docs/experiments.md, no contacts between robots.
"""

import numpy as np

from kilotwin.experiment.spec.overhead import CALIB_MARK
from kilotwin.files.flash_image import FlashImage
from kilotwin.files.headers import ALL_ROBOTS
from kilotwin.table.lab.motor_rounds import CELL_M
from kilotwin.table.lab.wheels import LEG_M, SPEED_M_S
from kilotwin.table.links.robot_link import Report, RobotState, slot_of
from kilotwin.units import TICK_S

BEHIND_M = 0.0092
STEP_S = 0.25
RADIUS_M = 0.0165


class FakeTable:
    """A RobotLink and its Clock; the robots begin with the uids 1, 2, 3 ..."""

    name = "fake"
    verifies = True
    laps_per_place = 1

    def __init__(
        self, columns: int, rows: int, robots: int, seed: int = 1, *, noise: float = 0.16
    ) -> None:
        self.rng = np.random.default_rng(seed)
        self.size = np.array([columns, rows]) * 2 * CELL_M
        self.rows = rows
        self.noise = noise
        self.hears = 0.4
        self.deaf: set[int] = set()
        self.uids = list(range(1, robots + 1))
        self.now = 0.0
        self.at = self.rng.uniform(0.08, 1, (robots, 2)) * (self.size - 0.16) + 0.04
        self.heading = self.rng.uniform(0, 2 * np.pi, robots)
        spread = np.clip(self.rng.normal(size=(robots, 3)), -3, 3)
        strength = (1 + 0.04 * spread[:, 2:]) * (1 + 0.2 * spread[:, :2])
        self.strength = strength * SPEED_M_S / (2 * LEG_M)
        self.motors = np.zeros((robots, 2))
        self.wobble = np.ones((robots, 2))
        self.state = np.full(robots, RobotState.IDLE)
        self.saved = np.full((robots, 4), 255)

    def turn_per_m(self, index: int, left: int, right: int) -> float:
        """How far a robot turns in a metre, without noise: rad/m."""
        wheels = self._wheels(np.array([[left, right]]), self.strength[[index]])[0]
        return float((wheels[0] - wheels[1]) / (LEG_M * wheels.sum()))

    @staticmethod
    def _wheels(duties: np.ndarray, strength: np.ndarray) -> np.ndarray:
        wheels: np.ndarray = np.minimum(duties / 70, 1.2) * strength
        return wheels

    def now_s(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        end = self.now + seconds
        while self.now < end:
            if int(self.now) != int(self.now - STEP_S):
                self.wobble = 1 + self.noise * np.clip(
                    self.rng.normal(size=self.motors.shape), -3, 3
                )
            wheels = self._wheels(self.motors, self.strength) * self.wobble
            both = (self.motors > 0).all(axis=1, keepdims=True)
            wheels = np.where(both, wheels, wheels * 0.785 / (SPEED_M_S / (2 * LEG_M)))
            turn = wheels[:, 0] - wheels[:, 1]
            along, aside = LEG_M * wheels.sum(axis=1), BEHIND_M * turn
            cos, sin = np.cos(self.heading), np.sin(self.heading)
            self.at += STEP_S * np.stack([along * cos - aside * sin, along * sin + aside * cos], 1)
            self.at = np.clip(self.at, RADIUS_M, self.size - RADIUS_M)
            self.heading += STEP_S * turn
            self.now += STEP_S

    def repeat(self, message: bytes, hold_s: float) -> None:
        if message[9] == 0x85:  # WAKEUP
            self.state[:], self.motors[:] = RobotState.IDLE, 0
            self.sleep(hold_s)
            return
        assert message[9] == 0x8A
        mode, duties = message[0], np.frombuffer(message[3:7], np.uint8)
        for index in range(len(self.at)):
            only = message[7:9] == CALIB_MARK
            uid = int.from_bytes(message[1:3], "little")
            if index + 1 in self.deaf or (only and uid != self.uids[index]):
                continue
            if mode == 0:
                if self.state[index] == RobotState.MOVING:
                    self.saved[index] = duties
                    self.uids[index] = uid
                    self.state[index], self.motors[index] = RobotState.IDLE, 0
                continue
            self.state[index] = RobotState.MOVING
            left, right, straight_left, straight_right = duties
            self.motors[index] = {
                1: (0, 0),
                2: (left, 0),
                3: (0, right),
                4: (straight_left, straight_right),
            }[mode]
        self.sleep(hold_s)

    def ask(self, first: int, slots_log2: int, nonce: int, uid: int = ALL_ROBOTS) -> list[Report]:
        began = self.now
        answers = []
        for index in sorted(
            range(len(self.at)), key=lambda index: slot_of(index + 1, nonce, slots_log2)
        ):
            due_s = began + slot_of(index + 1, nonce, slots_log2) * TICK_S
            self.sleep(max(0.0, due_s - self.now))
            if index + 1 in self.deaf or self.rng.random() > self.hears:
                continue
            column, row = (int(part) for part in self.at[index] // CELL_M)
            answers.append(
                Report(
                    self.uids[index],
                    first,
                    bytes(4),
                    16 + self.state[index],
                    (column // 2, row // 2),
                    column % 2 + 2 * (row % 2 == 0),
                )
            )
        self.sleep(max(0.0, began + 1.3 - self.now))
        return answers

    def announce(self, image: FlashImage) -> None:
        raise NotImplementedError

    def send_page(self, page: int, data: bytes) -> None:
        raise NotImplementedError

    def close(self) -> None:
        """Nothing to release."""
