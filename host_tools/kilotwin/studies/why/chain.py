"""The chain from what a robot did back to its first cause, by the facts of a repeated run.

A change that a receive callback made has that message for its cause. For one elsewhere it is, the
first of these that there is: the last message whose callback changed a variable that the function
at work names, since the thing was last as it is no more; a number that was drawn, or a reading
that was taken, in the same pass of loop(); the last message whose callback changed any variable
since then; such a message of a variable that the function names, however long ago. Without all of
these the robot did it by itself. A message is what it is by the last change of a byte in it that
this receiver had not had from that sender before.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from kilotwin.runs.columns import StationKind
from kilotwin.studies.why.facts import (
    NEVER_S,
    Change,
    During,
    Facts,
    Input,
    Message,
    Path,
    Station,
    What,
    joined,
)

_PASS_S = 0.005  # a pass of loop() is hardly longer, but where it waits
_LED_S, _KICK_S = 0.0005, 0.02  # colours are written bit by bit; motors start with a kick
_MODULE_CELLS = 4
_TYPE, _ORDERS = 9, 0x80  # of a message; types from here on are the runtime's, as RUN
_SOON_S = 2.0  # a module passes on what it received at its next turns
_MOST_DEEP = 1000


class Code(Protocol):
    """Facts of the programs of robots."""

    def is_watched(self, robot: int) -> bool:
        """Whether its code tells what it stores."""

    def place(self, robot: int, path: Path) -> str:
        """`walk.c:42 in loop()`."""

    def variable(self, robot: int, address: int) -> str:
        """The name of the variable of its program's own that a byte is of; "": of none."""

    def reads(self, robot: int, path: Path) -> frozenset[str]:
        """Such variables that the function at work names."""

    def draws_at(self, robot: int, path: Path) -> bool:
        """Whether a reading of the converter was taken for rand_hard()."""


@dataclass(frozen=True)
class Question:
    """A question about the last change up to a moment of `what` of a robot, or of a variable
    from `address` on, of so many bytes."""

    robot: int
    at_s: float
    what: What
    name: str
    address: int = 0
    length: int = 0


@dataclass(frozen=True)
class Changed:
    """A robot's code changed something: `name`, a variable, led, motors or "message"; `was` and
    `now` hold its bytes, the lowest first, and `first` of a message the number of the first.

    `since_s`: when it was last changed before. `reads`: the variable by which the message came in
    that is the next link, with `set_place` and `set_s`, where and when its callback changed it; ""
    if that is this change itself, or there is no such message.
    """

    robot: int
    name: str
    at_s: float
    since_s: float
    tick: int
    during: During
    place: str
    was: bytes
    now: bytes
    first: int = 0
    reads: str = ""
    set_place: str = ""
    set_s: float = NEVER_S
    set_was: int = 0
    set_now: int = 0


@dataclass(frozen=True)
class Received:
    """A message that made a change, and how many others came since the state before."""

    message: Message
    others: int


@dataclass(frozen=True)
class CellTold:
    """A cell sends what it did not send before `since_s`, after its module has received a robot."""

    cell: int
    since_s: float
    was: bytes
    now: bytes


@dataclass(frozen=True)
class Cause:
    """The end of a chain. `kind`: draw, reading, start, alone, command, overhead, beacon, floor,
    cell, native, depth, forgotten. `place`, `value` and `at_s` of a draw or reading."""

    kind: str
    station: Station
    at_s: float
    place: str = ""
    value: int = 0


Link = Changed | Received | CellTold | Cause


def explain(facts: Facts, code: Code, question: Question, depth: int) -> list[Link]:
    """The chain, from the change asked about to its first cause; over `depth` messages at most."""
    chain = _Chain(facts, code, depth)
    chain.follow_question(question)
    return chain.links


