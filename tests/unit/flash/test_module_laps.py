"""A program comes into every module of a grid, whatever is lost, and no module is thought to have
it that has not said so."""

import random

import pytest

from kilotwin.experiment.spec.grid_layout import Layout
from kilotwin.files.flash_image import FlashImage
from kilotwin.table.can.protocol import BootReport, read_to_host
from kilotwin.table.flash.module_laps import FRUITLESS_LAPS, Fate, ModuleLaps
from kilotwin.table.flash.module_rounds import Round, groups, old_lap
from kilotwin.table.grid import frames as wire
from kilotwin.table.grid.cover import ALL_MODULES, Group

from .boot_loaders import COMPLETE, Modules

GRID = Layout(3, 4, 2)
PLACES = list(GRID.modules())


def image(pages: int, seed: int = 0) -> FlashImage:
    return FlashImage(random.Random(seed).randbytes(pages * 128 - 5))


class Rig:
    """The laps, modules, and the time that frames and pauses take."""

    def __init__(
        self,
        pages: int = 40,
        layout: Layout = GRID,
        loss: float = 0.0,
        seed: int = 1,
        wanted: list[tuple[int, int]] | None = None,
    ) -> None:
        self.image = image(pages)
        self.layout = layout
        self.modules = Modules(list(layout.modules()), loss, seed)
        wanted = wanted or list(layout.modules())
        spared = [place for place in layout.modules() if place not in wanted]
        self.laps = ModuleLaps(self.image, layout, wanted, spared)
        self.now_s = 10.0
        self.rounds: list[str] = []

    def send(self, round_: Round) -> None:
        self.rounds.append(round_.text)
        began = self.now_s
        for bus, sendings in round_.frames.items():
            self.now_s = began
            for group, frame in sendings:
                assert group.y is None or self.layout.bus_of((0, group.y)) == bus
                for place, data in self.receive(bus, group, frame.data):
                    report = read_to_host(data)
                    if isinstance(report, BootReport):
                        self.laps.take(place, report)
                self.now_s += frame.pause_s
        self.now_s = began + round_.duration_s

    def receive(self, bus: int, group: Group, data: bytes) -> list[tuple[tuple[int, int], bytes]]:
        """Answers of the modules of one bus."""
        if group.y is not None:
            return self.modules.receive(wire.id_of_group(group), data, self.now_s)
        answers = []
        for y in self.layout.rows_of(bus):
            row = Group(group.x, y)
            answers += self.modules.receive(wire.id_of_group(row), data, self.now_s)
        return answers

    def run(self, most: int = 400) -> None:
        for _ in range(most):
            if (round_ := self.laps.next_round()) is None:
                return
            self.send(round_)
        raise AssertionError(f"no end: {self.rounds[-5:]}")

    def fates(self) -> set[Fate]:
        return {self.laps.fate(place) for place in self.modules.of}


def test_without_losses_one_lap_does() -> None:
    rig = Rig()
    rig.run()
    assert rig.fates() == {Fate.VERIFIED}
    assert rig.modules.programs() == {rig.image.padded}
    assert (rig.laps.laps, rig.laps.pages_sent) == (1, 40)
    assert not any(rig.laps.had_it(place) for place in PLACES)


@pytest.mark.parametrize("loss", [0.01, 0.1, 0.2])
@pytest.mark.parametrize("seed", [1, 2])
def test_losses_are_made_up_for_by_laps_of_what_is_missing(loss: float, seed: int) -> None:
    rig = Rig(loss=loss, seed=seed)
    rig.run()
    assert rig.fates() == {Fate.VERIFIED}
    assert rig.modules.programs() == {rig.image.padded}
    assert rig.laps.pages_sent < 40 * rig.laps.laps


def test_modules_that_have_the_program_are_sent_nothing() -> None:
    rig = Rig()
    for module in rig.modules.of.values():
        module.program = rig.image.padded
    rig.run()
    assert rig.fates() == {Fate.VERIFIED}
    assert rig.laps.laps == 0
    assert all(rig.laps.had_it(place) for place in PLACES)


