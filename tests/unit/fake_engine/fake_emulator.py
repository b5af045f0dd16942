"""A stand-in for the compiled engine: its Python API, and faults on demand, without any physics.

Robots drift towards a site and show "resting" inside it. A program's name makes trouble: `dies`
kills the process in mid-run, `crashes` parks robots, `refused` is not accepted, `slow` takes its
time.
"""

import hashlib
import os
import signal
import struct
import time
from pathlib import Path
from typing import Any

import numpy as np

VERSION = "fake"
BUILD = "no compiler"
BOX2D_VERSION = "none"
GUEST_ABI = 1
TICK_S = 0.032768
WIRE = {"TYPE_CONFIG": 3}
_NAMES = [
    "RULE",
    "ALPHA",
    "BETA",
    "FIRAT_A",
    "FIRAT_K",
    "UPDATE_TICKS",
    "STRAIGHT_TICKS",
    "ENTRY_TICKS",
    "RHO",
    "TURN_TICKS_PER_RAD",
    "WINDOW_TICKS",
    "TIMEOUT_TICKS",
    "CAPACITY",
    "EMPTY_WINDOWS",
    "INFORMED_SITE",
    "STEP_TICKS",
    "WALL_IGNORE_TICKS",
    "LEAVE_TURN",
    "TRACKING_TICKS",
    "SIGNAL_FROM",
    "FIRST_LEAVE",
    "WALK_OUT",
    "ENTRY_OBSTACLE",
    "COUNT_SELF",
    "FIRAT_JOIN",
    "FIRAT_SIGNAL_FROM",
    "START_ON_SITE",
    "UPDATE_CLOCK",
    "PUSHED_OFF",
]
CONFIG_KEYS = {name: (number, 0, 0, 0xFFFFFFFF) for number, name in enumerate(_NAMES, start=1)}

_DIES_AT_TICK = 1000
_RESTING_LED = 0x3F


class EngineError(ValueError):
    """Something wrong with a spec."""


def end_with_parent(parent: int, grace_s: float) -> None:
    """Its programs never hang: a closed stdin ends it."""


def confine(**left: Any) -> list[str]:
    """Its programs do no harm."""
    return []


def lacking_layers() -> list[str]:
    return []


def reference_loop_s() -> float:
    return 0.5


def config_message(uid_first: int, uid_last: int, key: int, value: int) -> bytes:
    """As wire.h says."""
    return struct.pack("<HHBIB", uid_first, uid_last, key, value, WIRE["TYPE_CONFIG"])


class Simulation:
    """The engine's one class."""

    def __init__(self, spec: dict[str, Any], *, powered: bool = True) -> None:
        self._spec = spec
        self._programs = [group["name"] for group in spec["groups"] for _ in range(group["count"])]
        if powered:
            self.power_up()
        self.robots = len(self._programs)
        self.tick = 0
        random = np.random.default_rng(spec["seed"])
        half = spec["arena"]["width_m"] / 2
        self._start = random.uniform(-0.7 * half, 0.7 * half, (self.robots, 2))
        self._taken: list[int] = []
        self._next_sample = 0
        self._events: list[dict[str, Any]] = []

    def power_up(self) -> None:
        if "refused" in self._programs:
            raise EngineError("there is no room for 7 of the robots")

    def advance(self, ticks: int) -> None:
        end = self.tick + ticks
        if "slow" in self._programs:
            time.sleep(0.002)
        if "dies" in self._programs and end >= _DIES_AT_TICK:
            robot = self._programs.index("dies")
            black_box = Path(self._spec["black_box"])
            black_box.write_bytes(struct.pack("=QII48xII", 1, 1, 1, robot, _DIES_AT_TICK))
            os.kill(os.getpid(), signal.SIGSEGV)
        if self.tick == 0:
            self._events += [
                {"tick": 0, "robot": robot, "program": name, "kind": "crash", "text": "SIGSEGV"}
                for robot, name in enumerate(self._programs)
                if name == "crashes"
            ]
        while self._next_sample <= end:
            self._taken.append(self._next_sample)
            self._next_sample += self._spec["sample_ticks"]
        self.tick = end

    def samples(self) -> dict[str, Any]:
        taken, self._taken = self._taken, []
        return self._at(taken)

    def snapshot(self) -> dict[str, Any]:
        return self._at([self.tick])

    def events(self) -> list[dict[str, Any]]:
        events, self._events = self._events, []
        return events

    def result_hash(self) -> str:
        return hashlib.sha256(self.snapshot()["x_m"].tobytes()).hexdigest()[:16]

    final_hash = result_hash

    def decisions(self) -> np.ndarray:
        return np.full(self.robots, 4, dtype=np.uint32)

    def stats(self) -> dict[str, int | float]:
        return {
            "frames_sent": 0,
            "frames_received": 0,
            "steps": 100,
            "island_steps": 25 * self.robots,
            "worst_overlap_fraction": 0.01,
        }

    def hummed_s(self) -> "np.ndarray[Any, np.dtype[np.float64]]":
        return np.zeros(self.robots)

    def listen_to(self, robots: list[int]) -> None:
        pass

    def heard_by(self, robot: int) -> list[tuple[int, bytes, int]]:
        return []

    def _at(self, taken: list[int]) -> dict[str, Any]:
        shape = (len(taken), self.robots)
        sites = self._spec["sites"]
        centres = np.array([site["centre_m"] for site in sites]).reshape(-1, 2)
        x, y = np.empty(shape, np.float32), np.empty(shape, np.float32)
        site = np.zeros(shape, np.uint8)
        for row, tick in enumerate(taken):
            place = self._start
            if len(sites):
                goal = centres[np.arange(self.robots) % len(sites)]
                spread = 0.6 * sites[0]["width_m"] / self._spec["arena"]["width_m"]
                goal = goal + spread * self._start
                place = goal + (self._start - goal) * np.exp(-tick / 50_000)
            x[row], y[row] = place.T
            for number, area in enumerate(sites, start=1):
                away = np.hypot(*(place - area["centre_m"]).T)
                site[row][away < area["width_m"] / 2] = number
        led = np.where(site > 0, np.uint8(_RESTING_LED), np.uint8(0))
        heading = np.broadcast_to(np.linspace(-3, 3, self.robots, dtype=np.float32), shape)
        return {
            "tick": np.array(taken, np.int64),
            "x_m": x,
            "y_m": y,
            "heading_rad": heading.copy(),
            "led": led.astype(np.uint8),
            "site": site,
        }
