"""A model of robots with boot loaders, of frames that get lost, and of reach."""

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from kilotwin.experiment.spec import overhead
from kilotwin.files.flash_image import FlashImage
from kilotwin.files.headers import ALL_ROBOTS, BOOT_IDENTITY, VITALS
from kilotwin.files.message_crc import message_crc
from kilotwin.table.flash.upload import Action, Announce, Ask, Pause, Repeat, SendPage, Upload
from kilotwin.table.links import messages
from kilotwin.table.links.robot_link import LoaderState, MessageType, Report, RobotState, slot_of

FRAGMENTS = 22
FRAGMENT = 6
# Copies of a repeated message that a robot has a chance to hear, per second.
COPIES_PER_S = 20


@dataclass
class ModelRobot:
    """One robot. `cells`: those whose light reaches it."""

    uid: int
    cells: frozenset[int] = frozenset({0})
    deaf: bool = False
    """Asleep, or out of reach."""
    mute: bool = False
    """With the original firmware: it takes programs, but answers nothing."""
    in_loader: bool = False
    application: RobotState = RobotState.IDLE
    announced: int | None = None
    pages: int = 0
    flash: dict[int, dict[int, bytes]] = field(default_factory=dict)
    damages: set[int] = field(default_factory=set)
    """Pages that are written wrongly once."""
    starts: int = 0
    old_id: int = 0x11111111
    broken: bool = False
    """Never comes to a right CRC."""

    def reset(self) -> None:
        """Forgets what came."""
        self.flash.clear()

    def content(self, page: int) -> bytes | None:
        """A page that is complete."""
        parts = self.flash.get(page, {})
        if len(parts) < FRAGMENTS:
            return None
        return b"".join(parts[i] for i in range(FRAGMENTS))[:128]

    def missing(self, first: int) -> int:
        """The bits of a report."""
        pages = range(first, min(first + 32, self.pages))
        return sum(1 << page - first for page in pages if self.content(page) is None)

    def state(self, image: FlashImage) -> LoaderState:
        """As it would report."""
        if self.announced is None:
            return LoaderState.COMPLETE if self.old_id else LoaderState.NOTHING
        if any(self.content(page) is None for page in range(self.pages)):
            return LoaderState.LOADING
        whole = b"".join(self.content(page) or b"" for page in range(self.pages))
        right = message_crc(whole) == image.crc16 and not self.broken
        return LoaderState.COMPLETE if right else LoaderState.WRONG


class Swarm:
    """Robots that an upload's actions are carried out on."""

    def __init__(
        self,
        image: FlashImage,
        robots: Sequence[ModelRobot],
        *,
        loss: float = 0.0,
        heard: float = 1.0,
        cells: int = 1,
        seed: int = 1,
    ) -> None:
        """`loss` of frames to robots, `heard` of answers."""
        self.image, self.robots = image, list(robots)
        self._loss, self._heard, self._cells = loss, heard, cells
        self._random = random.Random(seed)
        self._lap = -1
        self._size_due = False
        self.actions: list[Action] = []

    def perform(self, action: Action) -> list[Report]:
        """An action carried out by devices and robots."""
        self.actions.append(action)
        match action:
            case Repeat(message, hold_s):
                for robot in self.robots:
                    if not robot.deaf and self._some(round(hold_s * COPIES_PER_S)):
                        self._take(robot, message)
            case Announce():
                self._lap += 1
                self._size_due = True
            case SendPage(page):
                self._send(page)
            case Ask():
                return self._answers(action)
            case Pause(seconds):
                assert seconds >= 1
        return []

    def run(self, upload: Upload, before: Callable[[Action], object] = lambda _: None) -> None:
        """All of a script; `before` sees each action before it is carried out."""
        script = upload.script()
        try:
            action = next(script)
            while True:
                before(action)
                action = script.send(self.perform(action))
        except StopIteration:
            return

    @property
    def pages_sent(self) -> int:
        """So many, by all cells."""
        return sum(isinstance(action, SendPage) for action in self.actions)

    def whole(self) -> list[int]:
        """The uids of robots that have the image, byte for byte."""
        pages = self.image.pages
        return [
            robot.uid
            for robot in self.robots
            if [robot.content(page) for page in range(len(pages))] == pages
        ]

    def _some(self, copies: int) -> bool:
        return self._random.random() >= self._loss ** max(1, copies)

    def _take(self, robot: ModelRobot, message: bytes) -> None:
        kind = message[9]
        if message == messages.BOOT:
            robot.in_loader = True
        elif message == overhead.RUN and not robot.in_loader:
            robot.application = RobotState.RUNNING
        elif not robot.in_loader:
            return
        elif kind == MessageType.SIZE:
            number = int.from_bytes(message[5:9], "little")
            if number != robot.announced:
                robot.reset()
            robot.announced, robot.pages = number, message[0]
        elif kind == MessageType.CRC:
            for i in range(4):
                content = robot.content(message[0] + i)
                crc = int.from_bytes(message[1 + 2 * i : 3 + 2 * i], "little")
                if content is not None and message_crc(content) != crc:
                    del robot.flash[message[0] + i]
        elif message == messages.START and robot.state(self.image) is LoaderState.COMPLETE:
            robot.in_loader, robot.application = False, RobotState.IDLE
            robot.starts += 1

    def _send(self, page: int) -> None:
        for robot in self.robots:
            if robot.deaf or self._lap % self._cells not in robot.cells:
                continue
            if self._size_due and self._some(1):
                self._take(robot, messages.size(self.image))
            for number in range(FRAGMENTS):
                if robot.in_loader and robot.announced is not None and self._some(1):
                    self._fragment(robot, page, number)
        self._size_due = False

    def _fragment(self, robot: ModelRobot, page: int, number: int) -> None:
        data = self.image.pages[page][number * FRAGMENT : (number + 1) * FRAGMENT]
        if page in robot.damages and number == 3:
            robot.damages.discard(page)
            data = bytes(byte ^ 1 for byte in data)
        robot.flash.setdefault(page, {}).setdefault(number, data)

    def _answers(self, ask: Ask) -> list[Report]:
        found: dict[int, list[Report]] = {}
        for robot in self.robots:
            wanted = ask.uid in (robot.uid, ALL_ROBOTS)
            silent = robot.deaf or robot.mute or not (robot.in_loader or ask.first == VITALS)
            if wanted and not silent and self._some(1) and self._random.random() < self._heard:
                slot = slot_of(robot.uid, ask.nonce, ask.slots_log2)
                found.setdefault(slot, []).append(self._report(robot, ask.first))
        return [reports[0] for reports in found.values() if len(reports) == 1]

    def _report(self, robot: ModelRobot, first: int) -> Report:
        state = robot.state(self.image) if robot.in_loader else 0x10 + robot.application
        number = 0
        if first == BOOT_IDENTITY:
            number = robot.old_id if robot.announced is None else robot.announced
        elif first == VITALS:
            number = 0 if robot.in_loader else 700 & 255 | 700 >> 8 << 30
        else:
            number = robot.missing(first)
        content = number.to_bytes(4, "little")
        return Report(robot.uid, first, content, state, module=(1, 2), cell=min(robot.cells))