class _Chain:
    def __init__(self, facts: Facts, code: Code, depth: int) -> None:
        self._facts = facts
        self._code = code
        self._left = min(depth, _MOST_DEEP)
        self.links: list[Link] = []

    def follow_question(self, question: Question) -> None:
        changes = self._facts.changes(question.robot, question.what, question.at_s)
        if question.what == What.ASKED:
            self._follow_variable(question, changes)
            return
        groups = joined(changes, _LED_S if question.what == What.LED else _KICK_S)
        if not groups:
            self._never_changed(question)
            return
        first, last = groups[-1][0], groups[-1][-1]
        length = 1 if question.what == What.LED else 2
        was, now = (value.to_bytes(length, "big") for value in (first.was, last.now))
        # Where it began says why; what came behind is the same decision.
        whole = replace(last, path=first.path, before_s=first.before_s, at_s=first.at_s)
        self._follow_change(whole, question.name, was, now)

    def _follow_variable(self, question: Question, changes: Sequence[Change]) -> None:
        if not changes:
            self._never_changed(question)
            return
        last = changes[-1]
        now, was = bytearray(question.length), bytearray(question.length)
        for change in changes:
            place = change.address - question.address
            now[place] = change.now
            was[place] = change.now
        # Bytes of a number are stored one after the other.
        together = [it for it in changes if last.at_s - it.at_s < _LED_S and it.path == last.path]
        for change in reversed(together):
            was[change.address - question.address] = change.was
        self._follow_change(last, question.name, bytes(was), bytes(now))

    def _never_changed(self, question: Question) -> None:
        kind = "start" if self._facts.is_whole else "forgotten"
        self._end(kind, Station(StationKind.ROBOT, question.robot), question.at_s)

    def _follow_change(
        self, change: Change, name: str, was: bytes, now: bytes, first: int = 0
    ) -> None:
        """Adds a change, then what made it."""
        link = Changed(
            change.robot,
            name,
            change.at_s,
            change.before_s,
            change.tick,
            change.during,
            self._code.place(change.robot, change.path),
            was,
            now,
            first,
        )
        if change.during == During.MESSAGE:
            self.links.append(link)
            self._follow_heard(change, change.before_s)
            return
        cause, step = self._cause(change)
        if step is None:
            self.links.append(link)
            self.links.append(cause)
            return
        by = replace(
            link,
            reads=self._code.variable(change.robot, step.address),
            set_place=self._code.place(change.robot, step.path),
            set_s=step.at_s,
            set_was=step.was,
            set_now=step.now,
        )
        self.links.append(by)
        self._follow_heard(step, change.before_s)

    def _cause(self, change: Change) -> tuple[Cause, Change | None]:
        """The cause of a change outside of callbacks: a callback's change, or a first cause."""
        code, robot = self._code, change.robot
        steps = [
            step
            for step in self._facts.changes(robot, What.CALLBACK, change.at_s)
            if code.variable(robot, step.address)
        ]
        recent = [step for step in steps if step.at_s > change.before_s]
        named = code.reads(robot, change.path)
        read = [step for step in steps if code.variable(robot, step.address) in named]
        inputs = self._inputs(change)
        here = Station(StationKind.ROBOT, robot)
        alone = Cause("alone" if change.tick > 1 else "start", here, change.at_s)
        if read and read[-1].at_s > change.before_s:
            return alone, read[-1]
        if inputs:
            kind, one = max(inputs, key=lambda pair: pair[1].at_s)
            return Cause(kind, here, one.at_s, code.place(robot, one.path), one.value), None
        if recent:
            return alone, recent[-1]
        return alone, read[-1] if read else None

    def _inputs(self, change: Change) -> list[tuple[str, Input]]:
        """Numbers and readings of the same pass."""
        hard = self._code.draws_at(change.robot, change.sensed.path)
        both = [("draw", change.drawn), ("draw" if hard else "reading", change.sensed)]
        return [(kind, one) for kind, one in both if change.at_s - one.at_s < _PASS_S]

    def _follow_heard(self, change: Change, since_s: float) -> None:
        """The message that a callback got which made the change."""
        message = self._facts.heard(change)
        here = Station(StationKind.ROBOT, change.robot)
        if message is None:
            self._end("forgotten", here, change.at_s)
            return
        others = self._facts.messages_to(here, since_s, message.at_s)
        self.links.append(Received(message, max(len(others) - 1, 0)))
        self._left -= 1
        self._follow_message(message)

    def _follow_message(self, message: Message) -> None:
        """Follows a message to what the sender's code made it of."""
        sender = message.sender
        if sender.kind == StationKind.CELL:
            self._follow_cell(message)
        elif sender.kind != StationKind.ROBOT:
            names = {
                StationKind.OVERHEAD: "overhead",
                StationKind.COMMAND: "command",
                StationKind.BEACON: "beacon",
            }
            self._end(names.get(sender.kind, "floor"), sender, message.begin_s)
        elif not self._code.is_watched(sender.number):
            self._end("native", sender, message.begin_s)
        elif self._left <= 0:
            self._end("depth", sender, message.begin_s)
        else:
            self._follow_sender(message)

    def _follow_sender(self, message: Message) -> None:
        sender = message.sender
        sending = self._facts.sending(sender.number, message.begin_s)
        if sending is None or sending.data != message.data:
            self._end("forgotten", sender, message.begin_s)
            return
        places = self._facts.of_sending(sending.number)
        known = self._had_before(message)
        begin = sending.address
        new = [it for it in places if known[it.address - begin] != it.now] if known else places
        if not (new or places):
            self._end("start", sender, sending.at_s)
            return
        last = (new or places)[-1]
        # Bytes of one number, or of one structure, are set by one line.
        together = [
            it
            for it in (new or places)
            if last.at_s - it.at_s < _LED_S and abs(it.address - last.address) < len(sending.data)
        ]
        together.sort(key=lambda it: it.address)
        first = together[0].address
        was, now = bytearray(), bytearray()
        for place in range(first, together[-1].address + 1):
            at = [it for it in together if it.address == place]
            now.append(sending.data[place - begin])
            was.append(at[0].was if at else sending.data[place - begin])
        self._follow_change(last, "message", bytes(was), bytes(now), first - begin)

    def _had_before(self, message: Message) -> bytes:
        """The last other bytes that the receiver had from that sender before; b"": none."""
        before = self._facts.messages_to(message.receiver, NEVER_S, message.begin_s)
        others = [
            it.data for it in before if it.sender == message.sender and it.data != message.data
        ]
        return others[-1] if others else b""

    def _follow_cell(self, message: Message) -> None:
        """A module's program tells no stores: what it sends now, and did not before, follows from
        what it received last."""
        cell = message.sender
        said = [
            it
            for it in self._facts.messages_of(cell, message.begin_s)
            if it.data[_TYPE] < _ORDERS or it.data == message.data
        ]
        since = len(said)
        while since > 0 and said[since - 1].data == message.data:
            since -= 1
        if since in (0, len(said)):
            self._end("cell", cell, message.begin_s)
            return
        began_s = said[since].begin_s
        first = Station(StationKind.CELL, cell.number // _MODULE_CELLS * _MODULE_CELLS)
        heard = self._facts.messages_to(first, began_s - _SOON_S, began_s, _MODULE_CELLS)
        self.links.append(CellTold(cell.number, began_s, said[since - 1].data, message.data))
        if not heard or self._left <= 0:
            self._end("depth" if heard else "cell", cell, began_s)
            return
        self.links.append(Received(heard[-1], len(heard) - 1))
        self._left -= 1
        self._follow_message(heard[-1])

    def _end(self, kind: str, station: Station, at_s: float) -> None:
        self.links.append(Cause(kind, station, at_s))
