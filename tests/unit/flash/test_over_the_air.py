"""An upload on a link: what is shown, what is said at the end, and when it is broken off."""

import random
from collections.abc import Sequence

import pytest

from kilotwin.commands.flash.robots import parse_uids
from kilotwin.errors import DeviceError, InputError, InterruptError
from kilotwin.files.flash_image import FlashImage
from kilotwin.files.headers import ALL_ROBOTS
from kilotwin.table.flash import over_the_air
from kilotwin.table.flash.over_the_air import SwarmFlasher
from kilotwin.table.flash.upload import Announce, Ask, Pause, Repeat, SendPage, Upload, Wish
from kilotwin.table.links.robot_link import LoaderState, Report, RobotState

from .swarm_model import ModelRobot, Swarm

IMAGE = FlashImage(random.Random(1).randbytes(10 * 128))
_TEXT = b"robot walker avr-gcc-5.4.0 kilotwin-0.2.0"
OURS = FlashImage(random.Random(1).randbytes(900) + _TEXT + bytes([len(_TEXT)]) + b"KTID")


class Link:
    """A link to a model's robots, which fails or is interrupted at one of its calls."""

    name = "model"
    laps_per_place = 1

    def __init__(self, model: Swarm, *, verifies: bool = True) -> None:
        self.model, self.verifies = model, verifies
        self.fails_at: int | None = None
        self.failure: BaseException = DeviceError("--can can0: network is down")
        self.calls = 0

    def _count(self) -> None:
        self.calls += 1
        if self.calls == self.fails_at:
            raise self.failure

    def repeat(self, message: bytes, hold_s: float) -> None:
        self._count()
        self.model.perform(Repeat(message, hold_s))

    def announce(self, image: FlashImage) -> None:
        assert image is self.model.image
        self.model.perform(Announce())

    def send_page(self, page: int, data: bytes) -> None:
        self._count()
        assert data == self.model.image.pages[page]
        self.model.perform(SendPage(page))

    def ask(self, first: int, slots_log2: int, nonce: int, uid: int = ALL_ROBOTS) -> list[Report]:
        return self.model.perform(Ask(first, slots_log2, nonce, uid))

    def close(self) -> None:
        pass

    # As a clock.

    def now_s(self) -> float:
        return 0.0

    def sleep(self, seconds: float) -> None:
        self.model.perform(Pause(seconds))


class Display:
    """Keeps what is shown."""

    def __init__(self) -> None:
        self.steps: list[str] = []
        self.shares: list[float] = []

    def step(self, text: str) -> None:
        self.steps.append(text)

    def part(self, share: float) -> None:
        self.shares.append(share)

    def note(self, text: str) -> None:
        raise AssertionError(text)


def flashed(
    there: Sequence[ModelRobot],
    image: FlashImage = IMAGE,
    *,
    verifies: bool = True,
    link: Link | None = None,
    **wish: object,
) -> Upload:
    link = link or Link(Swarm(image, there), verifies=verifies)
    upload = Upload(Wish(image, **wish), verifies, 1)  # type: ignore[arg-type]
    SwarmFlasher(upload, link, link, Display(), ["kilotwin", "flash", "robots", "my.c"]).run()
    return upload


def test_each_step_is_shown_once_and_its_share_grows() -> None:
    display = Display()
    link = Link(Swarm(IMAGE, [ModelRobot(1)]))
    upload = Upload(Wish(IMAGE), True, 1)
    SwarmFlasher(upload, link, link, display).run()
    assert display.steps == [
        "looking for robots",
        "calling robots into their boot loaders",
        "lap 1: 10 pages; 0 of 1 robots have all",
        "lap 1: asking robots what they have",
        "starting the program",
    ]
    assert max(display.shares) == 0.9


def test_the_table_and_the_last_line_say_that_all_have_it() -> None:
    upload = flashed([ModelRobot(12), ModelRobot(3)])
    lines = over_the_air.text(upload).splitlines()
    number = f"{IMAGE.image_id:08X}"
    assert lines[0].split() == ["uid", "module", "cell", "missing", "image", "state"]
    assert lines[1].split() == ["3", "1-2", "0", "0", number, "verified,", "started"]
    assert lines[2].split() == ["12", "1-2", "0", "0", number, "verified,", "started"]
    assert lines[3] == f"flashed and verified: 2 of 2 robots, 10 pages, image {number}, 1 lap"
    assert len(lines) == 4
    told = over_the_air.as_dict(upload)
    assert told["done"]
    assert told["verified"] == [3, 12]
    assert told["failed"] == []
    assert told["robots"][0]["state"] == "verified, started"
    assert upload.well


def test_with_run_it_says_how_many_run() -> None:
    upload = flashed([ModelRobot(1)], OURS, run=True)
    assert over_the_air.text(upload).splitlines()[-1] == "1 of 1 robots say that they run"
    assert "verified, runs" in over_the_air.text(upload)
    assert over_the_air.as_dict(upload)["build_id"] == str(OURS.build_id)
    theirs = flashed([ModelRobot(1)], run=True)
    assert "a program of another runtime does not say" in over_the_air.text(theirs)
    assert theirs.well


