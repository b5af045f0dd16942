"""An upload over a model of robots: which get the program, and what is said of the others."""

import itertools
import random

import pytest

from kilotwin.files.flash_image import FlashImage
from kilotwin.files.headers import ALL_ROBOTS
from kilotwin.table.flash.upload import Action, Announce, Ask, Pause, Repeat, SendPage, Upload, Wish
from kilotwin.table.links import messages
from kilotwin.table.links.robot_link import LoaderState, MessageType, RobotState

from .swarm_model import ModelRobot, Swarm

_TEXT = b"robot walker avr-gcc-5.4.0 kilotwin-0.2.0"
OURS = FlashImage(random.Random(1).randbytes(40 * 128 - 60) + _TEXT + bytes([len(_TEXT)]) + b"KTID")
THEIRS = FlashImage(random.Random(2).randbytes(9 * 128))


def robots(count: int, cells: int = 1) -> list[ModelRobot]:
    return [ModelRobot(uid, frozenset({uid % cells})) for uid in range(1, count + 1)]


def upload(
    image: FlashImage = OURS, *, verifies: bool = True, places: int = 1, **wish: object
) -> Upload:
    return Upload(Wish(image, **wish), verifies, places)  # type: ignore[arg-type]


def sent_pages(swarm: Swarm) -> list[int]:
    return [action.page for action in swarm.actions if isinstance(action, SendPage)]


def repeated(swarm: Swarm, kind: int) -> int:
    return sum(isinstance(a, Repeat) and a.message[9] == kind for a in swarm.actions)


def test_without_losses_a_lap_brings_the_program_to_all_and_starts_it() -> None:
    swarm = Swarm(OURS, robots(20))
    job = upload(run=True)
    swarm.run(job)
    assert job.done
    assert job.laps == 1
    assert swarm.whole() == job.verified == job.running == list(range(1, 21))
    assert sent_pages(swarm) == [*range(len(OURS.pages))]
    assert [robot.starts for robot in swarm.robots] == [1] * 20
    assert job.robots[3].module == (1, 2)
    assert job.robots[3].voltage == 700


@pytest.mark.parametrize("seed", range(5))
def test_with_a_fifth_of_the_frames_lost_four_laps_are_enough_for_fifty(seed: int) -> None:
    """Three more than without losses, although each robot is reached by one cell only."""
    swarm = Swarm(OURS, robots(50, cells=4), loss=0.2, heard=0.5, cells=4, seed=seed)
    job = upload(places=4, count=50)
    swarm.run(job)
    assert job.done
    assert job.laps <= 4
    assert swarm.whole() == job.verified == list(range(1, 51))


def test_later_laps_have_only_what_some_robot_lacks() -> None:
    swarm = Swarm(OURS, robots(5), loss=0.02, seed=3)
    job = upload()
    swarm.run(job)
    assert job.done
    assert job.laps >= 2
    laps, current = list[list[int]](), list[int]()
    for action in swarm.actions:
        if isinstance(action, Announce):
            laps.append(current := [])
        elif isinstance(action, SendPage):
            current.append(action.page)
    assert len(laps[0]) == len(OURS.pages)
    assert 0 < len(laps[1]) < len(OURS.pages)


def test_a_robot_is_asked_with_other_nonces_and_slots_for_so_many() -> None:
    swarm = Swarm(OURS, robots(50), heard=0.3)
    swarm.run(upload(count=50))
    asks = [action for action in swarm.actions if isinstance(action, Ask)]
    assert {ask.slots_log2 for ask in asks if ask.uid == ALL_ROBOTS} <= {6, 7}
    assert {ask.slots_log2 for ask in asks if ask.uid != ALL_ROBOTS} <= {3}
    assert all(a.nonce != b.nonce for a, b in itertools.pairwise(asks))


def test_a_robot_that_has_it_already_costs_no_page() -> None:
    swarm = Swarm(OURS, robots(3))
    swarm.run(upload())
    swarm.actions.clear()
    job = upload()
    swarm.run(job)
    assert job.done
    assert job.laps == 0
    assert swarm.pages_sent == 0


