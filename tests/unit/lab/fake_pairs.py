"""Pairs of robots that hear each other, in a few lines of numpy: receivers that differ, noise.

An independent model of what runtime and emulator do: light that falls to 1/e in 25 mm, read by two
amplifiers, one five times the other (docs/experiments.md).
"""

import numpy as np

from kilotwin.experiment.spec.overhead import CALIB_MARK, WAKEUP
from kilotwin.files.flash_image import FlashImage
from kilotwin.files.headers import ALL_ROBOTS, GAINS, VITALS
from kilotwin.table.links.robot_link import Report, RobotLink, RobotState, slot_of


class FakePairs:
    """A RobotLink and its Jig: robots 1 and 2, 3 and 4 ... lie in pairs."""

    name = "fake"
    how = "fake"
    verifies = True
    laps_per_place = 1

    def __init__(self, robots: int, seed: int = 1, *, noise: float = 2.0) -> None:
        self.rng = np.random.default_rng(seed)
        self.noise = noise
        self.hears = 0.4
        self.sensitivity = 1 + 0.05 * np.clip(self.rng.normal(size=robots), -3, 3)
        self.mm = 0
        self.placed: list[int] = []
        self.read = np.zeros((robots, 2), int)
        self.count = np.zeros(robots, int)
        self.deaf: set[int] = set()
        self.forgetful: set[int] = set()
        self.eeprom = np.full((robots, 14, 2), 0xFFFF)
        self.written = 0
        self.running = True

    def place(self, mm: int) -> RobotLink:
        self.mm = mm
        self.placed.append(mm)
        return self

    def strength(self, index: int, mm: float) -> np.ndarray:
        """Both readings without noise."""
        low = 900 * self.sensitivity[index] * np.exp(-(mm - 33) / 25)
        return np.clip(np.floor(np.array([low, 5 * low]) + 0.5), 0, 1023)

    def ask(self, first: int, slots_log2: int, nonce: int, uid: int = ALL_ROBOTS) -> list[Report]:
        answers = []
        uids = range(1, len(self.read) + 1)
        slots = {uid: slot_of(uid, nonce, slots_log2) for uid in uids}
        for robot in sorted(set(uids) - self.deaf, key=lambda uid: slots[uid]):
            index = robot - 1
            if self.rng.random() < self.hears:
                answers.append(self._report(robot, first))
            partner = index ^ 1
            if first == VITALS and slots[partner + 1] != slots[robot]:
                noisy = self.strength(partner, self.mm) + self.noise * self.rng.normal(size=2)
                self.read[partner] = np.clip(np.floor(noisy + 0.5), 0, 1023)
                self.count[partner] += 1
        return answers

    def _report(self, uid: int, first: int) -> Report:
        index = uid - 1
        if first == VITALS:
            low, high = (int(gain) for gain in self.read[index])
            count = int(self.count[index]) % 4
            top = low >> 8 | high >> 8 << 2 | count << 4 | 0xC0
            content = bytes([0xFF, low & 255, high & 255, top])
        else:
            low, high = (int(gain) for gain in self.eeprom[index, first - GAINS])
            content = low.to_bytes(2, "big") + high.to_bytes(2, "big")
        state = (first % 16) * 16 + (RobotState.RUNNING if self.running else RobotState.IDLE)
        return Report(uid, first, content, state, (0, 0), 0)

    def repeat(self, message: bytes, hold_s: float) -> None:
        if message == WAKEUP:
            self.running = False
            return
        assert message[9] == 0x8A
        assert message[7:9] == CALIB_MARK
        uid, entry = int.from_bytes(message[1:3], "little"), message[0] - GAINS
        if self.running or uid in self.forgetful | self.deaf:
            return
        words = int.from_bytes(message[3:5], "big"), int.from_bytes(message[5:7], "big")
        self.eeprom[uid - 1, entry] = words
        self.written += 1

    def announce(self, image: FlashImage) -> None:
        raise NotImplementedError

    def send_page(self, page: int, data: bytes) -> None:
        raise NotImplementedError

    def close(self) -> None:
        """Nothing to release."""
