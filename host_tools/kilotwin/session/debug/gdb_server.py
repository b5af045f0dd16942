"""A server of gdb's remote serial protocol: one robot of a repeated run, while all
others stand still.

gdb sees an ATmega328P that can go back (ReverseStep, ReverseContinue). Nothing of it can be
written: that would be another run. What gdb has no words for are `monitor` commands.
"""

import select
import socket
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

from kilotwin import _emulator
from kilotwin.errors import KilotwinError
from kilotwin.experiment.colours import LED_VALUES, led_rgb
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.states import States
from kilotwin.session.debug.packets import INTERRUPT, Reader, framed, numbers
from kilotwin.session.debug.travel import Chip, Stop, Travel, Wanted

_DATA, _EEPROM, _FLASH_BYTES = 0x800000, 0x810000, 0x8000
_SPL, _SPH = 0x5D, 0x5E
_REFUSED, _OK, _NOT_KNOWN = "E01", "OK", ""
_FEATURES = "PacketSize=4000;ReverseStep+;ReverseContinue+;swbreak+;hwbreak+;QStartNoAckMode+"
_SIGNALS = {"crash": "0b", "interrupt": "02"}
_BLOCK = 1 << 16
_HELP = """\
monitor where              the moment, the robot, and why it stands
monitor robot UID          hold another robot, at this moment
monitor at SECONDS         go to another moment of the run
monitor any on|off         breakpoints and watches of any robot that can be held, or of this one
monitor message on|off     stop when a message reaches the program's callback
monitor state NAME|off     stop when the LED becomes that state of [states], or RGB(r,g,b)
"""


