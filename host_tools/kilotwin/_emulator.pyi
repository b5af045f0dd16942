"""The compiled engine (emulator/python), as the host tools see it."""

from collections.abc import Callable, Sequence
from typing import Any, NotRequired, TypedDict

import numpy as np
from numpy.typing import NDArray

CONFIG_KEYS: dict[str, tuple[int, int, int, int]]  # name: key, default, least, most
WIRE: dict[str, int]
GUEST_ABI: int
BOX2D_VERSION: str
VERSION: str
BUILD: str
TICK_S: float
CAN_RECORD: list[tuple[Any, ...]]  # fields of numpy.dtype() for a frame that ended on a bus

def uniform(seed: int, purpose: str, robot: int, n: int) -> float: ...  # see base/chance.h
def normal(seed: int, purpose: str, robot: int, n: int) -> float: ...
def flash_image(path: str) -> tuple[bytes, dict[int, int]]: ...  # flash; EEPROM by address
def end_with_parent(parent: int, grace_s: float = 0.0) -> None: ...  # see base/parent_death.h
def confine(  # see base/confinement.h
    *,
    readable: Sequence[str],
    writable: Sequence[str],
    memory_bytes: int,
    file_bytes: int,
    memory_group: str,
    sockets: bool,
    loads_later: bool,
    forks: bool,
) -> list[str]: ...
def end_loading() -> None: ...
def take_over(path: str, faster: str) -> None: ...  # see robots/translated/program.h
def hold_by(path: str, name: str, debugged: str, watched: str) -> None: ...  # see program.h
def lacking_layers() -> list[str]: ...
def reference_loop_s() -> float: ...

class EngineError(ValueError): ...

class RobotChip:
    """See emulator/python/chip.cpp."""

    def __init__(self, path: str, *, seed: int, skips: bool, boots: bool = ...) -> None: ...
    def run(self, until: int) -> None: ...
    def show(self, message: bytes, at: int) -> None: ...
    def digest(self, begin: int, end: int) -> int: ...
    cycle: int
    flash_operations: int
    failure: str
    outputs: tuple[int, int, int, int]  # LED, motors, edges of infrared, bytes

class Samples(TypedDict):
    """k samples of N robots."""

    tick: NDArray[np.int64]  # [k]
    x_m: NDArray[np.float32]  # [k, N], as all below
    y_m: NDArray[np.float32]
    heading_rad: NDArray[np.float32]
    led: NDArray[np.uint8]
    site: NDArray[np.uint8]
    # [k, objects]; empty, or left out by other makers, where there are none.
    object_x_m: NotRequired[NDArray[np.float32]]
    object_y_m: NotRequired[NDArray[np.float32]]
    object_heading_rad: NotRequired[NDArray[np.float32]]
    # [k, N]: what sample_extras asked for, or close_look() did.
    left_duty: NotRequired[NDArray[np.uint8]]
    right_duty: NotRequired[NDArray[np.uint8]]
    battery: NotRequired[NDArray[np.uint16]]
    sent: NotRequired[NDArray[np.uint32]]
    received: NotRequired[NDArray[np.uint32]]
    delivered: NotRequired[NDArray[np.uint32]]  # 2**32 - 1 for chips

class Event(TypedDict):
    """Something that happened to a robot."""

    tick: int  # nominal, of the world
    robot_tick: int  # the robot's own kilo_ticks
    robot: int  # its index
    uid: NotRequired[int]  # the engine does not say it
    program: str
    kind: str  # crash, busy_wait, endless, note, stack_overflow, print
    text: str
    code: NotRequired[list[int]]  # addresses in its program's file, innermost first

class Trail(TypedDict):
    """Actions of robots' code; python/trail.cpp names the fields of the arrays."""

    writes: NDArray[np.void]
    sendings: NDArray[np.void]
    paths: list[list[int]]  # byte addresses, the innermost first
    forgotten: int

class ModuleRecord(TypedDict):
    """A module at present."""

    x: int
    y: int
    bus: int
    state: str  # of hardware.md 3.3, or dead
    stopped: bool  # its program failed
    tick: int  # its own module_ticks
    can: str  # active, passive, bus_off, dead
    tec: int
    rec: int
    frames_refused: int  # wrong length, out of range or order: they changed nothing
    frames_missed: int  # came while its controller's buffers were full

class CanStatistics(TypedDict):
    """A bus, from the beginning."""

    load: float
    frames: int
    error_frames: int
    not_acknowledged: int
    went_bus_off: int
    lost_queue_full: int
    lost_bus_off: int
    lost_dead: int

class ModuleEvent(TypedDict):
    """Something that happened to a module's program."""

    tick: int
    module_tick: int
    module: tuple[int, int]
    program: str
    kind: str
    text: str
    code: NotRequired[list[int]]

Heard = tuple[int, bytes, int]
"""A message that a program got: the tick since RUN, nine data bytes and the type, mm."""

