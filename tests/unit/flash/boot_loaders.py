"""Modules in their boot loaders for tests of the host: docs/boot_loaders.md 5.2, in Python.

It is written from the document alone and shares no code with the host. Each module misses frames
by itself, with its own luck.
"""

import binascii
import itertools
import random
import zlib
from dataclasses import dataclass, field

PAGE, FRAGMENTS, FRAGMENT = 128, 22, 6
NOTHING, LOADING, COMPLETE, WRONG = range(4)
BOOT, IDLE, PAGE_CRC, QUERY, REPORT, POLL, RECORDS = 0x06, 0x0B, 0x16, 0x17, 0x18, 0x15, 0x14
OLD = 0x9F
CHECK_S, BOOT_S = 0.3, 1.2
_REVERSED = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))


def crc16(data: bytes) -> int:
    """CRC-16/MCRF4XX."""
    return int(f"{binascii.crc_hqx(data.translate(_REVERSED), 0xFFFF):016b}"[::-1], 2)


@dataclass
class Module:
    """One module: its program, and what its loader has of another. `ours`: the loader answers."""

    x: int
    y: int
    ours: bool = True
    enters: bool = True
    """Whether it goes into its loader when told to."""
    program: bytes = b"old"
    in_loader: bool = False
    dead: bool = False
    startable: bool = True
    takes_pages: bool = True
    forget_ends: bool = False
    """Takes chunks that follow a lost page number for the page before, as a bad loader would."""
    pending: tuple[int, int] | None = None
    announced: tuple[int, int | None, int] | None = None  # pages, CRC, id
    pages: dict[int, dict[int, bytes]] = field(default_factory=dict)
    page: int | None = None
    last: int = -1
    erased: bool = False
    checked_at_s: float | None = None
    verdict: int | None = None
    started_at_s: float = -10.0
    sent: list[bytes] = field(default_factory=list)
    """Frames of pages that came while it was not in its loader."""

    def power_cycle(self) -> None:
        """Off and on again: RAM is lost, and a program that was being replaced is gone."""
        self.in_loader = self.in_loader or self.program == b""
        self.announced = self.pending = self.page = None
        self.pages, self.erased, self.verdict = {}, False, None

    def receive(self, data: bytes, now_s: float) -> list[bytes]:
        """A frame; returns the answers."""
        kind = data[0]
        if self.dead:
            return []
        if not self.in_loader:
            return self._run(kind, data, now_s)
        if not self.ours:
            return self._original(kind, data)
        kind = kind - OLD if kind >= 0xA6 else kind
        if kind == 0x08:
            self._announce(data)
            self._look(now_s)
        elif kind == 0x09:
            self.page, self.last = data[2], -1
        elif kind == 0x07:
            self._fragment(data, now_s)
        elif kind == PAGE_CRC:
            self._check_pages(data, now_s)
        elif kind == QUERY:
            return [self._report(data[1], now_s)]
        elif kind in (IDLE, 0x0C, 0x0D) and self._state(now_s) == COMPLETE:
            self.in_loader, self.started_at_s = False, now_s
        return []

    def _run(self, kind: int, data: bytes, now_s: float) -> list[bytes]:
        if now_s - self.started_at_s < BOOT_S:
            return []
        if kind == BOOT and self.enters:
            self.in_loader = True
            self.announced = self.pending = None
            self.verdict, self.pages, self.erased = None, {}, False
        if kind in (0x07, 0x08, 0x09, 0xA6, 0xA7, 0xA8):
            self.sent.append(data)
        return [bytes([RECORDS, 0])] if kind == POLL else []

    def _original(self, kind: int, data: bytes) -> list[bytes]:
        """Counts bytes; starts when there are enough."""
        if kind == 0xA7:
            self.announced, self.pages = (data[2], None, 0), {}
        elif kind == 0xA8:
            self.page = data[2]
            self.pages[data[2]] = {}
        elif kind == 0xA6 and self.page is not None:
            self.pages[self.page][data[1]] = data[2:]
            pages = self.announced[0] if self.announced else 0
            if sum(map(len, self.pages.values())) == pages * FRAGMENTS:
                self.program = self._content()
                self.in_loader = False
        return []

    def _announce(self, data: bytes) -> None:
        if data[1] == 1:
            number = int.from_bytes(data[4:8], "little")
            self.pending = (int.from_bytes(data[2:4], "little"), number)
            return
        crc, number = self.pending or (None, 0xFFFFFFFF)
        self.pending = None
        if self.announced == (data[2], crc, number):
            return
        self.announced = (data[2], crc, number)
        self.pages, self.erased, self.verdict, self.page = {}, False, None, None

    def _look(self, now_s: float) -> None:
        """A program that is there already, by its record."""
        assert self.announced or self.pending
        if self.announced and self.announced[1] is not None and not self.erased:
            there = self.announced == (len(self.program) // PAGE, *self._marks(self.program))
            if there and self.verdict is None:
                self.checked_at_s, self.verdict = now_s + CHECK_S, COMPLETE

    def _fragment(self, data: bytes, now_s: float) -> None:
        restarted = data[1] <= self.last and not self.forget_ends
        self.last = data[1]
        if restarted:
            self.page = None
        if self.announced is None or self.page is None or self.verdict is not None:
            return
        if not self.erased:
            self.erased, self.program = True, b""
        if not self.takes_pages:
            return
        if self.page >= self.announced[0]:
            return
        here = self.pages.setdefault(self.page, {})
        before = len(here)
        here.setdefault(data[1], data[2:])
        if before < len(here) == FRAGMENTS and not self._missing():
            right = crc16(self._content()) == self.announced[1] and self.startable
            self.verdict, self.checked_at_s = COMPLETE if right else WRONG, now_s + CHECK_S

    def _check_pages(self, data: bytes, now_s: float) -> None:
        if self.announced is None or self._state(now_s) not in (LOADING, WRONG):
            return
        for i in range(3):
            page, crc = data[1] + i, int.from_bytes(data[2 + 2 * i : 4 + 2 * i], "little")
            complete = page < self.announced[0] and len(self.pages.get(page, {})) == FRAGMENTS
            if complete and crc16(self._page(page)) != crc:
                self.verdict = None
                self.pages = {} if page == 0 else {**self.pages, page: {}}

    def _report(self, first: int, now_s: float) -> bytes:
        state, number = self._state(now_s), self._id(now_s)
        bits = number
        if first != 0xE0:
            bits = sum(1 << p - first for p in self._missing() if first <= p < first + 32)
            if state in (COMPLETE, WRONG) or self.announced is None:
                bits = 0
        return bytes([REPORT, first]) + bits.to_bytes(4, "little") + bytes([state, number & 0xFF])

    def _state(self, now_s: float) -> int:
        if self.announced is None:
            return COMPLETE if self.program else NOTHING
        if self.verdict is None or (self.checked_at_s or 0) > now_s:
            return LOADING
        if self.verdict == COMPLETE and self.erased:
            self.program = self._content()
        return self.verdict

    def _id(self, now_s: float) -> int:
        if self.announced is not None:
            return self.announced[2]
        return self._marks(self.program)[1] if self.program else 0xFFFFFFFF

    def _missing(self) -> list[int]:
        if self.announced is None or self.verdict is not None:
            return []
        pages = range(self.announced[0])
        return [page for page in pages if len(self.pages.get(page, {})) < FRAGMENTS]

    def _page(self, page: int) -> bytes:
        return b"".join(self.pages[page][i] for i in range(FRAGMENTS))[:PAGE]

    def _content(self) -> bytes:
        return b"".join(map(self._page, sorted(self.pages)))

    @staticmethod
    def _marks(content: bytes) -> tuple[int, int]:
        return crc16(content), zlib.crc32(content)


class Modules:
    """Modules on buses; each misses a frame with probability `loss`, and so does the host."""

    def __init__(self, places: list[tuple[int, int]], loss: float = 0.0, seed: int = 1) -> None:
        self.of = {place: Module(*place) for place in places}
        self.loss = loss
        self.frames = 0
        self.only: set[tuple[int, int]] | None = None
        """Modules on the bus that frames come from; None: a bus has all of them."""
        self._chance = random.Random(seed)
        self._rows = {y: {p: self.of[p] for p in places if p[1] == y} for _, y in places}

    def receive(
        self, identifier: int, data: bytes, now_s: float
    ) -> list[tuple[tuple[int, int], bytes]]:
        """A frame of the host; returns the answers that reach it."""
        self.frames += 1
        x, y = (identifier >> 1 & 31) - 1, (identifier >> 6) - 1
        answers = []
        rows = self._rows.values() if y < 0 else [self._rows.get(y, {})]
        for place, module in itertools.chain.from_iterable(row.items() for row in rows):
            heard = self.only is None or place in self.only
            if heard and x in (-1, module.x) and not self._lost():
                told = module.receive(data, now_s)
                answers += [(place, answer) for answer in told if not self._lost()]
        return answers

    def programs(self) -> set[bytes]:
        return {module.program for module in self.of.values()}

    def _lost(self) -> bool:
        return self.loss > 0 and self._chance.random() < self.loss
