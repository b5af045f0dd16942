"""`kilotwin robots`: which messages go out, for how long, and what is said."""

import contextlib
import json
from collections.abc import Iterator

import pytest
from typer.testing import CliRunner, Result

from kilotwin.commands import robots
from kilotwin.errors import InputError
from kilotwin.experiment.spec.overhead import COMMANDS, readuid
from kilotwin.files.headers import ALL_ROBOTS, VITALS
from kilotwin.table.links.robot_link import Report


class Link:
    """Keeps what is repeated, and answers a question as `answers` has it."""

    name, laps_per_place = "model", 1

    def __init__(self) -> None:
        self.verifies = False
        self.repeated: list[tuple[bytes, float]] = []
        self.answers: list[list[Report]] = []
        self.interrupts = False

    def repeat(self, message: bytes, hold_s: float) -> None:
        self.repeated.append((message, hold_s))

    def ask(self, first: int, slots_log2: int, nonce: int, uid: int = ALL_ROBOTS) -> list[Report]:
        assert first == VITALS
        if not self.answers and self.interrupts:
            raise KeyboardInterrupt
        return self.answers.pop(0) if self.answers else []


@pytest.fixture
def link(monkeypatch: pytest.MonkeyPatch) -> Link:
    made = Link()

    @contextlib.contextmanager
    def opened(via: str, buses: list[str] | None, size: str | None) -> Iterator[Link]:
        assert via == "model"
        yield made

    monkeypatch.setattr(robots, "link_to_robots", opened)
    return made


def typed(*words: str) -> Result:
    return CliRunner().invoke(robots.app, [*words, "--via", "model"], catch_exceptions=False)


def vitals(uid: int) -> Report:
    return Report(uid, VITALS, bytes([0xBC, 0, 0, 0x80]), 0x12, module=(0, 1), cell=2)


@pytest.mark.parametrize("name", ["run", "pause", "reset", "sleep", "charge"])
def test_an_order_is_repeated_for_three_seconds(name: str, link: Link) -> None:
    done = typed(name)
    assert done.stdout == f"robots have been told: {name}\n"
    assert link.repeated == [(bytes(9) + bytes([COMMANDS[name]]), 3.0)]


def test_waking_takes_as_long_as_sleepers_need_to_look_round_six_times(link: Link) -> None:
    typed("wakeup", "--quiet")
    assert {message for message, _ in link.repeated} == {bytes(9) + bytes([COMMANDS["wakeup"]])}
    assert sum(hold_s for _, hold_s in link.repeated) >= 6 * 8.2


def test_json_says_what_was_told(link: Link) -> None:
    done = typed("pause", "--hold-s", "0.5", "--json", "--quiet")
    assert json.loads(done.stdout) == {"told": "pause", "hold_s": 0.5}


def test_without_answers_voltage_is_a_colour_to_look_at(link: Link) -> None:
    done = typed("voltage")
    assert link.repeated == [(bytes(9) + bytes([COMMANDS["voltage"]]), 3.0)]
    assert "green above 4.0 V, blue above 3.8 V" in done.stdout


def test_without_answers_a_uid_is_shown_bit_by_bit(link: Link) -> None:
    done = typed("uid", "--bits", "3", "--hold-s", "2")
    assert "bit 2: robots that turn left now have 4 in their uid" in done.output
    *shown, (last, _) = link.repeated
    assert shown == [(readuid(bit), 2.0) for bit in range(3)]
    assert last == bytes(9) + bytes([COMMANDS["pause"]])


@pytest.mark.parametrize("verb", ["uid", "voltage"])
def test_answers_come_as_numbers_and_robots_are_told_nothing(verb: str, link: Link) -> None:
    link.verifies, link.answers = True, [[vitals(7)], [vitals(5)]]
    done = typed(verb, "--quiet")
    assert done.stdout.splitlines()[1:] == [
        "  5     0-1     2   4.10      700  running, green",
        "  7     0-1     2   4.10      700  running, green",
        "2 robots answer",
    ]
    assert link.repeated == []


def test_no_answer_is_a_failure(link: Link) -> None:
    link.verifies = True
    done = typed("voltage", "--json", "--quiet")
    assert done.exit_code == 4
    assert json.loads(done.stdout) == []
    assert "robots that sleep do not answer" in done.stderr


def test_a_message_of_ones_own_is_sent(link: Link) -> None:
    done = typed("send", "--type", "5", "--data", "1,0xff")
    assert link.repeated == [(bytes([1, 255, 0, 0, 0, 0, 0, 0, 0, 5]), 3.0)]
    assert done.stdout == "robots have been sent a message of type 5\n"
    done = typed("send", "--type", "5", "--json", "--quiet")
    assert json.loads(done.stdout)["data"] == [0] * 9
    with pytest.raises(InputError, match="not up to 9 bytes"):
        typed("send", "--type", "5", "--data", "300")


def test_watch_shows_table_after_table_until_it_is_interrupted(link: Link) -> None:
    link.verifies, link.interrupts = True, True
    link.answers = [[vitals(7)], [vitals(8)]]
    done = typed("watch")
    assert done.exit_code == 0
    assert "1 robot answers" in done.stdout
    assert "2 robots answer" in done.stdout
    assert "2 robots have answered" in done.stderr


def test_watch_needs_answers(link: Link) -> None:
    with pytest.raises(InputError, match="watch: no answers come back by model"):
        typed("watch")
