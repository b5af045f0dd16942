"""The overhead controller: what a [[command]] becomes on the wire, and when."""

from pathlib import Path

import pytest

from kilotwin.experiment.schema.experiment import Command
from kilotwin.experiment.schema.profile_defaults import PROFILES
from kilotwin.experiment.spec.engine import commands
from kilotwin.experiment.spec.overhead import message_of, region, timed, uids

from ..conftest import SMALL, Kilotwin, Load

KILOBOT = PROFILES["kilobot"]


def command(send: str, **keys: object) -> Command:
    return Command.model_validate({"at_s": 0, "send": send, **keys})


@pytest.mark.parametrize(
    ("send", "keys", "data", "message_type"),
    [
        ("run", {}, b"", 0x88),
        ("pause", {}, b"", 0x85),
        ("wakeup", {}, b"", 0x85),
        ("sleep", {}, b"", 0x84),
        ("reset", {}, b"", 0x83),
        ("voltage", {}, b"", 0x87),
        ("charge", {}, b"", 0x86),
        ("readuid", {"bit": 3}, b"\x03", 0x89),
        ("user", {"type": 5, "data": [1, 2]}, b"\x01\x02", 5),
        ("user", {"type": 5}, b"", 5),
        ("calib", {"mode": "straight", "straight_left": 60}, b"\x04\0\0\x46\x46\x3c\x41", 0x8A),
        (
            "calib",
            {
                "mode": "save",
                "uid": 0x1234,
                "turn_left": 1,
                "turn_right": 2,
                "straight_left": 3,
                "straight_right": 4,
            },
            b"\0\x34\x12\x01\x02\x03\x04",
            0x8A,
        ),
    ],
)
def test_a_message_is_as_robots_know_it(
    send: str, keys: dict[str, object], data: bytes, message_type: int
) -> None:
    expected = data.ljust(9, b"\0") + bytes([message_type])
    assert message_of(command(send, **keys), KILOBOT) == expected


def test_it_is_for_all_for_some_or_for_one() -> None:
    assert uids(command("run")) == (0, 65535)
    assert uids(command("run", uid_first=3)) == (3, 65535)
    assert uids(command("run", uid_last=0)) == (0, 0)
    assert uids(command("run", robot=1)) == (1, 1)


def test_it_is_for_all_places_or_one() -> None:
    assert region(command("run")) is None
    assert region(command("run", centre_m=[1, -0.5], within_m=0.2)) == (1.0, -0.5, 0.2)


def test_it_is_repeated_once_a_tick() -> None:
    def ticks(**keys: object) -> list[int]:
        return [tick for tick, *_ in timed(command("run", **keys), KILOBOT)]

    assert ticks() == [0]
    assert ticks(at_s=1.0) == [31]
    assert ticks(at_s=1.0, repeat_s=0.1) == [31, 32, 33]


def test_a_command_takes_the_place_of_run(load: Load) -> None:
    text = f'{SMALL}\n[[command]]\nat_s = 2\nsend = "voltage"\n'
    assert commands(load(text)) == [(61, 0, 65535, bytes(9) + b"\x87", None)]


def test_an_empty_list_leaves_robots_idle(load: Load) -> None:
    assert commands(load(f"command = []\n{SMALL}")) == []


def test_commands_come_after_config(load: Load) -> None:
    text = f'{SMALL}\n[controller]\n[[command]]\nat_s = 0\nsend = "run"\n'
    *configs, run = commands(load(text))
    assert all(tick < -1 for tick, *_ in configs)
    assert configs
    assert run[0] == 0


def test_commands_without_a_run_are_told(kilotwin: Kilotwin, folder: Path) -> None:
    said = 'no [[command]] has send = "run": setup() and loop() are never called'
    for send, told in (("voltage", True), ("run", False)):
        command = f'\n[[command]]\nat_s = 0\nsend = "{send}"\n'
        (folder / "small.toml").write_text(SMALL + command)
        done = kilotwin("run", "small.toml", "--out", f"runs/{send}")
        assert (said in done.stderr) == told
