"""A program for many modules' boot loaders: what to send next, from what they report.

No I/O and no clock. The caller sends the frames of a round, waits, hands over the reports that have
come (`take`), and asks for the next round, until there is none. Loaders of ours understand it
(docs/boot_loaders.md 5.2); modules that never report are told by `mute`.

A lap is the pages that any module of a bus lacks, for all of them at once. What a module has it
keeps, so that a program that was broken off goes on where it was.
"""

import functools
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

from kilotwin.experiment.spec.grid_layout import Layout, Module
from kilotwin.files.flash_image import FlashImage
from kilotwin.files.headers import BOOT_IDENTITY, PAGES_PER_REPORT
from kilotwin.table.can import transfer
from kilotwin.table.can.protocol import BootReport, to_module
from kilotwin.table.can.transfer import CRCS_PER_FRAME, Paced
from kilotwin.table.flash.module_rounds import (
    CHECK_S,
    ORDER_PAUSE_S,
    Round,
    call,
    groups,
    to_modules,
)
from kilotwin.table.grid.controller import Sending
from kilotwin.table.links.robot_link import LoaderState

CALLS = 4
"""How often a module is told to enter its boot loader before it counts as mute."""
ATTEMPTS = 6
"""How often a question is asked before silence counts."""
SILENT_ROUNDS = 3
"""How many laps a module may leave without an answer before it is given up."""
FRUITLESS_LAPS = 12
"""How many laps in a row may bring a module nothing before it is given up."""

_ANSWER_S = 0.15


class Fate(StrEnum):
    """Result of a module."""

    VERIFIED = "verified"
    INCOMPLETE = "incomplete"
    WRONG = "wrong"
    LOST = "lost"
    MUTE = "mute"


@dataclass
class _Loader:
    """A module as it reported last."""

    missing: int
    """Bit p: it lacks page p."""
    heard: bool = False
    state: int = LoaderState.NOTHING
    image_id: int | None = None
    owed: set[int] = field(default_factory=set)
    """The questions that it has not answered."""
    had_it: bool = False
    silent: int = 0
    fruitless: int = 0


