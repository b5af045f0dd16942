"""Answers of a grid, held against the needs of an experiment."""

from dataclasses import replace

import pytest

from kilotwin.experiment.spec.grid_layout import Layout
from kilotwin.files.headers import ALL_ROBOTS, VITALS
from kilotwin.files.message_crc import message_crc
from kilotwin.table.can.protocol import BusHealth, Health, ModuleState
from kilotwin.table.links.readiness import (
    Finding,
    GridVerdict,
    NotAsked,
    Seen,
    Wanted,
    as_dict,
    is_ready,
    judge,
    text,
)
from kilotwin.table.links.robot_link import Report

LAYOUT = Layout(2, 2, 2)
CONFIGURATION = b"\x01\x02"
WANTED = Wanted(dict.fromkeys(LAYOUT.modules(), CONFIGURATION), robots=2, answering=True)


def holding(content: bytes, state: ModuleState = ModuleState.IDLE) -> Health:
    return Health(state, len(content), message_crc(content) if content else 0xFFFF, 0, 0)


def robot(uid: int, reading: int = 700, state: int = 0x10) -> Report:
    content = bytes([reading & 255, 0, 0, reading >> 8 << 6])
    return Report(uid, VITALS, content, state, module=(0, 0), cell=1)


def robots(*all_: Report) -> dict[int, Report]:
    return {one.uid: one for one in all_}


SEEN = Seen(
    layout=LAYOUT,
    names=("can0", "can1"),
    down={},
    silent=[],
    health=dict.fromkeys(LAYOUT.modules(), holding(CONFIGURATION)),
    bus_health=dict.fromkeys(LAYOUT.modules(), BusHealth(0, 0, 9, 1)),
    robots=robots(robot(7), robot(9)),
)


def finding(what: str, seen: Seen, wanted: Wanted = WANTED) -> Finding:
    (one,) = (one for one in judge(seen, wanted) if one.what == what)
    return one


def test_a_whole_table_is_ready_line_by_line() -> None:
    found = judge(SEEN, WANTED)
    assert [one.what for one in found] == [
        *("buses", "modules", "firmware", "states", "configuration", "robots", "batteries")
    ]
    assert {one.verdict for one in found} == {GridVerdict.READY}
    assert is_ready(found)
    assert text(found).splitlines()[-1] == "ready"
    assert as_dict(found)["ready"] is True


def test_silent_modules_are_named_and_it_is_not_ready() -> None:
    health = {m: h for m, h in SEEN.health.items() if m != (1, 0)}
    bus_health = {m: h for m, h in SEEN.bus_health.items() if m != (1, 0)}
    seen = replace(SEEN, silent=[(1, 0)], health=health, bus_health=bus_health)
    found = judge(seen, WANTED)
    modules = finding("modules", seen)
    assert (modules.verdict, modules.modules) == (GridVerdict.NOT_READY, ((1, 0),))
    assert modules.found == "3 of 4 answer; silent: 1-0"
    assert text(found).splitlines()[-1] == "not ready"
    others = {one.verdict for one in found if one.what != "modules"}
    assert others == {GridVerdict.READY}


def test_a_bus_that_is_down_is_named_and_it_is_not_ready() -> None:
    seen = replace(SEEN, down={1: "gone"}, silent=[(0, 1), (1, 1)], robots=NotAsked.BUS_DOWN)
    buses = finding("buses", seen)
    assert (buses.verdict, buses.found) == (GridVerdict.NOT_READY, "1 of 2 work; can1: gone")
    assert finding("robots", seen).found == "not asked, since a bus is down"


def test_a_bus_with_many_errors_is_to_be_looked_at() -> None:
    seen = replace(SEEN, bus_health={**SEEN.bus_health, (0, 1): BusHealth(96, 0, 9, 1)})
    buses = finding("buses", seen)
    assert (buses.verdict, buses.modules) == (GridVerdict.LOOK, ((0, 1),))


def test_modules_with_another_build_than_most_are_not_ready() -> None:
    seen = replace(SEEN, bus_health={**SEEN.bus_health, (0, 1): BusHealth(0, 0, 9, 2)})
    firmware = finding("firmware", seen)
    assert firmware.verdict is GridVerdict.NOT_READY
    assert firmware.found == "3 of version 1, 1 of version 2: 0-1"


