"""A chain as a story, line by line, and as JSON."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kilotwin.experiment.colours import LED_COLOURS, led_rgb
from kilotwin.experiment.experiment import Experiment
from kilotwin.runs.columns import StationKind
from kilotwin.runs.reader import Run
from kilotwin.studies.why.chain import Cause, CellTold, Changed, Link, Received
from kilotwin.studies.why.facts import During, Station
from kilotwin.units import TICK_S

LED, MOTORS, MESSAGE = "led", "motors", "message"
_TYPE = 9  # byte of a message behind its data
_CELL_PLACES = ("top left", "top right", "bottom left", "bottom right")
_MODULE_CELLS = 4
_DURING = {During.TICK: "when it was asked for a message", During.MESSAGE: "in a receive callback"}
_WITHIN_S = 0.1  # a command and its frame
_ALL = 65535


@dataclass(frozen=True)
class Story:
    """Tells chains of a run."""

    run: Run
    experiment: Experiment

    def lines(self, links: list[Link]) -> list[str]:
        """A paragraph for each robot, down to the first cause."""
        return [line for link in links for line in self._told(link, links)]

    def as_dicts(self, links: list[Link]) -> list[dict[str, Any]]:
        """The same for programs: an object per link, in the same order."""
        return [self._as_dict(link, links) for link in links]

    def lines_between(self, links: list[Link]) -> list[dict[str, Any]]:
        """Messages of a chain that robots exchanged, for pictures: begin_s, at_s, and the indices
        of the sender and the receiver."""
        return [
            {
                "begin_s": link.message.begin_s,
                "at_s": link.message.at_s,
                "from": link.message.sender.number,
                "to": link.message.receiver.number,
            }
            for link in links
            if isinstance(link, Received)
            and link.message.sender.kind == link.message.receiver.kind == StationKind.ROBOT
        ]

    def _told(self, link: Link, links: Sequence[Link]) -> list[str]:
        if isinstance(link, Changed):
            return self._changed(link)
        if isinstance(link, Received):
            return self._received(link)
        if isinstance(link, CellTold):
            cell = self._name(Station(StationKind.CELL, link.cell))
            return [
                f"{cell} sends {_message(link.now)} since "
                f"{link.since_s:.3f} s, before it was {_message(link.was)}"
            ]
        return [f"first cause: {self._cause(link, _last_receiver(links))}"]

    def _changed(self, link: Changed) -> list[str]:
        robot = self._name(Station(StationKind.ROBOT, link.robot))
        what = _thing(link)
        during = _DURING.get(link.during, f"in the main loop at its tick {link.tick}")
        told = [
            f"{robot}: {what} {_value(link, link.was)} -> {_value(link, link.now)} at "
            f"{link.at_s:.3f} s",
            f"  by {link.place}, {during}",
        ]
        if link.reads:
            told.append(
                f"  {link.reads} was set {link.set_was} -> {link.set_now} at {link.set_s:.3f} s by "
                f"{link.set_place}, with a message"
            )
        return told

    def _received(self, link: Received) -> list[str]:
        message, others = link.message, ""
        if link.others:
            count = "another one" if link.others == 1 else f"{link.others} others"
            others = f"; {count} came since the state before"
        return [
            f"  <- {_message(message.data)} of {self._name(message.sender)}"
            f"{self._where(message.sender, message.begin_s)}, {message.begin_s:.3f} to "
            f"{message.at_s:.3f} s (tick {self._tick(message.at_s)}){others}"
        ]

    def _cause(self, link: Cause, receiver: int) -> str:
        who, at = self._name(link.station), f"{link.at_s:.3f} s"
        number = link.station.number
        return {
            "draw": f"{who} drew a random number at {at}, {link.place}",
            "reading": f"{who} took a reading at {at}: {link.value}, {link.place}",
            "start": f"{who} is so since its start",
            "alone": f"{who} did it by itself at {at}: no message since had changed what it is "
            "made from, and no number was drawn in that pass; its clock remains",
            "command": f"{self._command(link.at_s)} at {at}",
            "overhead": f"{who} at {at}{self._word(link.at_s, receiver)}",
            "beacon": f"the beacon of an [[object]], {number + 1}. of them, at {at}",
            "floor": f"what the robot stood on at {at}, as its ground sensor tells it",
            "cell": f"{who} sends it since the first time that a robot received it ({at}): its "
            "module's program, by what the host has set up and ordered (can.log)",
            "native": f"not known beyond {who}, which ran natively or on a chip",
            "depth": f"not asked beyond {who}, at {at}; a larger --depth goes on",
            "forgotten": f"not known: what was before {at} is not kept; ask with an earlier --at",
        }[link.kind]

    def _command(self, at_s: float) -> str:
        """The [[command]] whose message came then."""
        found = [
            (number, command)
            for number, command in enumerate(self.experiment.keys.command or ())
            if command.at_s - _WITHIN_S <= at_s <= command.at_s + command.repeat_s + _WITHIN_S
        ]
        if not found:
            return "an order to all robots (RUN, CONFIG, or one from the page)"
        number, command = found[-1]
        where = self.experiment.origin.where(("command", number))
        return f"[[command]] {number + 1} (send = {command.send!r}, {where})"

    def _word(self, at_s: float, receiver: int) -> str:
        """The word for a robot that an environment had it send."""
        if self.run.experiment.environment is None:
            return ""
        sent = self.run.sent()
        times = np.asarray(sent["time_s"], float)
        uids = np.asarray(sent["uid"])
        its = (uids == self.run.uid_of(receiver)) | (uids == _ALL)
        before = np.flatnonzero((times <= at_s + _WITHIN_S) & its)
        if not len(before):
            return ""
        row = sent.slice(int(before[np.argmax(times[before])]), 1).to_pylist()[0]
        who = "all robots" if row["uid"] == _ALL else f"robot {row['uid']}"
        return f": the environment's word for {who}, type {row['type']}, value {row['value']}"

    def _name(self, station: Station) -> str:
        number = station.number
        if station.kind == StationKind.ROBOT:
            return f"robot {self.run.uid_of(number)}"
        if station.kind == StationKind.CELL and self.experiment.keys.grid is not None:
            module, cell = divmod(number, _MODULE_CELLS)
            y, x = divmod(module, self.experiment.keys.grid.columns)
            return f"cell {cell} ({_CELL_PLACES[cell]}) of module ({x}, {y})"
        names = {
            StationKind.OVERHEAD: f"overhead controller {number + 1}",
            StationKind.COMMAND: "a [[command]]",
            StationKind.BEACON: f"beacon {number + 1}",
        }
        return names.get(station.kind, "the floor")

    def _where(self, station: Station, at_s: float) -> str:
        """` at (0.12, -0.30) m`, by the last sample before; "" if it is not known."""
        place = self._place(station, at_s)
        return f" at ({place[0]:.3f}, {place[1]:.3f}) m" if place else ""

    def _place(self, station: Station, at_s: float) -> tuple[float, float] | None:
        if station.kind != StationKind.ROBOT:
            return None
        rows = self.run.robots()
        if "x_m" not in rows.column_names:
            return None
        own = np.asarray(rows["robot"]) == station.number
        times = np.where(own, np.asarray(rows["time_s"], float), math.inf)
        before = np.flatnonzero(times <= at_s)
        if not len(before):
            return None
        row = int(before[np.argmax(times[before])])
        return float(rows["x_m"][row].as_py()), float(rows["y_m"][row].as_py())

    def _tick(self, at_s: float) -> int:
        return math.floor(at_s / TICK_S)

    def _as_dict(self, link: Link, links: Sequence[Link]) -> dict[str, Any]:
        if isinstance(link, Changed):
            return {
                "link": "change",
                "robot": self.run.uid_of(link.robot),
                "what": link.name,
                "was": _value(link, link.was),
                "now": _value(link, link.now),
                "at_s": link.at_s,
                "robot_tick": link.tick,
                "during": link.during.name.lower(),
                "place": link.place,
                "reads": link.reads or None,
                "set_by": link.set_place or None,
                "set_s": link.set_s if link.reads else None,
            }
        if isinstance(link, Received):
            message = link.message
            place = self._place(message.sender, message.begin_s)
            return {
                "link": "message",
                "sender": self._name(message.sender),
                "receiver": self._name(message.receiver),
                "begin_s": message.begin_s,
                "at_s": message.at_s,
                "tick": self._tick(message.at_s),
                "sender_m": list(place) if place else None,
                "type": message.data[_TYPE],
                "data": message.data[:_TYPE].hex(),
                "others": link.others,
            }
        if isinstance(link, CellTold):
            return {
                "link": "cell",
                "cell": self._name(Station(StationKind.CELL, link.cell)),
                "since_s": link.since_s,
                "was": link.was.hex(),
                "now": link.now.hex(),
            }
        return {
            "link": "cause",
            "kind": link.kind,
            "of": self._name(link.station),
            "at_s": link.at_s,
            "place": link.place or None,
            "text": self._cause(link, _last_receiver(links)),
        }


def _last_receiver(links: Sequence[Link]) -> int:
    """The robot that received the message at a chain's end, by index."""
    received = [link.message.receiver for link in links if isinstance(link, Received)]
    return received[-1].number if received else 0


def _thing(link: Changed) -> str:
    if link.name != MESSAGE:
        return {LED: "LED", MOTORS: "motors"}.get(link.name, link.name)
    last = link.first + len(link.now) - 1
    if link.first == last == _TYPE:
        return "the type of its message"
    return (
        f"byte {link.first} of its message"
        if link.first == last
        else (f"bytes {link.first} to {last} of its message")
    )


def _value(link: Changed, raw: bytes) -> str:
    if link.name == LED:
        rgb = led_rgb(raw[0])
        names = (name for name, parts in LED_COLOURS.items() if parts == rgb)
        return next(names, f"RGB{rgb}".replace(" ", ""))
    if link.name == MOTORS:
        return f"({raw[0]}, {raw[1]})"
    if link.name == MESSAGE:
        return raw.hex(" ")
    return str(int.from_bytes(raw, "little"))


def _message(data: bytes) -> str:
    """Type and data, without the zeros behind."""
    shown = data[:_TYPE].rstrip(b"\0").hex(" ") or "all zero"
    return f"message of type {data[_TYPE]}, data {shown},"