class ModuleLaps:
    """One program on its way into some modules of a grid."""

    def __init__(
        self,
        image: FlashImage,
        layout: Layout,
        wanted: Iterable[Module],
        spared: Collection[Module] = (),
    ) -> None:
        """`wanted` are the modules to program; those of `spared` get no page that is for others."""
        self._image = image
        self._pages = image.pages
        self._all = (1 << len(self._pages)) - 1
        self._layout = layout
        self._loaders = {module: _Loader(self._all) for module in wanted}
        self._buses = {
            bus: [module for module in layout.modules_of(bus) if module in self._loaders]
            for bus in range(layout.buses)
        }
        self._groups = {
            bus: groups(modules, spared, layout.modules_of(bus))
            for bus, modules in self._buses.items()
        }
        self._rounds = self._script()
        self.laps = 0
        """Rounds that had pages."""
        self.pages_sent = 0
        """Pages in all of them, on the bus that had most."""

    def next_round(self) -> Round | None:
        """The round to send next; None: there is nothing more to do."""
        return next(self._rounds, None)

    def take(self, module: Module, report: BootReport) -> None:
        """A report that has come."""
        loader = self._loaders.get(module)
        if loader is None:
            return
        loader.heard = True
        loader.owed.discard(report.first)
        loader.state = report.state
        if report.id_low != self._image.image_id & 0xFF:
            loader.image_id = None
        if report.first == BOOT_IDENTITY:
            loader.image_id = report.missing
        else:
            mask = self._all & ((1 << PAGES_PER_REPORT) - 1) << report.first
            loader.missing = loader.missing & ~mask | report.missing << report.first & mask

    @property
    def mute(self) -> list[Module]:
        """Modules that never reported."""
        return [module for module, loader in self._loaders.items() if not loader.heard]

    @property
    def verified(self) -> list[Module]:
        """Modules that reported the program's id, and that it is complete and valid."""
        return [module for module, loader in self._loaders.items() if self._is_verified(loader)]

    def had_it(self, module: Module) -> bool:
        """Whether it was verified before a page was sent."""
        return self._loaders[module].had_it

    def missing(self, module: Module) -> int:
        """How many pages a module lacks, by its last report."""
        loader = self._loaders[module]
        return 0 if self._is_verified(loader) else loader.missing.bit_count()

    def fate(self, module: Module) -> Fate:
        """Result of a module, as if it ended here."""
        loader = self._loaders[module]
        if self._is_verified(loader):
            return Fate.VERIFIED
        if not loader.heard:
            return Fate.MUTE
        if loader.silent:
            return Fate.LOST
        return Fate.WRONG if loader.state == LoaderState.WRONG else Fate.INCOMPLETE

    def start(self) -> Round:
        """The verified modules are told to start the program."""
        order = Paced(to_module("MODULE_IDLE"), ORDER_PAUSE_S)
        orders = {module: [order] for module in self.verified}
        return to_modules("starting the program", self._layout, orders, 0.0)

    # The rounds.

    def _script(self) -> Iterator[Round]:
        yield from self._calling()
        yield from self._asking_all()
        for loader in self._loaders.values():
            loader.had_it = self._is_verified(loader)
        while self._open():
            before = {module: self.missing(module) for module in self._open()}
            yield self._lap()
            yield from self._asking_all()
            self._judge(before)

    def _calling(self) -> Iterator[Round]:
        """Sends modules into their loaders, until each has reported or none of them does."""
        for attempt in range(CALLS):
            mute = self.mute
            if not mute:
                return
            again = f", {attempt + 1}. time" if attempt else ""
            what = f"calling the boot loaders of {len(mute)} modules{again}"
            yield call(what, self._layout, mute)
            yield from self._announcing(mute)

    def _announcing(self, modules: Iterable[Module]) -> Iterator[Round]:
        """Announces the program to each of these, and asks what it has of it.

        Not to all at once: one that loses the first half of it would begin anew (docs/wire.md).
        """
        frames = list(transfer.modules_announcement(self._image))
        announcements = dict.fromkeys(modules, frames)
        yield to_modules("announcing the program", self._layout, announcements, CHECK_S)
        yield from self._asking({module: {BOOT_IDENTITY} for module in modules})

    def _asking_all(self) -> Iterator[Round]:
        """Learns how far each open module is; announces the program where it is not known."""
        for _ in range(ATTEMPTS):
            yield from self._asking({module: {BOOT_IDENTITY} for module in self._open()})
            answered = [m for m in self._open() if not self._loaders[m].owed]
            strangers = [m for m in answered if not self._knows(self._loaders[m])]
            if strangers:
                yield from self._announcing(strangers)
            loading = [m for m in answered if self._knows(self._loaders[m])]
            blocks = set(range(0, len(self._pages), PAGES_PER_REPORT))
            yield from self._asking({m: set(blocks) for m in self._open() if m in loading})
            checking = [m for m in loading if self._is_checking(self._loaders[m])]
            if not strangers and not checking:
                break
            if checking:
                yield Round(f"{len(checking)} modules check the program", {}, CHECK_S)
        for module in self._open():
            loader = self._loaders[module]
            loader.silent = loader.silent + 1 if loader.owed else 0
            if not loader.owed and not self._knows(loader):
                loader.missing = self._all
            loader.owed.clear()

    def _asking(self, questions: Mapping[Module, set[int]]) -> Iterator[Round]:
        """Puts questions until all are answered, or some too often."""
        for module, firsts in questions.items():
            self._loaders[module].owed = firsts
        for _ in range(ATTEMPTS):
            frames = {
                module: [transfer.modules_boot_query(first) for first in sorted(owed)]
                for module in questions
                if (owed := self._loaders[module].owed)
            }
            if not frames:
                return
            what = f"asking {len(frames)} modules what they have"
            yield to_modules(what, self._layout, frames, _ANSWER_S)

    def _lap(self) -> Round:
        """The pages that modules lack; no lap is for those that do not answer now."""
        frames: dict[int, list[Sending]] = {}
        most = 0
        for bus, modules in self._buses.items():
            open_ = self._open()
            lacking = [self._loaders[m] for m in modules if m in open_]
            lacking = [loader for loader in lacking if not loader.silent]
            union = functools.reduce(lambda mask, loader: mask | loader.missing, lacking, 0)
            pages = [page for page in range(len(self._pages)) if union >> page & 1]
            most = max(most, len(pages))
            wrong = any(loader.state == LoaderState.WRONG for loader in lacking)
            parts = self._lap_frames(pages, check_all=wrong)
            frames[bus] = [
                (group, frame) for part in parts for group in self._groups[bus] for frame in part
            ]
        self.laps += most > 0
        self.pages_sent += most
        done = f"{len(self.verified)} of {len(self._loaders)} modules have it"
        what = f"lap {self.laps}: {most} of {len(self._pages)} pages; {done}"
        return Round(what if most else f"waiting for modules; {done}", frames, CHECK_S)

    def _lap_frames(self, pages: Sequence[int], *, check_all: bool) -> Iterator[list[Paced]]:
        """Parts, each of which is sent to one group of modules after the other."""
        for page in pages:
            yield list(transfer.modules_page(page, self._pages[page]))
        checked = range(len(self._pages)) if check_all else pages
        for three in sorted({page - page % CRCS_PER_FRAME for page in checked}):
            yield [transfer.modules_page_crcs(self._image, three)]

    def _judge(self, before: Mapping[Module, int]) -> None:
        """Counts laps that brought a module nothing."""
        for module in self._open():
            loader = self._loaders[module]
            better = loader.missing.bit_count() < before[module]
            loader.fruitless = 0 if better else loader.fruitless + 1

    # Judging a module.

    def _open(self) -> list[Module]:
        """Modules that have reported, lack something, and are not given up."""
        return [
            module
            for module, loader in self._loaders.items()
            if loader.heard
            and not self._is_verified(loader)
            and loader.silent < SILENT_ROUNDS
            and loader.fruitless < FRUITLESS_LAPS
        ]

    def _is_verified(self, loader: _Loader) -> bool:
        return loader.state == LoaderState.COMPLETE and self._knows(loader)

    def _knows(self, loader: _Loader) -> bool:
        """Whether the image that it speaks of is this one."""
        return loader.image_id == self._image.image_id

    def _is_checking(self, loader: _Loader) -> bool:
        """Whether it has all pages, and computes their CRC."""
        answered = not loader.owed
        return answered and loader.state == LoaderState.LOADING and loader.missing == 0