class GdbServer:
    """Serves one connection. `symbols`: .elf by robot, of those that can be held."""

    def __init__(
        self,
        travel: Travel,
        experiment: Experiment,
        symbols: Mapping[int, Path],
        recorded_hash: str = "",
    ) -> None:
        self._travel = travel
        travel.interrupted = self._is_interrupted
        self._experiment = experiment
        self._symbols = symbols
        self._recorded_hash = recorded_hash
        self._wanted = Wanted()
        self._watched: list[tuple[int, int]] = []
        self._reader = Reader()
        self._queue: list[str] = []
        self._flash: dict[Path, bytes] = {}
        self._chip: Chip | None = None
        self._client: socket.socket | None = None
        self._orders: dict[str, Callable[[str], str]] = {
            "where": lambda _: self._where(),
            "robot": self._hold_robot,
            "at": self._go_to_moment,
            "any": self._any,
            "message": self._on_message,
            "state": self._on_state,
            "help": lambda _: _HELP,
        }

    def serve(self, client: socket.socket) -> None:
        """Until gdb detaches, kills, or is gone."""
        self._client = client
        while True:
            while not self._queue:
                if not self._take(client.recv(_BLOCK)):
                    return
            packet = self._queue.pop(0)
            if packet == INTERRUPT:
                continue
            if packet in ("k", "D") or packet.startswith(("vKill", "D;")):
                if packet != "k":
                    self._send(_OK)
                return
            self._send(self._answer(packet))

    def _take(self, data: bytes) -> bool:
        """Reads what has come; False at the connection's end."""
        assert self._client is not None
        packets, answers = self._reader.feed(data)
        if answers:
            self._client.sendall(answers)
        self._queue += packets
        return bool(data)

    def _send(self, text: str) -> None:
        assert self._client is not None
        self._client.sendall(framed(text))

    def _is_interrupted(self) -> bool:
        """Whether gdb's user has typed Ctrl-C, or is gone, while the world runs."""
        assert self._client is not None
        is_there = select.select([self._client], [], [], 0)[0]
        if is_there and not self._take(self._client.recv(_BLOCK)):
            return True
        return INTERRUPT in self._queue

    def _answer(self, packet: str) -> str:
        try:
            return self._obeyed(packet)
        except (ValueError, IndexError):
            return _REFUSED
        except KilotwinError as error:
            self._print(f"{error}\n")
            return _REFUSED

    def _print(self, text: str) -> None:
        """Shows a text on gdb's console, in the midst of a command."""
        self._send("O" + text.encode().hex())

    def _obeyed(self, packet: str) -> str:
        match packet[0]:
            case "?":
                return self._report(self._now)
            case "g":
                return self._registers().hex()
            case "p":
                return self._register(int(packet[1:], 16)).hex()
            case "m":
                return self._memory(*numbers(packet[1:], 2)).hex()
            case "G" | "P" | "M" | "X":
                return _REFUSED  # the run would be another one
            case "Z" | "z":
                return self._stop_point(packet)
            case "c" | "C":
                return self._report(self._go(self._travel.go_on))
            case "s" | "S":
                return self._report(self._step(self._travel.go_on))
            case "b":
                return self._back(packet)
            case "H" | "T" | "!":
                return _OK
            case "v" | "q" | "Q":
                return self._of_words(packet)
            case _:
                return _NOT_KNOWN

    def _of_words(self, packet: str) -> str:
        if packet.startswith("qSupported"):
            return _FEATURES
        if packet == "QStartNoAckMode":
            self._reader.acknowledges = False
            return _OK
        if packet == "vCont?":
            return "vCont;c;C;s;S"
        if packet.startswith(("vCont;c", "vCont;C")):
            return self._obeyed("c")
        if packet.startswith(("vCont;s", "vCont;S")):
            return self._obeyed("s")
        if packet.startswith("qRcmd,"):
            return self._monitor(bytes.fromhex(packet.removeprefix("qRcmd,")).decode())
        fixed = {"qAttached": "1", "qC": "QC1", "qfThreadInfo": "m1", "qsThreadInfo": "l"}
        return fixed.get(packet, _NOT_KNOWN)

    # Going.

    @property
    def _now(self) -> Stop:
        assert self._travel.now is not None
        return self._travel.now

    def _back(self, packet: str) -> str:
        if packet == "bc":
            return self._report(self._go(self._travel.go_back))
        if packet == "bs":
            return self._report(self._step(self._travel.go_back))
        return _NOT_KNOWN

    def _go(self, way: Callable[[Wanted], Stop]) -> Stop:
        self._chip = None
        stop = way(self._wanted)
        if INTERRUPT in self._queue:
            self._queue.remove(INTERRUPT)
            stop = replace(stop, why="interrupt")
        return stop

    def _step(self, way: "Callable[..., Stop]") -> Stop:
        """Steps this robot alone: any other's instructions are no step of it."""
        self._chip = None
        return way(self._wanted, step=True)

    def _report(self, stop: Stop) -> str:
        """Says why it stands."""
        signal = _SIGNALS.get(stop.why, "05")
        if stop.why == "watch":
            address = self._wanted.watches[stop.watch][0] | _DATA
            return f"T{signal}watch:{address:x};"
        if stop.why == "begin":
            return f"T{signal}replaylog:begin;"
        if stop.why == "end":
            self._say_how_it_ended()
            return f"T{signal}replaylog:end;"
        if stop.why in ("message", "colour"):
            self._print(f"{self._where()}")
        elif len(self._travel.robots) > 1 and stop.why == "breakpoint":
            self._print(f"robot {self._experiment.uid_of(stop.place.robot)}\n")
        return f"T{signal}swbreak:;" if stop.why == "breakpoint" else f"T{signal}"

    def _say_how_it_ended(self) -> None:
        result = self._travel.result_hash()
        others = ", which is NOT that of the recorded run"
        same = {"": "", result: ", as recorded"}.get(self._recorded_hash, others)
        self._print(f"the run is over: result hash {result}{same}\n")

    def _stop_point(self, packet: str) -> str:
        kind = packet[1]
        address, length = numbers(packet[3:].split(";", maxsplit=1)[0], 2)
        is_set = packet[0] == "Z"
        if kind in "01":
            places = self._wanted.breakpoints
            changed = places | {address} if is_set else places - {address}
            self._wanted = replace(self._wanted, breakpoints=changed)
            return _OK
        if kind != "2":
            return _NOT_KNOWN
        one = (address & ~_DATA, length)
        if address & ~0xFFFF != _DATA or not 0 < length <= 64 or one[0] + length > 0x900:
            return _REFUSED
        if is_set:
            self._watched.append(one)
        elif one in self._watched:
            self._watched.remove(one)
        self._wanted = replace(self._wanted, watches=tuple(self._watched))
        return _OK

    # Looking.

    def _looked(self) -> Chip:
        if self._chip is None:
            self._chip = self._travel.chip(self._now.place.robot)
        return self._chip

    def _registers(self) -> bytes:
        """r0 to r31, status register, stack pointer and program counter, as gdb has them."""
        chip = self._looked()
        stack = chip.data[_SPL : _SPH + 1]
        return chip.data[:32] + bytes([chip.status]) + stack + chip.pc.to_bytes(4, "little")

    def _register(self, number: int) -> bytes:
        every = self._registers()
        parts = [*(every[at : at + 1] for at in range(33)), every[33:35], every[35:39]]
        return parts[number]

    def _memory(self, address: int, length: int) -> bytes:
        if address < _FLASH_BYTES:
            return self._flash_of(self._now.place.robot)[address : address + length]
        if not _DATA <= address < _EEPROM:
            raise ValueError("no memory")
        at = address & ~_DATA
        found = self._looked().data[at : at + length]
        if not found and length:
            raise ValueError("no memory")
        return found

    def _flash_of(self, robot: int) -> bytes:
        elf = self._symbols[robot]
        if elf not in self._flash:
            self._flash[elf] = _emulator.flash_image(str(elf))[0]
        return self._flash[elf]

    # Orders that gdb has no words for.

    def _monitor(self, text: str) -> str:
        word, _, rest = text.strip().partition(" ")
        order = self._orders.get(word)
        said = _HELP if order is None else order(rest.strip())
        return said.encode().hex() or _OK

    def _where(self) -> str:
        now = self._now
        chip = self._looked()
        robot = f"robot {self._experiment.uid_of(now.place.robot)}"
        whose = "any robot" if len(self._travel.robots) > 1 else robot
        return (
            f"{robot} at {chip.at_s:.6f} s (tick {self._tick(chip)}), "
            f"stopped by: {now.why}; held: {whose}\n"
        )

    def _tick(self, chip: Chip) -> int:
        return int(chip.at_s / _emulator.TICK_S)

    def _hold_robot(self, text: str) -> str:
        robot = self._experiment.robot_of(int(text))
        if robot is None or robot not in self._symbols:
            can = sorted(map(self._experiment.uid_of, self._symbols))
            return f"robot {text} cannot be held: these can: {can[0]} to {can[-1]}\n"
        at_s = self._looked().at_s
        self._travel.robots = [robot]
        return self._gone_to(robot, at_s)

    def _go_to_moment(self, text: str) -> str:
        at_s = float(text)
        if not 0 <= at_s < self._experiment.keys.duration_s:
            return f"the run has 0 to {self._experiment.keys.duration_s:g} s\n"
        return self._gone_to(self._now.place.robot, at_s)

    def _gone_to(self, robot: int, at_s: float) -> str:
        self._chip = None
        self._travel.go_to_moment(robot, at_s)
        return f"{self._where()}type: maintenance flush register-cache\n"

    def _any(self, text: str) -> str:
        robot, at_s = self._now.place.robot, self._looked().at_s
        self._travel.robots = [robot] if text == "off" else sorted(self._symbols)
        self._chip = None
        self._travel.go_to_moment(robot, at_s)
        return self._where()

    def _on_message(self, text: str) -> str:
        self._wanted = replace(self._wanted, message=text != "off")
        return f"stops at messages: {'no' if text == 'off' else 'yes'}\n"

    def _on_state(self, text: str) -> str:
        if text == "off":
            self._wanted = replace(self._wanted, colour=None)
            return "stops at no state\n"
        states = States.of(self._experiment.keys)
        for led in range(LED_VALUES):
            if text in (states.names[states.of_led[led]], "RGB({},{},{})".format(*led_rgb(led))):
                self._wanted = replace(self._wanted, colour=led)
                return f"stops when the LED becomes {text}\n"
        known = ", ".join(states.names[: states.known]) or "none is named"
        return f"there is no state '{text}'; [states]: {known}; or RGB(r,g,b) of 0 to 3\n"
