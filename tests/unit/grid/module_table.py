"""A table of Kilogrid modules for tests of the host: what hardware.md 3.2 to 3.4 says, in Python.

Its modules sit on python-can buses and live by the test's clock. It is written from the facts
alone and shares no code with the host, so that both cannot err in the same way.
"""

import math
from collections import deque
from dataclasses import dataclass, field

import can

Module = tuple[int, int]

BOOT_S = 1.2
RING = 10
IDLE_S = 0.07


@dataclass
class FakeModule:
    """One module: state, configuration, reports not fetched yet."""

    x: int
    y: int
    state: str = "IDLE"
    configuration: bytes = b""
    configurations: list[bytes] = field(default_factory=list)
    pause_s: float = 0.0
    """How long loop() takes, which answers wait for."""
    size: int = 0
    next_chunk: int = 0
    faulty: bool = False
    set_up: bool = False
    runs: int = 0
    boots: int = 1
    forwarded: list[bytes] = field(default_factory=list)
    repeating: bytes | None = None
    ring: deque[bytes] = field(default_factory=deque)
    lost: int = 0
    deaf_until_s: float = 0.0
    dead: bool = False
    last_frame_s: float = -1.0
    least_gap_s: float = 1e9
    asked: int = 0
    pending: list[bytes] = field(default_factory=list)


class ModuleTable:
    """Modules on buses; `ours` answer for their health, original ones do not."""

    def __init__(
        self, buses: list[can.BusABC], modules_of: list[list[Module]], *, ours: bool = True
    ) -> None:
        self._buses = buses
        self.ours = ours
        self.modules = {module: FakeModule(*module) for modules in modules_of for module in modules}
        self._of_bus = [[self.modules[module] for module in modules] for modules in modules_of]
        self._answers: list[tuple[float, int, int, bytes]] = []
        self._next_s = math.inf
        self.frames = 0

    def step(self, now_s: float) -> None:
        for number, bus in enumerate(self._buses):
            while (message := bus.recv(0)) is not None:
                self.frames += 1
                self._hear(number, message, now_s)
        due = [answer for answer in self._answers if answer[0] <= now_s]
        self._answers = [answer for answer in self._answers if answer[0] > now_s]
        for _, bus_number, identifier, data in sorted(due, key=lambda answer: answer[0]):
            self._buses[bus_number].send(
                can.Message(arbitration_id=identifier, data=data, is_extended_id=False)
            )
        self._next_s = now_s if due else min((at_s for at_s, *_ in self._answers), default=math.inf)

    def next_step_s(self) -> float:
        """When it has something to say, or the host something to hear: now, if it has just said it.

        What comes from the host it hears in the same step.
        """
        return self._next_s

    def reset(self, module: Module, now_s: float) -> None:
        old = self.modules[module]
        fresh = FakeModule(*module, deaf_until_s=now_s + BOOT_S, boots=old.boots + 1)
        fresh.forwarded, fresh.pause_s = old.forwarded, old.pause_s
        old.__dict__.update(fresh.__dict__)

    def robot_says(self, module: Module, cell: int, data: bytes) -> None:
        fake = self.modules[module]
        if fake.state != "RUNNING" or fake.dead:
            return
        if len(fake.ring) == RING:
            fake.lost += 1
        else:
            fake.ring.append(bytes([0x11 | cell << 6]) + data)

    def states(self) -> set[str]:
        return {module.state for module in self.modules.values() if not module.dead}

    def _hear(self, bus: int, message: can.Message, now_s: float) -> None:
        identifier = message.arbitration_id
        if identifier & 1:
            return
        x, y = (identifier >> 1 & 31) - 1, (identifier >> 6) - 1
        for fake in self._of_bus[bus]:
            if x in (-1, fake.x) and y in (-1, fake.y) and not fake.dead:
                fake.least_gap_s = min(fake.least_gap_s, now_s - fake.last_frame_s)
                fake.last_frame_s = now_s
                self._obey(bus, fake, bytes(message.data), now_s)

    def _obey(self, bus: int, fake: FakeModule, data: bytes, now_s: float) -> None:
        kind = data[0]
        if now_s < fake.deaf_until_s:
            if kind == 0x15:
                self._answer(bus, fake, fake.deaf_until_s - now_s, now_s)
            return
        if kind == 0x01:
            self._forward(fake, data)
        elif kind in (0x02, 0x0B):
            fake.state, fake.repeating = "IDLE", None
        elif kind == 0x0C:
            self._enter_setup(fake)
        elif kind == 0x0D:
            if fake.state != "RUNNING":
                fake.runs += 1
                fake.ring.clear()
            fake.state = "RUNNING"
        elif kind == 0x0F:
            fake.size, fake.next_chunk, fake.faulty = data[2], 0, False
            fake.pending = []
            fake.state = "WAITING"
        elif kind == 0x10 and fake.state == "WAITING" and not fake.faulty:
            self._chunk(fake, data)
        elif kind == 0x15:
            fake.asked += 1
            after_s = IDLE_S if fake.state == "IDLE" else 0.001
            if fake.state == "RUNNING" and fake.pause_s:
                after_s += fake.pause_s - (now_s + 0.1 * fake.x) % fake.pause_s
            self._answer(bus, fake, after_s, now_s)
        elif kind == 0x13 and self.ours:
            self._health(bus, fake, data[1], now_s)

    def _forward(self, fake: FakeModule, data: bytes) -> None:
        if data[1] == 0:
            fake.pending = [data[2:8]]
        elif fake.pending:
            fake.repeating = fake.pending[0] + data[2:6]
            fake.forwarded.append(fake.repeating)
            fake.state = "SETUP_KILOBOTS"

    def _chunk(self, fake: FakeModule, data: bytes) -> None:
        if data[1] != fake.next_chunk:
            fake.faulty = True
            return
        fake.next_chunk += 1
        fake.pending.append(data[2:8])
        if fake.next_chunk == -(-fake.size // 6):
            fake.configuration = b"".join(fake.pending)[: fake.size]
            fake.configurations.append(fake.configuration)
            fake.set_up = False
            self._enter_setup(fake)

    def _enter_setup(self, fake: FakeModule) -> None:
        fake.state = "SETUP"
        fake.set_up = True

    def _answer(self, bus: int, fake: FakeModule, after_s: float, now_s: float) -> None:
        identifier = fake.y + 1 << 6 | fake.x + 1 << 1 | 1
        at_s = now_s + after_s
        self._answers.append((at_s, bus, identifier, bytes([0x14, len(fake.ring)])))
        while fake.ring:
            at_s += 0.001
            self._answers.append((at_s, bus, identifier, fake.ring.popleft()))

    def _health(self, bus: int, fake: FakeModule, part: int, now_s: float) -> None:
        states = ["INIT", "IDLE", "SETUP_KILOBOTS", "", "", "WAITING", "SETUP", "RUNNING"]
        crc = 0xFFFF
        for byte in fake.configuration:
            crc ^= byte
            for _ in range(8):
                crc = crc >> 1 ^ 0x8408 if crc & 1 else crc >> 1
        data = bytes([0x13, 0, states.index(fake.state), len(fake.configuration), crc & 255])
        data += bytes([crc >> 8, min(fake.lost, 255), 0])
        if part == 1:
            data = bytes([0x13, 1, 0, 0, 42, 0, 1, 0])
        self._answers.append((now_s + 0.001, bus, fake.y + 1 << 6 | fake.x + 1 << 1 | 1, data))
