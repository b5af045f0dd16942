"""Poses as lines of JSON in datagrams."""

import json
import socket

import pytest

from kilotwin.errors import DeviceError, InputError
from kilotwin.table.environment.poses import PoseListener, parse_address, read_line, write_lines
from kilotwin.table.environment.protocol import SeenRobot

ROBOT = {"uid": 7, "x_m": 0.1, "y_m": -0.05, "heading_rad": 1.5, "led": [0, 3, 0]}
SEEN = SeenRobot(7, 0.1, -0.05, 1.5, (0, 3, 0))


def line(*robots: object) -> bytes:
    return json.dumps({"robots": robots}).encode()


def test_a_line_is_read_as_it_is_documented() -> None:
    dark = {**ROBOT, "uid": 8, "x_m": 1, "confidence": 0.5}
    del dark["led"]
    assert read_line(line(ROBOT, dark)) == [SEEN, SeenRobot(8, 1.0, -0.05, 1.5, None)]
    assert read_line(b'{"robots": [], "camera": 2}') == []


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (b"\xff\xfe", "it is not JSON"),
        (b"{", "it is not JSON"),
        (b"[" * 100_000, "it is not JSON"),
        (b"[]", 'no object with a list "robots"'),
        (b'{"robot": []}', 'no object with a list "robots"'),
        (line(5), "a robot is no object"),
        (line({**ROBOT, "uid": 65535}), "uid is 65535; it must be 0 to 65534"),
        (line({**ROBOT, "uid": True}), "uid is True"),
        (line({**ROBOT, "x_m": "0.1"}), "x_m is '0.1'; it must be a number"),
        (line({**ROBOT, "y_m": None}), "y_m is None"),
        (b'{"robots": [{"uid": 1, "x_m": NaN, "y_m": 0, "heading_rad": 0}]}', "x_m is nan"),
        (line({**ROBOT, "x_m": 10**400}), r"x_m is 10+\.\.\.0+; it must be a number"),
        (line({**ROBOT, "led": [0, 4, 0]}), r"led is \[0, 4, 0\]"),
        (line({**ROBOT, "led": 3}), "led is 3"),
    ],
)
def test_what_is_wrong_with_a_line_is_said(text: bytes, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        read_line(text)


def test_what_is_written_is_read_and_no_datagram_is_too_long() -> None:
    robots = [SeenRobot(uid, uid / 1000, -uid / 500, 0.25, (uid % 4, 0, 3)) for uid in range(300)]
    lines = write_lines(robots)
    assert all(len(datagram) < 1472 for datagram in lines)
    assert [robot for datagram in lines for robot in read_line(datagram)] == robots
    assert write_lines([]) == []


def test_a_listener_has_each_robot_as_it_was_seen_last_and_counts_what_is_of_no_use() -> None:
    listener = PoseListener(("127.0.0.1", 0))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as tracker:
        where = listener.address
        newer = {**ROBOT, "x_m": 0.2}
        tracker.sendto(line({**ROBOT, "uid": 9}) + b"\n" + line(ROBOT) + b"\n", where)
        tracker.sendto(b"nonsense\n" + line(newer), where)
        assert [(robot.uid, robot.x_m) for robot in listener.take()] == [(7, 0.2), (9, 0.1)]
        assert listener.take() == []
    assert (listener.lines, listener.bad_lines) == (4, 1)
    assert listener.trouble == "it is not JSON"
    listener.close()


def test_a_port_that_is_taken_is_told() -> None:
    first = PoseListener(("127.0.0.1", 0))
    with pytest.raises(DeviceError, match=r"--poses udp:127.0.0.1:\d+: address already in use"):
        PoseListener(first.address)
    first.close()


def test_addresses() -> None:
    assert parse_address("udp:0.0.0.0:5005") == ("0.0.0.0", 5005)
    assert parse_address("udp:[::1]:5005") == ("::1", 5005)
    for wrong in ("tcp:a:1", "udp:5005", "udp::5005", "udp:host:", "udp:host:70000", "udp:h:-1"):
        with pytest.raises(InputError, match="write udp:HOST:PORT"):
            parse_address(wrong)