def test_a_module_that_does_not_tell_its_build_is_to_be_looked_at() -> None:
    seen = replace(
        SEEN,
        bus_health={m: h for m, h in SEEN.bus_health.items() if m != (0, 1)},
        health={m: h for m, h in SEEN.health.items() if m != (0, 1)},
    )
    firmware = finding("firmware", seen)
    assert firmware.verdict is GridVerdict.LOOK
    assert firmware.found == "3 of version 1, 1 do not say: 0-1"


def test_original_modules_are_ready_as_far_as_they_say() -> None:
    seen = replace(SEEN, health={}, bus_health={}, robots=NotAsked.NO_MODULE)
    found = judge(seen, WANTED)
    assert [one.what for one in found] == ["buses", "modules", "firmware", "robots"]
    assert is_ready(found)
    assert not any(one.concerns_record for one in found if one.verdict is not GridVerdict.READY)


def test_another_configuration_and_none_are_told_apart_and_left_to_set_up() -> None:
    health = {**SEEN.health, (0, 1): holding(b"\x01\x03"), (1, 1): holding(b"")}
    configuration = finding("configuration", replace(SEEN, health=health))
    assert configuration.verdict is GridVerdict.LOOK
    assert configuration.found == "2 hold the experiment's, 1 another: 0-1, 1 none: 1-1"
    assert configuration.modules == ((0, 1), (1, 1))
    assert not configuration.concerns_record


def test_modules_that_run_or_write_are_to_be_looked_at_and_are_stopped_by_set_up() -> None:
    for state in (ModuleState.RUNNING, ModuleState.BOOTLOADING_KILOBOTS):
        health = {**SEEN.health, (0, 1): holding(CONFIGURATION, state)}
        states = finding("states", replace(SEEN, health=health))
        assert (states.verdict, states.modules) == (GridVerdict.LOOK, ((0, 1),))
        assert not states.concerns_record


@pytest.mark.parametrize(
    ("answers", "verdict", "found"),
    [
        ({}, GridVerdict.NOT_READY, "0 of 2 awake"),
        (robots(robot(7)), GridVerdict.LOOK, "1 of 2 awake"),
        (robots(robot(7), robot(8), robot(9)), GridVerdict.LOOK, "3 of 2 awake"),
        (robots(robot(7), robot(9, state=2)), GridVerdict.NOT_READY, "in their boot loader: 9"),
        (robots(robot(ALL_ROBOTS)), GridVerdict.LOOK, "cannot be told apart"),
    ],
)
def test_robots_are_counted(answers: dict[int, Report], verdict: GridVerdict, found: str) -> None:
    one = finding("robots", replace(SEEN, robots=answers))
    assert one.verdict is verdict
    assert found in one.found


def test_robots_that_were_asked_a_few_times_need_not_be_all() -> None:
    few = replace(WANTED, all_asked=False)
    one = finding("robots", replace(SEEN, robots=robots(robot(7))), few)
    assert one.verdict is GridVerdict.READY
    none = finding("robots", replace(SEEN, robots={}), few)
    assert none.verdict is GridVerdict.NOT_READY


def test_robots_with_the_original_runtime_are_not_missed() -> None:
    one = finding("robots", replace(SEEN, robots={}), replace(WANTED, answering=False))
    assert one.verdict is GridVerdict.LOOK


@pytest.mark.parametrize(
    ("reading", "verdict"),
    [(700, GridVerdict.READY), (620, GridVerdict.LOOK), (600, GridVerdict.NOT_READY)],
)
def test_the_emptiest_batteries_decide(reading: int, verdict: GridVerdict) -> None:
    seen = replace(SEEN, robots=robots(robot(7), robot(9, reading)))
    one = finding("batteries", seen)
    assert one.verdict is verdict
    assert one.robots == (() if verdict is GridVerdict.READY else (9,))


def test_long_lists_are_cut_short_in_text_and_whole_in_json() -> None:
    layout = Layout(10, 2, 2)
    silent = sorted(layout.modules())
    seen = replace(SEEN, layout=layout, silent=silent, health={}, bus_health={})
    assert finding("modules", seen).found.endswith("and 12 more")
    assert len(finding("modules", seen).modules) == 20
