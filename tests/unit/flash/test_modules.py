"""A flash of a grid's modules from beginning to end: what people are told of each of them."""

import os
import random
import signal
from collections.abc import Callable, Sequence

import numpy as np
import pytest

from kilotwin.errors import DeviceError, InterruptError, RunError
from kilotwin.experiment.spec.grid_layout import Layout
from kilotwin.files.flash_image import FlashImage
from kilotwin.table.can.protocol import to_module
from kilotwin.table.flash.modules import Job, ModulesFlasher, Outcome, Result
from kilotwin.table.flash.modules_table import Inbox, ModulesTable
from kilotwin.table.grid.links import FRAME, NO_FRAMES, Frames

from .boot_loaders import Modules

GRID = Layout(3, 4, 2)
IMAGE = FlashImage(random.Random(5).randbytes(10 * 128))
Watch = Callable[["Rig", bytes], None]


class Rig:
    """Buses, clock and display of a table of modules."""

    def __init__(self, places: Sequence[tuple[int, int]] | None = None, loss: float = 0.0) -> None:
        self.modules = Modules(list(GRID.modules() if places is None else places), loss)
        self.now = 100.0
        self.told: list[str] = []
        self.shares: list[float] = []
        self.down: dict[int, str] = {}
        self.watch: Watch = lambda rig, data: None
        self.inbox = Inbox()
        self._came: list[Frames] = []
        self.table = ModulesTable(
            GRID, self, self.inbox, ["can0", "can1"], clock=self, note=self.told.append
        )

    def flash(
        self,
        modules: Sequence[tuple[int, int]] = (),
        *,
        expect_all: bool = False,
        old_loader: bool = False,
    ) -> Outcome:
        again = ["kilotwin", "flash", "modules", "my prog.hex"]
        job = Job(IMAGE, "prog.hex", modules, expect_all, old_loader, again)
        return ModulesFlasher(job, self.table, self).flash()

    # The clock.

    def now_s(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds

    # The display.

    def step(self, text: str) -> None:
        self.told.append(text)

    def part(self, share: float) -> None:
        self.shares.append(share)

    def note(self, text: str) -> None:
        self.told.append(text)

    # The buses.

    def __len__(self) -> int:
        return GRID.buses

    def send(self, bus: int, identifier: int, data: bytes, now_s: float) -> bool:
        self.watch(self, data)
        if bus in self.down:
            return False
        here = [place for place in self.modules.of if GRID.bus_of(place) == bus]
        self.modules.only = set(here)
        for (x, y), answer in self.modules.receive(identifier, data, now_s):
            self.come(bus, y + 1 << 6 | x + 1 << 1 | 1, answer)
        return True

    def send_all(self, bus: int, identifiers: Sequence[int], data: bytes, now_s: float) -> int:
        return sum(self.send(bus, identifier, data, now_s) for identifier in identifiers)

    def come(self, bus: int, identifier: int, data: bytes) -> None:
        row = np.zeros(1, dtype=FRAME)
        row[0] = (self.now, bus, identifier, len(data), list(data.ljust(8, b"\0")), False)
        self._came.append(row)

    def trouble(self, bus: int) -> str | None:
        return self.down.get(bus)

    def receive(self, now_s: float) -> Frames:
        frames = np.concatenate(self._came) if self._came else NO_FRAMES
        self._came = []
        self.inbox.add(frames)
        return frames

    def close(self) -> None:
        pass


def results(outcome: Outcome) -> dict[tuple[int, int], Result]:
    return {module.module: module.result for module in outcome.modules}


def test_all_modules_are_found_verified_started_and_seen_again() -> None:
    rig = Rig(loss=0.01)
    outcome = rig.flash()
    assert outcome.well
    assert set(results(outcome)) == set(GRID.modules())
    assert set(results(outcome).values()) == {Result.VERIFIED}
    assert not any(module.in_loader for module in rig.modules.of.values())
    assert rig.modules.programs() == {IMAGE.padded}
    text = outcome.text()
    assert text.startswith(" 3 v v v\n 2 v v v\n")
    assert f"prog.hex: 10 pages, image {IMAGE.image_id:08X}\n" in text
    assert "verified (v): 12 of 12 modules; " in text
    assert [line for line in rig.told if line.startswith("lap 1: 10 of 10 pages; 0 of 12 ")]
    assert any(0 < share < 1 for share in rig.shares)


def test_what_they_have_already_is_said() -> None:
    rig = Rig()
    rig.flash()
    outcome = rig.flash()
    assert outcome.well
    assert outcome.laps == 0
    assert "verified (v): 12 of 12 modules, 12 of them before" in outcome.text()
    assert outcome.as_dict()["modules"][0]["had_it"] is True


def test_modules_are_those_that_answer_unless_the_size_is_given() -> None:
    places = [(0, 0), (1, 0), (2, 3)]
    outcome = Rig(places).flash()
    assert outcome.well
    assert set(results(outcome)) == set(places)
    assert "nothing answers at 9 other places (-)" in outcome.text()
    assert outcome.as_dict()["empty_places"] == 9
    outcome = Rig(places).flash(expect_all=True)
    assert not outcome.well
    assert len(outcome.failed) == 9
    assert {module.result for module in outcome.failed} == {Result.SENT}
    assert "failed (x): module 1-1 was sent the program; its boot loader cannot" in outcome.text()


def test_only_named_modules_are_flashed() -> None:
    rig = Rig()
    outcome = rig.flash([(1, 1), (2, 3)])
    assert outcome.well
    assert set(results(outcome)) == {(1, 1), (2, 3)}
    flashed = {place for place, module in rig.modules.of.items() if module.program != b"old"}
    assert flashed == {(1, 1), (2, 3)}
    assert outcome.text().startswith(" 3 . . v\n 2 . . .\n 1 . v .\n")


def test_a_module_in_its_loader_that_answers_no_poll_is_found() -> None:
    rig = Rig()
    for module in rig.modules.of.values():
        module.in_loader, module.program = True, b""
    outcome = rig.flash()
    assert outcome.well
    assert len(outcome.modules) == 12


def test_original_loaders_are_sent_one_lap_and_never_called_verified() -> None:
    rig = Rig()
    for module in rig.modules.of.values():
        module.ours = False
    outcome = rig.flash()
    assert set(results(outcome).values()) == {Result.SENT}
    assert outcome.well
    text = outcome.text()
    assert "not verifiable" in text
    assert "12 modules; 12 of them answer polls again" in text
    assert "verified (v)" not in text
    assert rig.modules.programs() == {IMAGE.padded}


@pytest.mark.parametrize("old_loader", [False, True])
def test_an_original_loader_that_missed_a_frame_fails_since_it_answers_no_more(
    old_loader: bool,
) -> None:
    rig = Rig()
    for module in rig.modules.of.values():
        module.ours = False

    def lose_one(rig: Rig, data: bytes) -> None:
        rig.modules.of[1, 1].dead = data[:2] == b"\xa6\x05"

    rig.watch = lose_one
    outcome = rig.flash(old_loader=old_loader)
    assert [module.module for module in outcome.failed] == [(1, 1)]
    assert "and has not answered since" in outcome.text()
    assert rig.told.count("asking 12 modules what they have") == 0 or not old_loader


def test_ours_and_originals_on_one_bus_both_come_through() -> None:
    rig = Rig()
    for place in ((0, 0), (1, 2)):
        rig.modules.of[place].ours = False
    outcome = rig.flash()
    assert outcome.well
    assert {p for p, result in results(outcome).items() if result is Result.SENT} == {
        (0, 0),
        (1, 2),
    }
    assert rig.modules.programs() == {IMAGE.padded}


def test_a_module_that_does_not_enter_its_loader_keeps_its_program_and_fails() -> None:
    rig = Rig()
    rig.modules.of[2, 2].enters = False
    outcome = rig.flash()
    assert [module.module for module in outcome.failed] == [(2, 2)]
    assert "module 2-2 does not enter its boot loader; it runs what it had" in outcome.text()
    assert rig.modules.of[2, 2].program == b"old"
    assert outcome.as_dict()["failed"] == [[2, 2]]


def test_a_module_whose_program_does_not_come_up_fails() -> None:
    rig = Rig()

    def kill(rig: Rig, data: bytes) -> None:
        module = rig.modules.of[0, 3]
        module.dead |= not module.in_loader and module.program == IMAGE.padded

    rig.watch = kill
    outcome = rig.flash()
    assert [module.text() for module in outcome.failed] == [
        "module 0-3 has the program, and has not answered since"
    ]


def test_a_module_that_stops_answering_is_told_with_what_it_lacks() -> None:
    rig = Rig()

    def kill(rig: Rig, data: bytes) -> None:
        rig.modules.of[0, 3].dead |= data[0] == 0x09

    rig.watch = kill
    outcome = rig.flash()
    lacks = "module 0-3 has stopped answering; is it switched on?; it lacks 10 pages"
    assert [module.text() for module in outcome.failed] == [lacks]


def test_a_bus_that_goes_down_fails_alone() -> None:
    rig = Rig()

    def unplug(rig: Rig, data: bytes) -> None:
        if data[0] == 0x09:
            rig.down[1] = "network is down"

    rig.watch = unplug
    outcome = rig.flash()
    assert not outcome.well
    failed = {module.module: module.result for module in outcome.failed}
    assert failed == {(x, y): Result.UNREACHED for x in range(3) for y in (2, 3)}
    assert any(line.startswith("bus 1 is down (network is down)") for line in rig.told)
    assert "these do not work: can1: network is down" in outcome.text()


def test_when_no_bus_works_the_last_line_says_what_modules_hold() -> None:
    rig = Rig()

    def unplug(rig: Rig, data: bytes) -> None:
        if data[0] == 0x09:
            rig.down.update({0: "gone", 1: "gone"})

    rig.watch = unplug
    with pytest.raises(DeviceError) as caught:
        rig.flash()
    assert str(caught.value) == (
        "--can can0: gone; can1: gone; 12 modules have a part of it or what they had, and wait in "
        "their boot loaders; to go on type: kilotwin flash modules 'my prog.hex'"
    )
    rig.down.clear()
    rig.watch = lambda rig, data: None
    assert rig.flash().well


def interrupting(times: int, at: bytes) -> Watch:
    left = times

    def interrupt(rig: Rig, data: bytes) -> None:
        nonlocal left
        if data.startswith(at) and left:
            left -= 1
            os.kill(os.getpid(), signal.SIGINT)

    return interrupt


def test_ctrl_c_says_what_modules_hold_and_the_same_command_goes_on() -> None:
    rig = Rig()
    rig.watch = interrupting(1, b"\x09\x00\x05")
    with pytest.raises(InterruptError, match="broken off; 12 modules have a part of it or what"):
        rig.flash()
    outcome = rig.flash()
    assert outcome.well
    assert outcome.pages_sent < 10


def test_ctrl_c_before_a_module_was_reached_says_so() -> None:
    rig = Rig()
    rig.watch = interrupting(1, b"\x15")
    with pytest.raises(InterruptError, match="broken off; no module has been changed; type: kilo"):
        rig.flash()


def test_ctrl_c_does_not_leave_original_loaders_with_half_a_program(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("kilotwin.files.interrupts.SAME_S", 0.0)  # the second is another one
    rig = Rig()
    for module in rig.modules.of.values():
        module.ours = False
    rig.watch = interrupting(1, b"\xa8\x00\x05")
    assert rig.flash(old_loader=True).well
    assert any("Ctrl-C again leaves them so" in line for line in rig.told)
    rig.watch = interrupting(2, b"\xa8\x00\x05")
    with pytest.raises(InterruptError, match="have half a program and wait in them: do not switch"):
        rig.flash(old_loader=True)


def test_another_host_that_sends_programs_ends_it() -> None:
    rig = Rig()

    def meddle(rig: Rig, data: bytes) -> None:
        if data[0] == 0x09:
            rig.come(0, 0, to_module("MODULE_BOOTPAGE_NUMBER", Page=3))

    rig.watch = meddle
    with pytest.raises(RunError, match="another host sends programs to these modules; 12 modules"):
        rig.flash()


def test_a_table_that_is_switched_off_is_told() -> None:
    with pytest.raises(DeviceError, match="no module answers; is the table switched on, and is"):
        Rig([]).flash()


def test_frames_that_no_module_sends_are_passed_over() -> None:
    rig = Rig()
    rig.come(0, 0x003, bytes([0x18, 0xE0, 0, 0, 0, 0, 2, 0]))
    rig.come(0, 0x043, bytes([0x18, 0xE0]))
    assert rig.flash().well
