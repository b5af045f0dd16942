"""Words that an environment wants to tell robots, and the order and pace in which they go out.

The overhead controller repeats a message, frame by frame, until the next packet comes on its
serial line (hardware.md 1.11). A packet takes 34 ms there, so this is the pace: not a frame, but a
packet, of three words. Words that wait are sent in the order in which their robots came; a newer
word for a robot takes the place of the one that waits.
"""

from collections import OrderedDict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from kilotwin.experiment.areas import Area, contains
from kilotwin.experiment.spec.ark import MESSAGE_TYPE, WORDS, Layout, Word
from kilotwin.experiment.spec.overhead import DATA_BYTES, message
from kilotwin.table.environment.protocol import Seen
from kilotwin.table.links.packets import OVERHEAD_BAUD, PACKET_BYTES, Overhead, encode

PACKET_S = PACKET_BYTES * 10 / OVERHEAD_BAUD
"""A packet on the line, 8N1."""
_LAST_USER_TYPE = 0x7F


@dataclass(frozen=True, slots=True)
class Wanted:
    """A word, or bytes for all robots, and when it was wanted."""

    asked_s: float
    word: Word | None
    message: bytes = b""
    """For all: nine bytes and the type."""


@dataclass(frozen=True, slots=True)
class Sending:
    """A packet on the line, from `at_s` on. It holds `told`; a STOP holds nothing."""

    at_s: float
    packet: bytes
    told: tuple[Wanted, ...]

    @property
    def there_s(self) -> float:
        """When the controller has it, and its light begins."""
        return self.at_s + PACKET_S


class Outbox:
    """A `protocol.Sender`, with what it was given."""

    def __init__(self, message_s: float, uids: Iterable[int], layout: Layout) -> None:
        """`message_s`: from packet to packet, PACKET_S at least. `uids`: those that may be told.
        `layout`: of words."""
        self._message_s, self._layout = message_s, layout
        self._uids = frozenset(uids)
        self._words: OrderedDict[tuple[int, int], Wanted] = OrderedDict()
        self._for_all: OrderedDict[int, Wanted] = OrderedDict()
        self._orders: list[tuple[float, bytes, float]] = []
        self._free_s = float("-inf")
        self._shines = False
        self.now_s = 0.0
        """The time of what is wanted; whoever calls the program sets it."""
        self.asked = 0
        self.replaced = 0

    @property
    def waiting(self) -> int:
        """So many words and messages have not been sent."""
        return len(self._words) + len(self._for_all)

    def __call__(self, uid: int, value: int, type: int = 0) -> None:
        """See protocol.Sender."""
        word = self._layout.word(uid, type, value)
        if uid not in self._uids:
            raise ValueError(f"there is no robot with the uid {uid}")
        self._want(self._words, (uid, type), Wanted(self.now_s, word))

    def to_all(self, data: Iterable[int], type: int) -> None:
        """See protocol.Sender."""
        if not MESSAGE_TYPE <= type <= _LAST_USER_TYPE:
            allowed = f"{MESSAGE_TYPE} to {_LAST_USER_TYPE}"
            raise ValueError(f"type is {type}; for all robots it must be {allowed}")
        data = bytes(data)
        if len(data) > DATA_BYTES:
            raise ValueError(f"a message has {DATA_BYTES} bytes, not {len(data)}")
        self._want(self._for_all, type, Wanted(self.now_s, None, message(data, type)))

    def _want(self, waiting: OrderedDict[Any, Wanted], key: Any, wanted: Wanted) -> None:
        self.asked += 1
        self.replaced += key in waiting
        waiting[key] = wanted

    def order(self, at_s: float, message_: bytes, hold_s: float) -> None:
        """A message, nine bytes and the type, from `at_s` on, before all else and for so long. In
        order of time."""
        self._orders.append((at_s, message_, hold_s))

    @property
    def orders(self) -> int:
        """So many have not been sent."""
        return len(self._orders)

    def sendings(self, begin_s: float, end_s: float) -> Iterator[Sending]:
        """The packets that begin in [begin_s, end_s), if nothing more is wanted meanwhile."""
        at_s = max(begin_s, self._free_s)
        while at_s < end_s:
            told: tuple[Wanted, ...] = ()
            if self._orders and self._orders[0][0] <= at_s:
                _, message_, hold_s = self._orders.pop(0)
                packet = encode(Overhead.FORWARDMSG, message_)
                self._free_s, self._shines = at_s + max(hold_s, self._message_s), True
            elif self.waiting:
                packet, told = self._next()
                self._free_s, self._shines = at_s + self._message_s, True
            elif self._shines:
                packet = encode(Overhead.STOP)
                self._free_s, self._shines = at_s + PACKET_S, False
            else:
                return
            yield Sending(at_s, packet, told)
            at_s = self._free_s

    def _next(self) -> tuple[bytes, tuple[Wanted, ...]]:
        """The packet that goes out next."""
        if self._for_all:
            _, wanted = self._for_all.popitem(last=False)
            return encode(Overhead.FORWARDMSG, wanted.message), (wanted,)
        count = min(WORDS, len(self._words))
        told = tuple(self._words.popitem(last=False)[1] for _ in range(count))
        words = [wanted.word for wanted in told if wanted.word is not None]
        return encode(Overhead.FORWARDMSG, self._layout.pack(words)), told


class Outboxes:
    """A `protocol.Sender` for one controller or several, each with an `Outbox` and a line of its
    own.

    A word goes out by all controllers that cover its robot where it was seen last; before it was
    seen, by all. Bytes for all robots go out by all.
    """

    def __init__(self, boxes: Sequence[Outbox], areas: Sequence[Area]) -> None:
        """`areas`: what each covers; empty: there is one, over all robots."""
        self.boxes = boxes
        self._areas = areas
        self._places: dict[int, tuple[float, float]] = {}
        self.asked = 0
        self.uncovered = 0
        """So many words were for robots that no controller covered."""

    def see(self, seen: Seen, now_s: float) -> None:
        """A picture; what is wanted from now on is wanted at `now_s`."""
        for box in self.boxes:
            box.now_s = now_s
        if self._areas:
            self._places.update({robot.uid: (robot.x_m, robot.y_m) for robot in seen.robots})

    @property
    def now_s(self) -> float:
        """The time of what is wanted."""
        return self.boxes[0].now_s

    @property
    def replaced(self) -> int:
        """So many words gave way to a newer one, at a controller."""
        return sum(box.replaced for box in self.boxes)

    @property
    def waiting(self) -> int:
        """So many have not been sent, at a controller."""
        return sum(box.waiting for box in self.boxes)

    def __call__(self, uid: int, value: int, type: int = 0) -> None:
        """See protocol.Sender."""
        place = self._places.get(uid)
        boxes = [
            box
            for number, box in enumerate(self.boxes)
            if not self._areas or place is None or contains(self._areas[number], *place)
        ]
        for box in boxes:
            box(uid, value, type)
        self.asked += 1
        self.uncovered += not boxes

    def to_all(self, data: Iterable[int], type: int) -> None:
        """See protocol.Sender."""
        data = bytes(data)
        for box in self.boxes:
            box.to_all(data, type)
        self.asked += 1