def test_an_upload_that_was_broken_off_goes_on_where_it_was() -> None:
    swarm = Swarm(OURS, robots(3))
    script = upload().script()
    action = next(script)
    while sent_pages(swarm)[-1:] != [29]:
        action = script.send(swarm.perform(action))
    swarm.actions.clear()
    job = upload(uids=frozenset({1, 2, 3}))
    swarm.run(job)
    assert job.done
    assert sent_pages(swarm) == list(range(30, len(OURS.pages)))


def test_a_robot_with_original_firmware_is_sent_laps_and_never_called_done() -> None:
    swarm = Swarm(THEIRS, [ModelRobot(uid, mute=True) for uid in (1, 2)])
    job = upload(THEIRS, laps=2)
    swarm.run(job)
    assert not job.verifiable
    assert not job.done
    assert job.laps == 2
    assert sent_pages(swarm) == [*range(9)] * 2
    assert job.verified == job.failed == []
    assert swarm.whole() == [1, 2]


def test_a_link_without_answers_is_not_asked() -> None:
    swarm = Swarm(THEIRS, robots(2))
    job = upload(THEIRS, verifies=False, laps=3, run=True, uids=frozenset({1, 2}))
    swarm.run(job)
    assert not any(isinstance(action, Ask) for action in swarm.actions)
    assert not job.done
    assert job.laps == 3
    assert [robot.application for robot in swarm.robots] == [RobotState.RUNNING] * 2


def test_of_expected_robots_those_that_do_not_answer_fail_and_none_is_started() -> None:
    there = robots(10)
    there[4].mute = there[7].deaf = True
    swarm = Swarm(OURS, there)
    job = upload(uids=frozenset(range(1, 11)), laps=2)
    swarm.run(job)
    assert not job.done
    assert job.failed == [5, 8]
    assert job.verified == [uid for uid in range(1, 11) if uid not in (5, 8)]
    assert job.laps == 2
    assert not job.started
    assert repeated(swarm, MessageType.START) == 0
    assert sum(robot.starts for robot in swarm.robots) == 0
    assert not job.robots[8].heard


def test_a_robot_more_than_expected_has_to_get_it_as_well() -> None:
    """It is called into its loader with all others."""
    swarm = Swarm(OURS, robots(6))
    job = upload(uids=frozenset(range(1, 6)))
    swarm.run(job)
    assert job.done
    assert job.verified == [1, 2, 3, 4, 5, 6]


def test_a_robot_that_is_not_heard_for_minutes_is_waited_for() -> None:
    """And nothing is sent again meanwhile."""
    there = robots(12)
    swarm = Swarm(OURS, there)
    job = upload(run=True)

    def turn_away(action: Action) -> None:
        pauses = sum(isinstance(action, Pause) for action in swarm.actions)
        there[1].mute = (job.laps == 1 and pauses < 20) or 25 < pauses < 40

    swarm.run(job, turn_away)
    assert job.done
    assert job.laps == 1
    assert job.running == list(range(1, 13))


def test_of_a_count_those_that_were_never_heard_are_counted() -> None:
    swarm = Swarm(OURS, robots(3))
    job = upload(count=5)
    swarm.run(job)
    assert not job.done
    assert job.unknown == 2
    assert job.laps == 3
    assert job.verified == [1, 2, 3]


def test_of_a_count_of_which_none_is_there_nothing_is_done() -> None:
    swarm = Swarm(OURS, [])
    job = upload(count=2)
    swarm.run(job)
    assert job.verifiable
    assert not job.done
    assert job.laps == 3


def test_a_robot_that_missed_the_call_is_called_again() -> None:
    there = robots(3)
    there[1].deaf = True
    swarm = Swarm(OURS, there)
    job = upload(uids=frozenset({1, 2, 3}))

    def wake(action: Action) -> None:
        there[1].deaf = job.laps < 2

    swarm.run(job, wake)
    assert job.done
    assert repeated(swarm, MessageType.BOOT) == 2


def test_pages_that_were_written_wrongly_are_found_by_their_crcs() -> None:
    there = robots(3)
    there[0].damages, there[2].damages = {5, 33}, {7}
    swarm = Swarm(OURS, there)
    job = upload()
    swarm.run(job)
    assert job.done
    assert swarm.whole() == [1, 2, 3]
    assert sorted({*sent_pages(swarm)[len(OURS.pages) :]}) == [5, 7, 33]
    assert repeated(swarm, MessageType.CRC) == 10