def test_a_program_that_was_broken_off_goes_on_where_it_was() -> None:
    rig = Rig(loss=0.0005)
    while rig.laps.laps < 1:
        round_ = rig.laps.next_round()
        assert round_ is not None
        half = {bus: sent[: len(sent) // 2] for bus, sent in round_.frames.items()}
        rig.send(Round(round_.text, half if rig.laps.laps else round_.frames, round_.settle_s))
    rig.laps = ModuleLaps(rig.image, rig.layout, PLACES)
    rig.run()
    assert rig.fates() == {Fate.VERIFIED}
    first = next(text for text in rig.rounds[::-1] if text.startswith("lap 1: "))
    assert 20 <= int(first.split()[2]) < 40


def test_a_module_that_was_switched_off_and_on_begins_anew() -> None:
    rig = Rig()
    victim = rig.modules.of[1, 1]
    while rig.laps.laps < 1:
        round_ = rig.laps.next_round()
        assert round_ is not None
        cut = {bus: sent[: len(sent) // 2] for bus, sent in round_.frames.items()}
        rest = {bus: sent[len(sent) // 2 :] for bus, sent in round_.frames.items()}
        rig.send(Round(round_.text, cut, 0.0))
        if rig.laps.laps == 1:
            victim.power_cycle()
        rig.send(Round(round_.text, rest, round_.settle_s))
    rig.run()
    assert rig.fates() == {Fate.VERIFIED}
    assert victim.program == rig.image.padded
    assert rig.laps.laps == 2


def test_a_module_that_dies_is_given_up_and_the_others_go_on() -> None:
    rig = Rig()
    victim = rig.modules.of[2, 0]
    while (round_ := rig.laps.next_round()) is not None:
        victim.dead |= round_.text.startswith("lap 1: ")
        rig.send(round_)
    assert rig.laps.fate((2, 0)) is Fate.LOST
    assert rig.laps.missing((2, 0)) > 0
    assert rig.fates() == {Fate.LOST, Fate.VERIFIED}
    assert rig.laps.laps == 1
    assert any(text.startswith("waiting for modules") for text in rig.rounds)


def test_a_module_that_is_back_in_time_is_flashed() -> None:
    rig = Rig()
    victim = rig.modules.of[2, 0]
    while (round_ := rig.laps.next_round()) is not None:
        if round_.text.startswith("lap 1: "):
            victim.dead = True
        elif round_.text.startswith("waiting") and victim.dead:
            victim.dead = False
            victim.power_cycle()
        rig.send(round_)
    assert rig.fates() == {Fate.VERIFIED}


def test_pages_that_went_to_a_wrong_place_are_found_by_their_crc() -> None:
    """Loaders that take chunks behind a lost page number for the page before."""
    rig = Rig(pages=100, loss=0.05)
    for module in rig.modules.of.values():
        module.forget_ends = True
    rig.run()
    assert rig.fates() == {Fate.VERIFIED}
    assert rig.modules.programs() == {rig.image.padded}


def test_a_program_that_no_loader_can_start_is_told() -> None:
    rig = Rig(pages=3)
    rig.modules.of[0, 0].startable = False
    rig.run()
    assert rig.laps.fate((0, 0)) is Fate.WRONG
    assert rig.laps.missing((0, 0)) == 0
    assert rig.laps.fate((1, 0)) is Fate.VERIFIED


def test_a_module_that_takes_no_pages_is_given_up() -> None:
    rig = Rig(pages=3)
    rig.modules.of[0, 0].takes_pages = False
    rig.run()
    assert rig.laps.fate((0, 0)) is Fate.INCOMPLETE
    assert rig.laps.missing((0, 0)) == 3
    assert rig.laps.laps == FRUITLESS_LAPS


def test_modules_that_never_report_are_mute_and_keep_their_program() -> None:
    rig = Rig()
    rig.modules.of[0, 0].enters = False
    rig.modules.of[1, 0].ours = False
    rig.modules.of[2, 0].dead = True
    rig.run()
    assert rig.laps.mute == [(0, 0), (1, 0), (2, 0)]
    assert {rig.laps.fate(place) for place in rig.laps.mute} == {Fate.MUTE}
    assert len(rig.laps.verified) == len(PLACES) - 3
    assert {rig.modules.of[place].program for place in rig.laps.mute} == {b"old"}


def test_no_pages_are_sent_if_no_module_reports() -> None:
    rig = Rig()
    for module in rig.modules.of.values():
        module.dead = True
    rig.run()
    assert rig.laps.laps == 0
    assert rig.fates() == {Fate.MUTE}


def test_modules_that_are_spared_hear_nothing() -> None:
    wanted = [(0, 0), (1, 0), (2, 0), (1, 2)]
    rig = Rig(wanted=wanted)
    rig.run()
    assert set(rig.laps.verified) == set(wanted)
    for place, module in rig.modules.of.items():
        if place not in wanted:
            assert (module.program, module.sent, module.in_loader) == (b"old", [], False)


def test_only_modules_with_the_program_are_started() -> None:
    rig = Rig(pages=3)
    rig.modules.of[0, 0].startable = False
    rig.run()
    rig.send(rig.laps.start())
    inside = [place for place, module in rig.modules.of.items() if module.in_loader]
    assert inside == [(0, 0)]


def test_reports_of_others_are_not_heeded() -> None:
    rig = Rig(wanted=[(0, 0)])
    report = BootReport(first=0xE0, missing=rig.image.image_id, state=COMPLETE, id_low=0)
    rig.laps.take((2, 2), report)
    assert rig.laps.verified == []


def test_a_report_of_another_program_takes_the_verdict_back() -> None:
    rig = Rig(wanted=[(0, 0)])
    low = rig.image.image_id & 0xFF
    rig.laps.take((0, 0), BootReport(0xE0, rig.image.image_id, COMPLETE, low))
    assert rig.laps.verified == [(0, 0)]
    rig.laps.take((0, 0), BootReport(0, 0, COMPLETE, low ^ 1))
    assert rig.laps.verified == []


@pytest.mark.parametrize(
    ("wanted", "spared", "found"),
    [
        ([], [(0, 0)], []),
        ([(0, 0), (1, 1)], [], [ALL_MODULES]),
        ([(0, 0), (1, 0), (1, 1)], [(0, 1)], [Group(None, 0), Group(1, 1)]),
        ([(0, 1)], [(0, 0)], [Group(None, 1)]),
    ],
)
def test_no_address_reaches_a_module_that_is_spared(
    wanted: list[tuple[int, int]], spared: list[tuple[int, int]], found: list[Group]
) -> None:
    of_bus = [(0, 0), (1, 0), (0, 1), (1, 1)]
    assert groups(wanted, spared, of_bus) == found


def test_original_loaders_are_sent_one_lap_and_ours_are_left_alone() -> None:
    rig = Rig()
    for place in ((0, 0), (1, 3)):
        rig.modules.of[place].ours = False
    rig.run()
    ours = rig.laps.verified
    rig.send(old_lap(rig.image, GRID, rig.laps.mute, ours))
    assert rig.modules.programs() == {rig.image.padded}
    assert {module.in_loader for module in rig.modules.of.values() if module.ours} == {True}


def test_an_original_loader_that_misses_a_frame_is_stuck() -> None:
    """Which is why such a lap is never called verified."""
    rig = Rig()
    for module in rig.modules.of.values():
        module.ours = False
    rig.run()
    round_ = old_lap(rig.image, GRID, rig.laps.mute, ())
    frames = next(iter(round_.frames.values()))
    assert isinstance(frames, list)
    del frames[100]
    rig.send(round_)
    stuck = [module for module in rig.modules.of.values() if module.in_loader]
    assert {module.y for module in stuck} == {0, 1}
