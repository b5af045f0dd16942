"""A program for all robots at once: what to send next, and what robots have of it.

Pure: no device, no clock. `Upload.script()` yields one action after the other; answers to an `Ask`
are sent back into it. Where answers come back, robots are asked after each lap, and the next one
has the pages that any robot still lacks. Where none come, laps are counted, and nothing is
promised.

A robot counts as verified by one answer that has both the image's id and that it is complete: its
boot loader says so only when the CRC of its flash is right (boot_loaders.md 2).
"""

import functools
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, field

from kilotwin.experiment.spec import overhead
from kilotwin.files.flash_image import FlashImage
from kilotwin.files.headers import (
    ALL_ROBOTS,
    BOOT_IDENTITY,
    MOST_SLOTS_LOG2,
    PAGES_PER_REPORT,
    VITALS,
)
from kilotwin.table.links import messages
from kilotwin.table.links.robot_link import LoaderState, Report, RobotState
from kilotwin.units import counted

# Robots that send at the moment, and those at the edge of a cell's light, hear one frame of many.
_BOOT_S, _SIZE_S, _CRC_S, _START_S, _RUN_S = 3.0, 1.5, 0.5, 2.0, 2.0
# A loader that has all of an image computes its CRC, and writes its record.
_CHECK_S = 1.0
# A few robots are asked one by one; all are asked again until so many times brought no new one.
_FEW, _TRIES_ALL, _TRIES_ONE = 2, 8, 10
# A robot on a grid may hardly be heard for two minutes: it turned its light away.
_PATIENCE, _LISTEN_S = 36, 5.0
# Laps that brought nothing, and laps in all, until those that are left are given up.
_STALLED_LAPS, _MOST_LAPS = 3, 20
# Laps after which it is not asked on once each page is known to be missing somewhere.
_HASTY_LAPS = 2
# How often a lap has each page; later ones as the last. Frames go out back to back, and one that is
# lost often takes the next one along.
_REPEATS = (1, 2, 4, 6)
_START_TRIES = 3
_LOOKS = 3
# A module listens to its cells in turn, from its question on: a robot that always answered at the
# same moment after it might never be heard.
_SLOTS_FOR_ONE_LOG2 = 3
_FEWEST_SLOTS, _SLOTS_FOR_UNKNOWN = 8, 64
_NONCES = 256


@dataclass(frozen=True)
class Repeat:
    """RobotLink.repeat()."""

    message: bytes
    hold_s: float


@dataclass(frozen=True)
class Announce:
    """RobotLink.announce()."""


@dataclass(frozen=True)
class SendPage:
    """RobotLink.send_page()."""

    page: int


@dataclass(frozen=True)
class Ask:
    """RobotLink.ask()."""

    first: int
    slots_log2: int
    nonce: int
    uid: int = ALL_ROBOTS


@dataclass(frozen=True)
class Pause:
    """Silence."""

    seconds: float


Action = Repeat | Announce | SendPage | Ask | Pause
Script = Generator[Action, Sequence[Report], None]


@dataclass(frozen=True)
class Wish:
    """A wanted upload. `uids`, `count`: robots expected; neither: those that answer at first."""

    image: FlashImage
    uids: frozenset[int] = frozenset()
    count: int | None = None
    laps: int = 3
    """For robots that do not answer: so often everywhere."""
    run: bool = False


@dataclass
class Robot:
    """One robot, as far as is known."""

    uid: int
    missing: frozenset[int]
    """Pages that it lacks as far as is known: all before it said otherwise."""
    verified: bool = False
    state: LoaderState | None = None
    """Its boot loader's; None if it has not been heard from there."""
    image_id: int | None = None
    application: RobotState | None = None
    """State of its application when it was last asked; None in the boot loader."""
    voltage: int | None = None
    heard: bool = False
    lap: int = -1
    """After which it has last spoken in its boot loader; -1: it has not."""
    said: dict[int, int] = field(default_factory=dict)
    """By the first page of a question, after which lap it last answered that."""
    module: tuple[int, int] | None = None
    cell: int | None = None


@dataclass
class Progress:
    """A line on what goes on, and how far it is, 0 to 1."""

    text: str = ""
    share: float = 0.0