def test_a_robot_whose_crc_never_comes_right_is_given_up() -> None:
    there = robots(3)
    there[1].broken = True
    swarm = Swarm(OURS, there)
    job = upload()
    swarm.run(job)
    assert job.failed == [2]
    assert job.robots[2].state is LoaderState.WRONG
    assert job.laps <= 5


def test_a_robot_that_loses_power_again_and_again_is_given_up() -> None:
    there = robots(2)
    swarm = Swarm(OURS, there)
    job = upload()

    def cut_power(action: Action) -> None:
        if isinstance(action, Ask):
            there[1].reset()
            there[1].announced, there[1].old_id = None, 0

    swarm.run(job, cut_power)
    assert job.failed == [2]
    assert job.robots[2].state is LoaderState.NOTHING
    assert job.laps <= 5


def test_a_robot_that_leaves_in_mid_upload_fails_and_gets_it_the_next_time() -> None:
    there = robots(2)
    swarm = Swarm(OURS, there)
    job = upload()

    def leave(action: Action) -> None:
        if job.laps == 1 and isinstance(action, Ask) and not there[1].deaf:
            there[1].reset()
            there[1].deaf, there[1].in_loader, there[1].announced = True, False, None

    swarm.run(job, leave)
    assert job.failed == [2]
    there[1].deaf = False
    again = upload(uids=frozenset({1, 2}))
    swarm.run(again)
    assert again.done
    assert swarm.whole() == [1, 2]


def test_a_call_that_is_missed_for_good_is_seen_at_the_end() -> None:
    class NeverCalled(ModelRobot):
        """Its runtime does not know BOOT."""

        @property
        def in_loader(self) -> bool:
            return False

        @in_loader.setter
        def in_loader(self, value: bool) -> None:
            pass

    swarm = Swarm(OURS, [ModelRobot(1), NeverCalled(2, application=RobotState.RUNNING)])
    job = upload()
    swarm.run(job)
    assert job.failed == [2]
    assert job.robots[2].application is RobotState.RUNNING


def test_a_robot_that_stays_in_its_loader_is_told_to_start_again() -> None:
    there = robots(2)
    swarm = Swarm(OURS, there)
    job = upload()

    def overhear(action: Action) -> None:
        starts = isinstance(action, Repeat) and action.message == messages.START
        there[1].deaf = starts and repeated(swarm, MessageType.START) == 0

    swarm.run(job, overhear)
    assert [robot.starts for robot in there] == [1, 1]
    assert repeated(swarm, MessageType.START) == 2


def test_a_robot_that_does_not_run_is_told_again() -> None:
    there = robots(2)
    swarm = Swarm(OURS, there)
    job = upload(run=True)

    def stop(action: Action) -> None:
        if repeated(swarm, 0x88) < 3:
            there[1].application = RobotState.IDLE

    swarm.run(job, stop)
    assert repeated(swarm, 0x88) == 3
    assert job.running == [1, 2]


def test_a_program_of_another_runtime_is_not_asked_whether_it_runs() -> None:
    swarm = Swarm(THEIRS, robots(2))
    job = upload(THEIRS, run=True)
    swarm.run(job)
    assert job.done
    assert not job.answers_when_running
    assert repeated(swarm, 0x88) == 1
    last = swarm.actions[-1]
    assert isinstance(last, Repeat)
    assert [robot.application for robot in swarm.robots] == [RobotState.RUNNING] * 2


def test_robots_without_a_uid_of_their_own_are_asked_together() -> None:
    swarm = Swarm(OURS, [ModelRobot(ALL_ROBOTS), ModelRobot(3)])
    job = upload()
    swarm.run(job)
    assert job.done
    assert job.verified == [3, ALL_ROBOTS]


def test_progress_tells_the_lap_and_its_share() -> None:
    swarm = Swarm(OURS, robots(2))
    job = upload(uids=frozenset({1, 2}))
    shares, texts = list[float](), set[str]()

    def look(action: Action) -> None:
        if isinstance(action, SendPage):
            shares.append(job.progress.share)
        texts.add(job.progress.text)

    swarm.run(job, look)
    assert shares[1:] == sorted(shares[1:])
    assert 0.9 < shares[-1] < 1
    assert "lap 1: 40 pages; 0 of 2 robots have all" in texts