def test_a_robot_that_does_not_run_has_failed() -> None:
    class Stays(ModelRobot):
        """Is deaf to RUN."""

        def __setattr__(self, name: str, value: object) -> None:
            super().__setattr__(name, ModelRobot.application if name == "application" else value)

    upload = flashed([Stays(1)], OURS, run=True)
    assert upload.done
    assert not upload.well
    assert over_the_air.text(upload).splitlines()[-1] == "0 of 1 robots say that they run"


def test_those_that_failed_are_listed() -> None:
    there = [ModelRobot(1), ModelRobot(2, broken=True), ModelRobot(3, mute=True)]
    upload = flashed(there, uids=frozenset({1, 2, 3}))
    text = over_the_air.text(upload)
    assert "verified, waits in its boot loader" in text
    assert "all pages, but the CRC is wrong" in text
    assert "no answer" in text
    assert "1 of 3 robots are verified; the program was not started\nfailed: 2, 3\n" in text
    assert over_the_air.as_dict(upload)["failed"] == [2, 3]
    assert not upload.well


def test_those_that_were_never_heard_are_counted() -> None:
    upload = flashed([ModelRobot(1)], count=3)
    assert "never heard: 2 of the 3 expected" in over_the_air.text(upload)
    assert over_the_air.as_dict(upload)["never_heard"] == 2


@pytest.mark.parametrize(
    ("verifies", "why"), [(True, "no robot answers"), (False, "no answer comes back by this way")]
)
def test_without_answers_nothing_is_called_done(verifies: bool, why: str) -> None:
    upload = flashed([ModelRobot(1, mute=True)], verifies=verifies)
    text = over_the_air.text(upload)
    number = f"{IMAGE.image_id:08X}"
    assert text.startswith(f"sent 3 laps of 10 pages, image {number}; not verifiable: {why}\n")
    assert "done" not in text
    assert "flashed" not in text
    told = over_the_air.as_dict(upload)
    assert told["verified"] is None
    assert not told["done"]
    assert upload.well


def test_robots_without_a_uid_are_mentioned() -> None:
    assert "cannot be told apart" in over_the_air.text(flashed([ModelRobot(ALL_ROBOTS)]))


def test_all_states_have_words() -> None:
    upload = flashed([ModelRobot(1)])
    robot = upload.robots[1]
    robot.application = None
    assert over_the_air.state_of(robot) == "verified"
    robot.verified = False
    assert over_the_air.state_of(robot) == "loading"
    robot.state = LoaderState.NOTHING
    assert over_the_air.state_of(robot) == "in its boot loader, without a program"
    robot.application = RobotState.IDLE
    assert over_the_air.state_of(robot) == "still in its old program"


@pytest.mark.parametrize(
    ("at", "what"),
    [
        (1, "0 robots have all of the program, 0 have a part"),
        (7, "0 robots have all of the program, 2 have a part and wait for the rest"),
        (13, "2 robots have all of the program, 0 have a part"),
    ],
)
def test_what_robots_hold_is_said_when_it_breaks_off(at: int, what: str) -> None:
    again = r"; type the same again: kilotwin flash robots my\.c"
    for failure, error in (
        (DeviceError("--can can0: network is down"), DeviceError),
        (KeyboardInterrupt(), InterruptError),
    ):
        link = Link(Swarm(IMAGE, [ModelRobot(1), ModelRobot(2)]))
        link.fails_at, link.failure = at, failure
        with pytest.raises(error, match=f"(network is down|broken off); {what}.*{again}"):
            flashed([], link=link)


def test_before_the_call_robots_are_untouched() -> None:
    link = Link(Swarm(IMAGE, []))
    flasher = SwarmFlasher(Upload(Wish(IMAGE), True, 1), link, link, Display())
    assert flasher.state() == "robots were not touched"


def test_without_answers_what_they_hold_is_not_known() -> None:
    link = Link(Swarm(IMAGE, [ModelRobot(1)]), verifies=False)
    link.fails_at = 8
    with pytest.raises(DeviceError, match="1 laps were sent, and what robots hold is not known"):
        flashed([], verifies=False, link=link)


@pytest.mark.parametrize(
    ("text", "uids"),
    [("1", {1}), ("1-3,60", {1, 2, 3, 60}), (" 5 , 7-7", {5, 7}), ("0-1,1", {0, 1})],
)
def test_uids_are_numbers_and_ranges(text: str, uids: set[int]) -> None:
    assert parse_uids(text) == uids


@pytest.mark.parametrize("text", ["", "a", "3-1", "1-", "65535", "1,,2", "-1", "1-70000"])
def test_what_are_no_uids_is_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"--uids .*: not numbers up to 65534 or ranges"):
        parse_uids(text)