class Simulation:
    tick: int
    robots: int
    def __init__(self, spec: dict[str, Any], *, powered: bool = True) -> None: ...
    def power_up(self) -> None: ...  # once, of one that was made with powered=False
    def advance(self, ticks: int) -> None: ...
    def samples(self) -> Samples: ...
    def hold(self, robots: Sequence[int], on_stop: Callable[[dict[str, Any]], None]) -> None: ...
    def want(self, wanted: dict[str, Any]) -> None: ...  # see robots/translated/debugging.h
    def found(self) -> dict[str, Any] | None: ...
    def note_written(self, robot: int) -> None: ...
    def take_written(self) -> list[int]: ...  # see robots/translated/written_bytes.h
    def chip(self, robot: int) -> dict[str, Any]: ...
    def own_cycle(self, robot: int, at_s: float) -> int: ...
    def tick_of(self, robot: int, cycle: int) -> int: ...
    def snapshot(self) -> Samples: ...
    def close_look(self) -> Samples: ...  # a snapshot with all extras
    def events(self) -> list[Event]: ...
    def result_hash(self) -> str: ...
    def final_hash(self) -> str: ...
    def send(
        self,
        message: bytes,
        uid_first: int = 0,
        uid_last: int = 65535,
        region: tuple[float, float, float] | None = None,
    ) -> None: ...
    def place(self, robot: int, x_m: float, y_m: float, heading_rad: float) -> None: ...
    def turn(self, robot: int, heading_rad: float) -> None: ...
    def shine(self, frame: bytes, after_s: float, controller: int = 0) -> None: ...  # with the CRC
    def set_ambient(self, reading: float) -> None: ...
    def set_peak(self, lamp: int, reading: float) -> None: ...
    def send_can(self, bus: int, id: int, data: bytes, after_s: float = 0.0) -> bool: ...
    # A structured array: at_s (end of the frame, since t = 0), bus, id, dlc, data[8], from_host.
    def can_frames(self) -> NDArray[Any]: ...
    def cells(self) -> NDArray[np.uint8]: ...  # [2 * rows, 2 * columns, 2], lower left first
    def modules(self) -> list[ModuleRecord]: ...
    def can_stats(self) -> list[CanStatistics]: ...
    def cell_stats(self) -> dict[str, int]: ...
    def module_events(self) -> list[ModuleEvent]: ...
    def motors(self) -> NDArray[np.uint8]: ...  # [N, 2]
    def frames(self) -> NDArray[np.uint32]: ...  # [N, 2]: sent, received
    def decisions(self) -> NDArray[np.uint32]: ...  # [N]: times that LED or motors changed
    def listen_to(self, robots: Sequence[int]) -> None: ...  # native ones
    def heard_by(self, robot: int) -> list[Heard]: ...
    def keep_trail(
        self,
        capacity: int,
        draws: Sequence[Sequence[tuple[int, int]]],
        robot: int,
        begin: int,
        end: int,
    ) -> None: ...
    def arrivals(self) -> NDArray[np.void]: ...  # python/trail.cpp names the fields
    def trail(self) -> Trail: ...
    def hummed_s(self) -> NDArray[np.float64]: ...  # [N]: motors on, and neither turning
    def state(self, robot: int) -> bytes: ...
    def program(self, robot: int) -> str: ...
    def trace(self, robot: int, path: str) -> None: ...
    def stats(self) -> dict[str, int | float]: ...

class BridgeError(OSError): ...

class Bridge:
    """The buses for programs outside; kilotwin.table.can.bridge opens it with its defaults."""

    port: int
    clients: int
    def __init__(
        self,
        *,
        buses: int,
        port: int,
        more_ports: int,
        interfaces: list[str],
        client_bytes: int,
        client_frames: int,
        clients: int,
        settle_s: float,
    ) -> None: ...
    def publish(self, frames: NDArray[Any]) -> None: ...  # of CAN_RECORD
    def take(self) -> list[tuple[int, int, bytes, float]]: ...  # bus, id, data, its age in s
    def counts(self) -> dict[str, int]: ...
    def notes(self) -> list[str]: ...
    def close(self) -> None: ...

def config_message(uid_first: int, uid_last: int, key: int, value: int) -> bytes: ...
def estimate_distances(
    low_gain: Sequence[int], high_gain: Sequence[int], readings: Sequence[tuple[int, int]]
) -> list[int]: ...

class Programmer:
    """An STK500v2 in front of an erased ATmega328P."""

    flash: bytes
    eeprom: bytes
    fuses: bytes  # low, high, extended
    lock_bits: int
    signature: bytes
    @property
    def programming(self) -> bool: ...
    def receive(self, bytes: bytes) -> bytes: ...
    def hang_up(self) -> None: ...

class Difference(TypedDict):
    tick: int
    kind: str
    text: str

class Watched(TypedDict):
    stack_bytes: int
    deepest_at: int
    room_bytes: int
    ticks_lost: int
    calls: dict[int, tuple[int, int, int]]  # by entry: how many, cycles of the longest, its tick
    callers: dict[int, dict[int, int]]  # by entry: addresses of calls, and the first tick
    sums: dict[int, int]  # by address, of those that carried: the first tick

class DifferentialTest:
    def __init__(
        self,
        *,
        guest: str,
        tier: str,
        elf: str,
        name: str,
        seed: int,
        uid: int,
        before_run: Sequence[bytes],
        slack_s: float,
        waits: bool,
        follow: Sequence[int] | None,
        sums: Sequence[tuple[int, bool]] = (),
        heard: Sequence[Heard] = (),
        ask_every: int = 0,
    ) -> None: ...
    def run(self, ticks: int) -> None: ...
    @property
    def tick(self) -> int: ...
    @property
    def compared(self) -> int: ...
    @property
    def received(self) -> int: ...
    @property
    def chip_sent(self) -> int: ...
    @property
    def chip_sent_badly(self) -> int: ...
    @property
    def hummed_s(self) -> float: ...
    @property
    def worst_lag_s(self) -> float: ...
    @property
    def ticks_apart(self) -> int: ...
    @property
    def difference(self) -> Difference | None: ...
    @property
    def avr_failure(self) -> str: ...
    @property
    def native_failure(self) -> str: ...
    @property
    def native_prints(self) -> list[tuple[int, str]]: ...
    @property
    def watched(self) -> Watched | None: ...