@dataclass
class Upload:
    """One image on its way to all robots of a link."""

    wish: Wish
    verifies: bool
    """As RobotLink has these two."""
    laps_per_place: int
    robots: dict[int, Robot] = field(default_factory=dict)
    progress: Progress = field(default_factory=Progress)
    laps: int = 0
    """Laps that were sent everywhere."""
    verifiable: bool = True
    """Whether anything can be said of the robots: one answered, or was expected to."""
    called: bool = False
    """Whether robots were called into their boot loaders."""
    started: bool = False
    """Whether all was there, and robots were told to start it."""

    def __post_init__(self) -> None:
        self._pages = self.wish.image.pages
        self._every_page = frozenset(range(len(self._pages)))
        self._nonce = 0
        self.verifiable = self.verifies
        for uid in sorted(self.wish.uids):
            self.robots[uid] = Robot(uid, self._every_page)

    # Results.

    @property
    def verified(self) -> list[int]:
        """The uids of robots that have the image."""
        return sorted(uid for uid, robot in self.robots.items() if robot.verified)

    @property
    def failed(self) -> list[int]:
        """The uids of the others that are expected or have answered."""
        return sorted(uid for uid, robot in self.robots.items() if not robot.verified)

    @property
    def unknown(self) -> int:
        """How many of `count` were never heard."""
        return max(0, (self.wish.count or 0) - len(self.robots))

    @property
    def running(self) -> list[int]:
        """The uids of robots that have said that they run."""
        states = (RobotState.SETUP, RobotState.RUNNING)
        return sorted(uid for uid, robot in self.robots.items() if robot.application in states)

    @property
    def answers_when_running(self) -> bool:
        """Whether the program was built with our runtime: others do not answer."""
        return self.wish.image.build_id is not None

    @property
    def done(self) -> bool:
        """Whether all that are expected are verified."""
        return self.verifiable and bool(self.robots) and not self.failed and not self.unknown

    @property
    def well(self) -> bool:
        """Whether none that can be asked has failed."""
        if not self.verifiable:
            return True
        runs = not self.wish.run or not self.answers_when_running
        return self.done and (runs or len(self.running) == len(self.robots))

    # The script.

    def script(self) -> Script:
        """Actions one by one; to be sent the answers of an Ask, anything after others."""
        if self.verifies:
            yield from self._find()
            self.verifiable = bool(self.robots) or self.wish.count is not None
        if self.verifiable:
            yield from self._verified_laps()
        else:
            yield from self._blind_laps()

    def _find(self) -> Script:
        """Looks which robots are there, before they are called into their loaders.

        Of robots that are expected it need not hear all: it is to know whether some wait for the
        rest of an upload.
        """
        self._tell("looking for robots")
        if self.wish.uids or self.wish.count is not None:
            for _ in range(_LOOKS):
                yield from self._ask(VITALS, self._slots_log2(False))
        else:
            yield from self._inquire(VITALS, set, open_ended=lambda: True)

    def _verified_laps(self) -> Script:
        resumed = any(robot.state is LoaderState.LOADING for robot in self.robots.values())
        yield from self._call()
        yield from self._look_who_has_it()
        if resumed:
            yield from self._ask_for_pages(self._every_page)
        stalled = 0
        while not self.done and self._is_hopeful() and stalled < _STALLED_LAPS:
            before = self._lacking()
            yield from self._lap()
            stalled = 0 if self._lacking() < before else stalled + 1
        if self.done:
            yield from self._start()
        else:
            self._tell("looking for those that did not answer")
            yield from self._inquire(VITALS, lambda: set(self.failed))

    def _blind_laps(self) -> Script:
        """For robots that do not answer: they start by themselves, or by START, if all came."""
        yield from self._call()
        while self.laps < self.wish.laps:
            self.laps += 1
            yield from self._send(sorted(self._every_page))
        yield Repeat(messages.START, _START_S)
        self.started = True
        if self.wish.run:
            yield Repeat(overhead.RUN, _RUN_S)

    # Its steps.

    def _call(self) -> Script:
        """Into the loaders, and which image is to come; one that knows it already loses nothing."""
        self._tell("calling robots into their boot loaders")
        self.called = True
        yield Repeat(messages.BOOT, _BOOT_S)
        yield Repeat(messages.size(self.wish.image), _SIZE_S)

    def _lap(self) -> Script:
        """Sends what is missing anywhere, then asks what came of it."""
        self.laps += 1
        if self.laps > 1 and (self.unknown or any(map(self._is_uncalled, self._asked()))):
            yield from self._call()
        pages = self._pages_lacking() or self._every_page
        yield from self._send(sorted(pages))
        self._tell(f"lap {self.laps}: asking robots what they have")
        yield from self._ask_for_pages(pages)
        if all(map(self._all_is_missing, self._groups(pages))):
            return
        yield from self._inquire(BOOT_IDENTITY, self._in_question, open_ended=self._is_short)
        if not self._lacking_now():
            self._tell(f"lap {self.laps}: waiting for those that cannot be heard")
            yield from self._inquire(
                BOOT_IDENTITY, self._in_question, open_ended=self._is_short, patience=_PATIENCE
            )
        if any(r.state is LoaderState.WRONG for r in self.robots.values()):
            yield from self._check_pages()
            for robot in self.robots.values():
                robot.said.clear()
            yield from self._ask_for_pages(self._every_page)

    def _send(self, pages: list[int]) -> Script:
        """Pages everywhere.

        Later laps have few pages, and asking takes longer than sending them more than once.
        """
        repeats = _REPEATS[min(self.laps, len(_REPEATS)) - 1] if self.verifiable else 1
        rounds = self.laps_per_place * repeats
        total, sent = len(pages) * rounds, 0
        for _ in range(rounds):
            yield Announce()
            for page in pages:
                self._tell(self._lap_text(len(pages)), sent / total)
                yield SendPage(page)
                sent += 1

    def _check_pages(self) -> Script:
        """Has loaders whose image is wrong forget the pages that are."""
        for first in range(0, len(self._pages), messages.CRCS_PER_MESSAGE):
            yield Repeat(messages.page_crcs(self._pages, first), _CRC_S)
        yield Pause(_CHECK_S)

    def _look_who_has_it(self) -> Script:
        """Asks all, unless some do not have it: then a lap is due anyway."""
        for _ in range(_LOOKS):
            yield from self._ask(BOOT_IDENTITY, self._slots_log2(False))
        if not self._lacking_now():
            # Where some have it all may, and a lap takes longer than to wait for them.
            patience = _PATIENCE if self.verified else 0
            yield from self._inquire(
                BOOT_IDENTITY, self._in_question, open_ended=self._is_short, patience=patience
            )

    def _ask_for_pages(self, pages: frozenset[int]) -> Script:
        """Asks robots which of these pages they lack, until all of them lack all of it."""
        for group in self._groups(pages):
            first = min(group) // PAGES_PER_REPORT * PAGES_PER_REPORT
            yield from self._inquire(first, functools.partial(self._unasked, group))

    def _groups(self, pages: frozenset[int]) -> list[frozenset[int]]:
        """The pages by the reports that they are in."""
        firsts = range(0, len(self._pages), PAGES_PER_REPORT)
        groups = [pages & frozenset(range(first, first + PAGES_PER_REPORT)) for first in firsts]
        return [group for group in groups if group]

    def _start(self) -> Script:
        self.started = True
        self._tell("starting the program")
        for _ in range(_START_TRIES):
            yield Repeat(messages.START, _START_S)
            for robot in self.robots.values():
                robot.state = None
            yield from self._inquire(VITALS, self._not_started)
            if not any(r.state is not None for r in self.robots.values()):
                break
        for patience in (0, 0, _PATIENCE) if self.wish.run else ():
            yield Repeat(overhead.RUN, _RUN_S)
            if not self.answers_when_running:
                break
            for uid in self.robots.keys() - set(self.running):
                self.robots[uid].application = None
            yield from self._inquire(VITALS, self._not_started, patience=patience)
            if len(self.running) == len(self.robots):
                break

    # Asking.

    def _inquire(
        self,
        first: int,
        wanted: Callable[[], set[int]],
        *,
        open_ended: Callable[[], bool] = lambda: False,
        patience: int = 0,
    ) -> Script:
        """Asks until those of `wanted` have answered, or it seems to be of no use.

        `open_ended`: asks on for robots that are not known yet. `patience`: after so many pauses it
        is asked once more, since robots are hardly heard for minutes.
        """
        answered: set[int] = set()
        tries = 0
        while (left := wanted() - answered) or open_ended():
            few = len(left) <= _FEW and ALL_ROBOTS not in left and not open_ended()
            if few:
                heard = yield from self._ask_one_by_one(first, left)
            else:
                heard = yield from self._ask(first, self._slots_log2(open_ended()))
            tries = tries + 1 if heard <= answered else 0
            answered |= heard
            if tries >= (_TRIES_ONE if few else _TRIES_ALL):
                if patience == 0:
                    return
                patience -= 1
                yield Pause(_LISTEN_S)

    def _ask_one_by_one(
        self, first: int, uids: set[int]
    ) -> Generator[Action, Sequence[Report], set[int]]:
        heard = set[int]()
        for uid in sorted(uids):
            heard |= yield from self._ask(first, _SLOTS_FOR_ONE_LOG2, uid)
        return heard

    def _ask(
        self, first: int, slots_log2: int, uid: int = ALL_ROBOTS
    ) -> Generator[Action, Sequence[Report], set[int]]:
        """One question; returns the uids that answered."""
        self._nonce = (self._nonce + 1) % _NONCES
        reports = yield Ask(first, slots_log2, self._nonce, uid)
        for report in reports:
            self._note(report)
        return {report.uid for report in reports}

    def _note(self, report: Report) -> None:
        robot = self.robots.setdefault(report.uid, Robot(report.uid, self._every_page))
        robot.heard = True
        if report.module is not None:
            robot.module, robot.cell = report.module, report.cell
        if report.in_loader:
            robot.application = None
            robot.state = report.loader_state
            if report.first != VITALS:
                robot.lap = self.laps
                self._note_image(robot, report)
            return
        robot.lap = -1
        robot.state, robot.application = None, report.robot_state
        robot.voltage = report.voltage
        if not self.started:
            robot.verified, robot.missing, robot.image_id = False, self._every_page, None

    def _note_image(self, robot: Robot, report: Report) -> None:
        if robot.state is not LoaderState.COMPLETE:
            robot.verified = False
        if report.first == BOOT_IDENTITY:
            robot.image_id = report.image_id
            if not self._is_announced(robot):
                robot.verified, robot.missing = False, self._every_page
            elif robot.state is LoaderState.COMPLETE:
                robot.verified, robot.missing = True, frozenset()
        elif robot.image_id in (None, self.wish.image.image_id):
            if robot.state is not LoaderState.LOADING and robot.image_id is None:
                return  # of another image, for all that is known
            asked = frozenset(range(report.first, report.first + PAGES_PER_REPORT))
            robot.missing = (robot.missing - asked) | (report.missing & self._every_page)
            robot.said[report.first] = self.laps

    # Robots that are meant.

    def _is_announced(self, robot: Robot) -> bool:
        """Whether its loader knows of the image, as far as it has said."""
        known = robot.state is not LoaderState.NOTHING
        return known and robot.image_id == self.wish.image.image_id

    def _asked(self) -> set[int]:
        """Those that are not verified; such as were never heard in a loader for some laps only."""
        patient = self.laps <= self.wish.laps
        return {uid for uid in self.failed if patient or self.robots[uid].lap >= 0}

    def _lacking_now(self) -> set[int]:
        """Those that have said since the last lap that they do not have all."""
        told = [self.robots[uid] for uid in self.failed if self.robots[uid].lap == self.laps]
        known = (None, self.wish.image.image_id)
        return {
            robot.uid
            for robot in told
            if robot.state is not LoaderState.COMPLETE or robot.image_id not in known
        }

    def _in_question(self) -> set[int]:
        """Those that have not said it, and may have all."""
        return self._asked() - self._lacking_now()

    def _unasked(self, pages: frozenset[int]) -> set[int]:
        """Those to be asked for pages; none if all of these are to be sent again anyway."""
        return set() if self._all_is_missing(pages) else self._asked()

    def _all_is_missing(self, pages: frozenset[int]) -> bool:
        """Whether each of these pages is missing somewhere, as was said since the last lap.

        They are of one report. Later laps ask on: one robot must not keep others from being heard.
        """
        if self.laps > _HASTY_LAPS:
            return False
        first = min(pages) // PAGES_PER_REPORT * PAGES_PER_REPORT
        told = (robot for robot in self.robots.values() if robot.said.get(first) == self.laps)
        return pages <= frozenset[int]().union(*(robot.missing for robot in told))

    def _is_short(self) -> bool:
        return self.unknown > 0

    def _is_uncalled(self, uid: int) -> bool:
        return not self._is_announced(self.robots[uid])

    def _pages_lacking(self) -> frozenset[int]:
        """Pages that robots lack, of those that have said it. Others have lost pages like them."""
        known = [self.robots[uid] for uid in self._asked() if self.robots[uid].lap >= 0]
        return frozenset[int]().union(*(robot.missing for robot in known))

    def _is_hopeful(self) -> bool:
        """Whether another lap may bring any robot anything."""
        if self.laps >= _MOST_LAPS:
            return False
        heard = any(self.robots[uid].lap >= 0 for uid in self.failed)
        return self.laps < self.wish.laps or heard

    def _not_started(self) -> set[int]:
        return {uid for uid, robot in self.robots.items() if robot.application is None}

    def _lacking(self) -> int:
        """A measure of what is left to do."""
        every = len(self._every_page) + 1
        left = sum(len(self.robots[uid].missing) + 1 for uid in self.failed)
        return left + every * self.unknown

    def _slots_log2(self, open_ended: bool) -> int:
        """About as many slots as robots: more than a third of them answers, wherever they are.

        Where they are apart, more do. `open_ended`: twice as many robots may be there as is known.
        """
        robots = max(len(self.robots), self.wish.count or 0, _FEWEST_SLOTS)
        if open_ended and self.wish.count is None:
            robots = max(2 * len(self.robots), _SLOTS_FOR_UNKNOWN)
        return min(MOST_SLOTS_LOG2, (robots - 1).bit_length())

    def _tell(self, text: str, share: float = 0.0) -> None:
        self.progress.text, self.progress.share = text, share

    def _lap_text(self, pages: int) -> str:
        times = f", by each of {self.laps_per_place} cells" if self.laps_per_place > 1 else ""
        have = (
            f"; {len(self.verified)} of {len(self.robots)} robots have all" if self.robots else ""
        )
        return f"lap {self.laps}: {counted(pages, 'page')}{times}{have}"
